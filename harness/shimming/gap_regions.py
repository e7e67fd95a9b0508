"""Patches that follow from the gap y after fastening and the limit ℓ.

S are the contacts with y > ℓ. A shim of thickness t ≤ min y over its rectangle touches one part alone, so
that all forces and all other gaps stay; with t ≥ max y − ℓ its contacts keep the limit. So the least
rectangle around S is divided until

    max y − min y ≤ ℓ

in each: that with the largest difference first, between two lines of contacts, where (the larger of both
differences, their sum) is least. Each part is again the least rectangle around its contacts of S. There are
at most USUAL in a contact of two parts. Of many load cases y is the largest of all at each place.
"""

import numpy as np

from problems.forms.assembly import Indices, Mask, Matrix, Vector
from problems.model.interface import AnyJoint

from .patches import USUAL, Patch, checked_patches, corners_of

DIGITS = 6  # of mm: closer lines of contacts are one


def patches_of_gap(joint: AnyJoint, gap: Vector, limit_mm: float) -> tuple[Patch, ...]:
    """The patches, named 1, 2, …; none where no contact exceeds the limit. gap : (m,) after fastening, mm."""
    patches: list[Patch] = []
    for pair in joint.pairs:
        places, y = joint.places(pair).round(DIGITS), gap[joint.span(pair)]
        regions = [some for some in [_around(places, y > limit_mm, np.arange(len(y)))] if len(some)]
        while 0 < len(regions) < USUAL:
            widest = max(range(len(regions)), key=lambda k: np.ptp(y[regions[k]]))
            if np.ptp(y[regions[widest]]) <= limit_mm:
                break
            regions[widest : widest + 1] = _divided(places, y, limit_mm, regions[widest])
        outlines = sorted(corners_of(*_borders(joint.bounds, places, places[some])) for some in regions)
        shapes = [(str(k), outline, "") for k, outline in enumerate(outlines, start=len(patches) + 1)]
        patches += checked_patches(joint, shapes, [pair])
    return tuple(patches)


def _around(places: Matrix, over: Mask, among: Indices) -> Indices:
    """The contacts in the least rectangle around those that are over the limit."""
    some = places[among[over[among]]]
    low, high = some.min(axis=0, initial=np.inf), some.max(axis=0, initial=-np.inf)
    return among[((low <= places[among]) & (places[among] <= high)).all(axis=1)]


def _divided(places: Matrix, y: Vector, limit_mm: float, region: Indices) -> list[Indices]:
    """The parts of a region, without those where nothing is over the limit."""
    best, parts = (np.inf, np.inf), [region]
    for along in places[region].T:
        for line in np.unique(along)[:-1]:
            sides = [_around(places, y > limit_mm, region[s]) for s in (along <= line, along > line)]
            sides = [side for side in sides if len(side)]
            differences = [float(np.ptp(y[side])) for side in sides]
            if (value := (max(differences), sum(differences))) < best:
                best, parts = value, sides
    return parts


def _borders(bounds: Matrix, places: Matrix, region: Matrix) -> list[float]:
    """x_min, x_max, y_min, y_max half-way to the next lines of contacts, or to the end of the junction."""
    ends: list[float] = []
    for lines, of, (first, last) in zip(places.T, region.T, bounds.T, strict=True):
        low, high = of.min(), of.max()
        below = lines[lines < low].max(initial=2 * first - low)  # as far beyond the end as low is within
        above = lines[lines > high].min(initial=2 * last - high)
        ends += [float(low + below) / 2, float(high + above) / 2]
    return ends
