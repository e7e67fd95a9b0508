"""The forces of a load case by the in-house methods in turn: what a reference may be proven from."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from problems.errors import InputError
from problems.forms.assembly import LoadCase, Vector
from problems.forms.names import Form
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form

from .answer import forces_of

DENSE = ("newton", "ipm-fast", "ipm", "gi", "lemke")
SPARSE = ("newton", "mprgp")
TOLERANCE_MM = 1e-11
NO_CONTACT = "no contact closes"


def candidates(prepared: Prepared, load: LoadCase) -> Iterator[tuple[str, Vector]]:
    """Names and λ (m,) N; a method is run when its answer is asked for, none where no contact overlaps."""
    if not (prepared.dual_load(load) > 0).any():
        yield NO_CONTACT, np.zeros(prepared.assembly.m)
        return
    from solvers.registry import make_solver  # slow to import

    form: Form = "dual" if prepared.assembly.K.dense else "sparse"
    for name in SPARSE if form == "sparse" else DENSE:
        try:
            answer = forces_of(name, make_solver(name, {}), in_form(prepared, form), load, TOLERANCE_MM)
        except (InputError, ArithmeticError, np.linalg.LinAlgError, RuntimeError):
            continue  # it gave no answer
        if answer.lam is not None:
            yield f"{name}, refined", answer.lam
