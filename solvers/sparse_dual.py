"""What methods for the dual problem share on the sparse form: p and y by solutions with K, and x from λ."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from problems.forms.assembly import stacked
from problems.forms.prepared import Prepared

from .base import Answer, LoadCase
from .kkt import EPS

ROUNDING_MM = 1e-7  # what x may be off: a δ beyond is an error, not rounding


def with_p(prepared: Prepared, loads: Sequence[LoadCase]) -> list[LoadCase]:
    """With p = AᵀK⁻¹f − g, (m,) mm; K⁻¹f is computed once if they share their f."""
    columns = prepared.dual_load(stacked(loads)).T
    return [LoadCase(load.f, load.g, p) for load, p in zip(loads, columns, strict=True)]


def with_x(
    prepared: Prepared, answers: Sequence[Answer], loads: Sequence[LoadCase], tolerance: float
) -> list[Answer]:
    """With x = K⁻¹(f − Aλ) refined by δ, and judged by it: "solved" if the KKT residual of y = g − Aᵀx is at
    most max(tolerance, min(4 max(ε|g| + ε|A|ᵀ|x| + |A|ᵀ|δ|), ROUNDING_MM)).
    """
    known = [k for k, answer in enumerate(answers) if answer.lam is not None]
    found = list(answers)
    if not known:
        return found
    assembly, cases = prepared.assembly, stacked([loads[k] for k in known])
    lam = np.column_stack([np.asarray(answers[k].lam) for k in known])
    b = cases.f - assembly.A @ lam
    x = prepared.assembly.K.solve(b)
    delta = prepared.assembly.K.solve(b - assembly.K.multiply(x))
    x = x + delta
    y, size = cases.g - assembly.A.T @ x, abs(assembly.A).T
    rounding = 4 * (EPS * (abs(cases.g) + size @ abs(x)) + size @ abs(delta)).max(axis=0)
    missed = np.where(lam > 0, abs(y), -y).max(axis=0, initial=0.0)
    for column, k in enumerate(known):
        status, residual = found[k].status, float(missed[column])
        if status in ("solved", "inaccurate"):
            allowed = max(tolerance, min(rounding[column], ROUNDING_MM))
            status = "solved" if residual <= allowed else "inaccurate"
        details = found[k].details | {"kkt_residual_mm": residual}
        if status == "solved":
            details.pop("cause", None)
        elif "cause" not in details:
            details["cause"] = f"rounding: optimal only to {residual:.1e} mm"
        found[k] = replace(found[k], status=status, x=x[:, column], details=details)
    return found
