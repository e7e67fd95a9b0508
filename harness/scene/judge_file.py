"""The verdict on an answer that another program has computed."""

from __future__ import annotations

from math import inf
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from harness.results.sides import Incomparable
from harness.terminal.exit_codes import DONE, FAILED, NOTHING_JUDGED
from harness.terminal.progress import STYLES
from harness.verification.judge import Judgement
from harness.verification.reference_problem import ReferenceProblem, reference_problem
from problems.errors import InputError
from problems.forms.assembly import Vector
from problems.forms.names import Form

from .answer_file import read_answer

CODES = {"within": DONE, "outside": FAILED, "cannot_be_judged": NOTHING_JUDGED}
#: The vector that a file without names holds, by the form that it was computed in.
VECTOR_OF = {"primal": "x", "dual": "lam", "sparse": "x"}


def judge_file(
    path: Path,
    source: str,
    form: Form,
    limit_mm: float,
    console: Console,
    reference_limit_s: float | None = None,
) -> int:
    """Print the verdict on the answer in a file; returns 0 within the limit, 1 outside, 3 if not known.

    x (n,) mm, in the sparse form all N unknowns; where there is only λ (m,) N, x = K⁻¹(f − Aλ). Raises
    InputError, Incomparable if a vector is of another length.
    """
    if not 0 < limit_mm < inf:
        raise InputError.one("--limit", "limit, mm", limit_mm, "must be positive and finite")
    given = {name or VECTOR_OF[form]: vector for name, vector in read_answer(path).items()}
    problem = reference_problem(source, limit_s=reference_limit_s, form=form)
    assembly = problem.prepared.assembly
    for name, size in (("x", assembly.n), ("lam", assembly.m)):
        if name in given and len(given[name]) != size:
            allowed = f"{size} in the {form} form of {problem.scene.name}; name another form with --form"
            raise Incomparable.one(path, f"length of {name}", len(given[name]), allowed)
    x, lam = given.get("x"), given.get("lam")
    if x is None:
        assert lam is not None
        x = problem.prepared.recover(lam, problem.load)
    forces = np.full(assembly.m, np.nan) if lam is None else lam
    limit = problem.limit_mm(limit_mm)
    found = problem.judged(x, forces, limit)
    console.print(_table(problem, found, x))
    console.print(_sentence(problem, found, limit), style=STYLES[found.verdict])
    return CODES[found.verdict]


def _sentence(problem: ReferenceProblem, found: Judgement, limit_mm: float) -> str:
    if found.verdict == "cannot_be_judged":
        bound = problem.reference.bound_mm
        return (
            f"Cannot be judged: the reference is proven only to {bound:.1e} mm ({problem.reference.route})."
        )
    return f"{found.verdict.capitalize()} {limit_mm:.3g} mm."


def _table(problem: ReferenceProblem, found: Judgement, x: Vector) -> Table:
    """The judge's figures, and where the largest error is."""
    table = Table("figure", "value", title=f"{problem.scene.name}: the answer judged")
    error, bound = found.displacement_error_mm or 0.0, problem.reference.bound_mm
    figures = {
        "largest displacement error, mm": f"{error:.3e} {_place(problem, x)}",
        "proven: every displacement within, mm": f"{error + bound:.3e}",
        "error bound of the reference, mm": f"{bound:.1e}",
        "contacts open or closed by mistake": str(found.contact_mismatch),
        "largest overlap, mm": f"{found.primal_residual or 0.0:.3e}",
    }
    if found.dual_residual is not None:
        figures |= {
            "largest unbalanced force, N": f"{found.dual_residual:.3e}",
            "duality gap, N·mm": f"{found.duality_gap:.3e}",
        }
    for name, value in figures.items():
        table.add_row(name, value)
    return table


def _place(problem: ReferenceProblem, x: Vector) -> str:
    assembly = problem.prepared.assembly
    nodes = assembly.asked_nodes
    worst = int(np.argmax(assembly.at_junction(abs(x - problem.reference.x))))
    return f"at entry {worst}" if nodes is None else f"at ({nodes[worst, 0]:.4g}, {nodes[worst, 1]:.4g}) mm"
