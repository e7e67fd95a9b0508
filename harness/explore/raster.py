"""Draws any layout of contacts as an image: each pixel shows the largest gap at the nearest place."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from problems.forms.assembly import Indices, Matrix, Vector

FINEST = 2.0  # pixels per mean distance of contacts, along each axis


@dataclass(frozen=True)
class Raster:
    """An image of contacts.

    low, high : (2,) its corners, mm. place : (m,) the number of each contact's place, which those of several
    pairs may share. nearest : (rows, columns) the place of each pixel, or the number of places where none is.
    """

    low: Vector
    high: Vector
    place: Indices
    nearest: Indices

    @classmethod
    def of(cls, places: Matrix) -> "Raster":
        """An image with a pixel per contact where the contacts form a full grid. places : (m, 2) mm."""
        places, place = np.unique(places.round(6), axis=0, return_inverse=True)
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
        nearest = cKDTree(places).query(centres, distance_upper_bound=reach)[1]
        return cls(low, high, place.ravel(), nearest)

    def image(self, gap: Vector) -> NDArray[np.float32]:
        largest = np.full(self.place.max() + 2, np.nan)
        np.fmax.at(largest, self.place, gap)
        return largest.astype(np.float32)[self.nearest]
