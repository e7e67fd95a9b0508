"""What is said of a user's matrices: sizes, notes, and how many digits K seems to have."""

from __future__ import annotations

import scipy.sparse as sp
from rich.console import Console

from harness.verification.judge import LIMIT_MM
from harness.verification.reference_problem import ReferenceProblem
from problems.forms.assembly import Assembly
from problems.input.digits import DOUBLE, apparent_digits, expected_error


def print_facts(name: str, assembly: Assembly, console: Console) -> None:
    """Print the sizes, and what reading has changed. Raises InputError if K is not positive definite."""
    _ = assembly.K.factors
    blocks = ", ".join(str(K.shape[0]) for K in assembly.K.matrices)
    console.print(f"{name}: matrices, n = {assembly.n}, m = {assembly.m}, blocks of {blocks}.")
    for note in assembly.notes:
        console.print(f"{note}.", style="yellow")


def digits_of(assembly: Assembly) -> int:
    """The fewest digits that the entries of a block of K seem to have, at most 16."""
    return min(apparent_digits(K.data if sp.issparse(K) else K) for K in assembly.K.matrices)


def digits_sentence(problem: ReferenceProblem) -> tuple[str, bool]:
    """A sentence on the digits of K, and whether they are too few for 1e-7 mm at the answer."""
    digits = digits_of(problem.prepared.assembly)
    if digits == DOUBLE:
        return "The entries of K have all digits of double precision", False
    error = expected_error(problem.prepared, problem.reference.x, problem.reference.lam, digits)
    text = f"The entries of K seem to have {digits} digits: if they were rounded, displacements are off by"
    few = error > LIMIT_MM
    more = f", more than {LIMIT_MM:g} mm: export it with more digits" if few else ""
    return f"{text} about {error:.0e} mm{more}", few
