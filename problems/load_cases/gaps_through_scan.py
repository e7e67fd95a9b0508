"""Random gaps that pass through a scan: a Gaussian field whose values at points are measured.

Let z ~ N(0, σ²C) on the joint's grid, and let the scan be d = Wz + ε, with W the weights of its points on
that grid and ε ~ N(0, (νσ)² I). Row k of W is Wy_k ⊗ Wx_k, as C is Cy ⊗ Cx, so that neither is ever made.
Conditional on d the field is (Chilès, Delfiner, Geostatistics, 2012, 7.3.1)

    z + CWᵀ (WCWᵀ + ν²I)⁻¹ (d − ε − Wz).

Its mean is the scan, continued by kriging; its scatter is νσ at the scan's points and σ far from them.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp

from problems.effects.initial_gap import square_root
from problems.errors import Fault, InputError
from problems.forms.assembly import Matrix, Vector
from problems.input.scan_points import crowded, too_small, unlike
from problems.input.tables import AS_NAMED, TableOptions, read_columns
from problems.model.interface import AnyJoint, on_junction
from problems.model.joint import Pair
from problems.storage import digest

NOISE = 1e-3  # ν
MOST = 5000  # points of a scan: WCWᵀ is dense
_last: dict[str, "Scan"] = {}


def read_scan(
    path: Path, joint: AnyJoint, options: TableOptions = AS_NAMED, between: Pair | None = None
) -> tuple[Matrix, list[str]]:
    """(s, 3) x, y and gap in mm, by x and y; and sentences on what is unusual.

    Raises InputError with all faults, also of points off the parts of the pair, or of all, or at one place.
    """
    parts = tuple(name for name in joint.names if name in (between or joint.names))
    read = read_columns(path, ("x", "y", "gap"), options)
    if len(read.rows) > MOST:
        raise InputError.one(path, "points", len(read.rows), f"at most {MOST}: thin the scan out")
    points, lines = np.array(read.rows).reshape(-1, 3), read.lines
    outside = [
        Fault(str(path), f"line {lines[k]}", points[k, :2].tolist(), on_junction(joint))
        for k in np.flatnonzero(~joint.covers(parts, points[:, :2]))
    ]
    twice = [
        Fault(str(path), f"line {lines[k]}", points[k].tolist(), f"one gap per point, see line {lines[i]}")
        for i, k in crowded(points[:, :2])
    ]
    if faults := [*read.faults, *outside, *twice]:
        raise InputError(faults)
    notes = [
        f"{path}: line {lines[k]}, gap = {points[k, 2]:g} is unusual; usual is {usual}"
        for k, usual in unlike(points)
    ]
    if len(points) > 2 and (question := too_small(points[:, :2], joint.bounds)):
        notes.append(f"{path}: the points span a small part of the junction{question}")
    return points[np.lexsort(points.T[::-1])], notes


@dataclass(frozen=True)
class Scan:
    """Wx (s, len(x)), Wy (s, len(y)), Cx and Cy, the Cholesky factor of WCWᵀ + ν²I, and d (s,) mm."""

    Wx: Any
    Wy: Any
    Cx: Matrix
    Cy: Matrix
    factor: Any
    gaps: Vector

    @classmethod
    def of(cls, joint: AnyJoint, points: Matrix, correlation_length: float) -> "Scan":
        """Made once; the last one is kept, as workers are sent joint and points with each block of cases."""
        key = digest(joint.content, points.tobytes(), correlation_length)
        if key not in _last:
            Wx, Wy = joint.grid_weights(points[:, :2], correlation_length)
            grid = joint.grid(correlation_length)
            Lx, Ly = (square_root(lines.tobytes(), correlation_length) for lines in grid)
            Cx, Cy = Lx @ Lx, Ly @ Ly
            S = Wy @ Cy @ Wy.T
            S *= Wx @ Cx @ Wx.T
            S[np.diag_indices(len(S))] += NOISE**2
            _last.clear()
            _last[key] = cls(Wx, Wy, Cx, Cy, sla.cho_factor(S, overwrite_a=True), points[:, 2])
        return _last[key]

    def mean_says(self, mean: float) -> str:
        """How far the mean of all cases, m + CWᵀ(WCWᵀ + ν²I)⁻¹(d − m), misses the scan, and its range."""
        y = sla.cho_solve(self.factor, self.gaps - mean)
        between = mean + self._spread(y)
        low, high, missed = between.min(), between.max(), abs(NOISE**2 * y).max()
        return f"misses its points by at most {missed:.1g} mm and is {low:.3g} to {high:.3g} mm"

    def through(self, gap: Matrix, sd: float, random: np.random.Generator) -> Matrix:
        """The random gap of a pair on the grid, mm, made to pass through the scan. sd : σ, mm."""
        there = np.asarray((self.Wy * (self.Wx @ gap.T)).sum(axis=1))
        missed = self.gaps - NOISE * sd * random.standard_normal(len(self.gaps)) - there
        return gap + self._spread(sla.cho_solve(self.factor, missed))

    def _spread(self, v: Vector) -> Matrix:
        """CWᵀv (len(y), len(x)) on the grid."""
        return np.asarray(self.Cy @ (self.Wy.T @ (sp.diags_array(v) @ self.Wx)) @ self.Cx)
