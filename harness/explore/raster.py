"""Draws any layout of contacts as an image: each pixel shows the nearest contact."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from problems.forms.assembly import Indices, Matrix, Vector

FINEST = 2.0  # pixels per mean distance of contacts, along each axis


@dataclass(frozen=True)
class Raster:
    """An image of contacts. low, high : (2,) its corners, mm. nearest : (rows, columns) the contact of each
    pixel, or m where none is near.
    """

    low: Vector
    high: Vector
    nearest: Indices

    @classmethod
    def of(cls, places: Matrix) -> "Raster":
        """An image with a pixel per contact where the contacts form a full grid. places : (m, 2) mm."""
        extent = np.ptp(places, axis=0)
        mean = float(np.sqrt(extent.prod() / len(places))) or float(extent.max()) / len(places) or 1.0
        lines = np.array([len(np.unique(axis.round(6))) for axis in places.T])
        count = np.minimum(lines, np.ceil(FINEST * extent / mean).astype(int) + 1)
        pixel = np.where(count > 1, extent / np.maximum(count - 1, 1), mean)
        x, y = (
            start + step * np.arange(n)
            for start, step, n in zip(places.min(axis=0), pixel, count, strict=True)
        )
        centres = np.stack(np.meshgrid(x, y), axis=-1)
        reach = max(mean, *pixel)
        low, high = centres[0, 0] - pixel / 2, centres[-1, -1] + pixel / 2
        return cls(low, high, cKDTree(places).query(centres, distance_upper_bound=reach)[1])

    def image(self, gap: Vector) -> NDArray[np.float32]:
        return np.append(gap, np.nan).astype(np.float32)[self.nearest]
