"""Checks points of a scan: two at one place, and gaps that are unlikely to be measured.

A gap is an outlier by one of these rules, in mm, with s = 1.4826 · median |gap − median|:

    far      it is more than 20 s + 5 from the median
    alone    among nine points or more, at most one of its eight neighbours has a gap within
             max(20 d, 3 q, 0.3) of its own. q: the distance between the quartiles of the neighbours' gaps.
             d: the second smallest difference to a neighbour's gap, the median of that over all points
    below    it is negative, and it and equal ones are more than 2 s + 0.1 below all others

These rules catch the marks of a scanner that saw nothing: 9999, 32767, 1e30, −1. They leave noise, and steps,
pockets and bumps that several points show.
"""

from collections.abc import Iterator

import numpy as np

from problems.forms.assembly import Indices, Mask, Matrix, Vector

CLOSE = 0.01  # mm: points that are closer are at one place
NEAR, ALIKE = 8, 2
SPREADS, QUARTILES, ALONE, BELOW, FAR = 20.0, 3.0, 0.3, 0.1, 5.0
MAD = 1.4826  # σ / median |z| of a normal distribution
SMALL = 0.02  # of the joint's size
SHOWN = 10


def crowded(points: Matrix) -> list[tuple[int, int]]:
    """Pairs (i, k), i < k, of points (n, 2) at one place.

    Of equal points the first two are a pair, as a scanner that saw nothing may write thousands of them. Of
    different points each is paired with the nearest other one, if that is close.
    """
    from scipy.spatial import cKDTree

    places, first, of = np.unique(points, axis=0, return_index=True, return_inverse=True)
    again = np.setdiff1d(np.arange(len(points)), first)
    equal, second = np.unique(of.ravel()[again], return_index=True)
    pairs = {*zip(first[equal].tolist(), again[second].tolist(), strict=True)}
    apart, near = cKDTree(places).query(places, 2)
    pairs |= {(min(pair), max(pair)) for pair in map(tuple, first[near[apart[:, 1] <= CLOSE]].tolist())}
    return sorted(pairs)


def neighbours(points: Matrix) -> Indices:
    """(n, 8 or fewer) the nearest other points of each of the points (n, 2)."""
    from scipy.spatial import cKDTree

    count = min(NEAR + 1, len(points))
    return np.asarray(cKDTree(points).query(points, count)[1]).reshape(len(points), count)[:, 1:]


def outliers(gaps: Vector, near: Indices | None = None) -> Mask:
    """(n,) which gaps are outliers. near : the `neighbours` of their points, which `alone` needs."""
    middle = np.median(gaps)
    s = MAD * np.median(abs(gaps - middle))
    is_outlier = abs(gaps - middle) > SPREADS * s + FAR
    least, others = gaps.min(), gaps[gaps > gaps.min()]
    if least < 0 and len(others) and others.min() - least > 2 * s + BELOW:
        is_outlier |= gaps == least
    if near is not None and near.shape[1] == NEAR:
        beside = gaps[near]
        second = np.partition(abs(beside - gaps[:, None]), ALIKE - 1, axis=1)[:, ALIKE - 1]
        low, high = np.quantile(beside, [0.25, 0.75], axis=1)
        reach = np.maximum(QUARTILES * (high - low), max(SPREADS * np.median(second), ALONE))
        is_outlier |= second > reach
    return is_outlier


def unlike(points: Matrix) -> Iterator[tuple[int, str]]:
    """Yield the outliers among points (n, 3), x, y and gap: the index of the point, and what is usual."""
    if len(points) < 3:
        return
    near = neighbours(points[:, :2])
    is_unlike = outliers(points[:, 2], near)
    apart = np.linalg.norm(points[near[:, 0], :2] - points[:, :2], axis=1)
    beside, far = points[near, 2], apart > QUARTILES * np.median(apart)
    is_unlike |= (points == 0).all(axis=1) & (far | (beside.min(axis=1) > 0) | (beside.max(axis=1) < 0))
    where = np.flatnonzero(is_unlike)
    for k in where[:SHOWN]:
        last = len(where) > SHOWN and k == where[SHOWN - 1]
        more = f"; {len(where) - SHOWN} more points are unusual" if last else ""
        yield int(k), f"{np.median(points[near[k], 2]):.3g} mm as around it{more}"


def too_small(points: Matrix, bounds: Matrix) -> str:
    """A question about metres, if points (n, 2) span little of the bounds (2, 2) of a joint, else ""."""
    small = (np.ptp(points, axis=0) < SMALL * np.ptp(bounds, axis=0)).all()
    return " (are x and y of the points in metres?)" if small else ""
