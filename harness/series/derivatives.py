"""The derivative of the largest gap by each random input, at the means, and how far it holds.

While the closed contacts C stay the same, x and λ depend linearly on f and g:

    dx = K⁻¹(df − A_C dλ),    Q_CC dλ = A_Cᵀ K⁻¹ df − dg_C,    dy = dg − Aᵀdx.

If an input moves by t, the largest gap y_j does by t dy_j, as long as λ_C + t dλ ≥ 0, y + t dy ≥ 0 and
y_j + t dy_j is the largest. df and dg are central differences, exact but for rounding where these are linear.
"""

from typing import Any

import numpy as np
from scipy import linalg

from harness.verification.judge import LIMIT_MM, REFERENCE_SHARE
from harness.verification.reference import best_of_candidates
from problems.build import prepared
from problems.load_cases.random_inputs import RandomInputs

from .session import Job

STEP = 1e-3  # of the interquartile range
ROUNDING = 1e-12  # of the largest: a smaller rate is 0
ALIKE = 1e-9  # of the largest: rates that differ by less are the same


def derivatives(job: Job) -> dict[str, list[Any]]:
    """The derivative of the largest gap by each input, at the means.

    Columns: name, mean, derivative in mm per unit and per standard deviation (NaN if the input changes K, or
    if the answer at the means is not proven), and the values between which it holds. The elements of an input
    with `each` move together; the field of the gap is at its mean.
    """
    assert isinstance(job.cases, RandomInputs)
    laws = [one.law for one in job.cases.inputs]
    means = np.array([law.mean() if np.isfinite(law.mean()) else law.median() for law in laws])
    cases = job.cases.with_stiffness(means[:, None])
    data, load = prepared(cases.scene, form=job.form), cases.load_at(means)
    steps = STEP * np.array([law.ppf(0.75) - law.ppf(0.25) for law in laws])
    ends = [(cases.load_at(means + step), cases.load_at(means - step)) for step in np.diag(steps)]
    changes = [(up.f - down.f, up.g - down.g) for up, down in ends]
    df, dg = (np.column_stack(columns) / (2 * steps) for columns in zip(*changes, strict=True))
    K, A = data.assembly.K, data.assembly.A
    answer, free = best_of_candidates(data, load), K.solve(df)
    C = answer.active
    closed, dlam = A[:, C], np.zeros((C.sum(), len(means)))
    if C.any():
        Q, b = K.compliance(closed), closed.T @ free - dg[C]
        dlam = linalg.lstsq(Q, b)[0] if data.assembly.dependent else linalg.cho_solve(linalg.cho_factor(Q), b)
    dy, y = (dg - A.T @ (free - K.solve(closed @ dlam)))[~C], (load.g - A.T @ answer.x)[~C]
    dy = np.where(abs(dy) > ROUNDING * abs(dy).max(axis=0, initial=0.0), dy, 0.0)
    largest = dy[y.argmax()] if len(y) else np.zeros(len(means))
    margin = np.concatenate([answer.lam[C], y, y.max(initial=0.0) - y])[:, None]
    away = largest - dy
    away = np.where(abs(away) > ALIKE * abs(dy).max(axis=0, initial=0.0), away, 0.0)  # as of mirror images
    rate = np.vstack([dlam, dy, away])
    with np.errstate(divide="ignore", invalid="ignore"):
        until = -margin / rate
    low = means + np.where(rate > 0, until, -np.inf).max(axis=0, initial=-np.inf)
    high = means + np.where(rate < 0, until, np.inf).min(axis=0, initial=np.inf)
    unknown = answer.bound_mm > REFERENCE_SHARE * LIMIT_MM  # nor is the set of closed contacts known
    largest = np.where([one.changes_K or unknown for one in cases.inputs], np.nan, largest)
    figures = {"mean": means, "derivative": largest, "per_sd_mm": largest * [law.std() for law in laws]}
    rows = {name: values.tolist() for name, values in (figures | {"low": low, "high": high}).items()}
    return {"input": [one.name for one in cases.inputs]} | rows
