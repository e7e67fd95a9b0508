"""Numbers the unknowns of the full model so that K̂ has a narrow band.

The unknowns û of a part are the deflection, slopes and twist at each node of its plate that is not built in.
They are numbered line by line across the shorter direction of the mesh, and the parts that springs join
alternate line by line: K̂_ij ≠ 0 only for unknowns of one line or of neighbouring lines.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Indices

from .part import PartModel


@dataclass(frozen=True)
class Numbering:
    """The numbers of the unknowns of all parts.

    places : for each part (plate.size,), the number of each of its plate's unknowns; −1 where built in.
    sizes : the number of unknowns of each diagonal block of K̂.
    """

    places: tuple[Indices, ...]
    sizes: tuple[int, ...]

    @classmethod
    def of(cls, models: Sequence[PartModel], blocks: Sequence[Sequence[int]]) -> "Numbering":
        """Number the parts block by block; the unknowns of a block have consecutive numbers."""
        places = [np.full(model.plate.size, -1) for model in models]
        sizes, offset = [], 0
        for block in blocks:
            free = [free_unknowns(models[part]) for part in block]
            numbers_of_lines = [_mesh_lines(models[part], own) for part, own in zip(block, free, strict=True)]
            x, y = (np.concatenate(numbers) for numbers in zip(*numbers_of_lines, strict=True))
            line, across = (x, y) if _widest(x) <= _widest(y) else (y, x)
            owner = np.repeat(np.arange(len(block)), [numbers.size for numbers in free])
            rank = np.empty(len(line), dtype=np.intp)
            rank[np.lexsort((np.arange(len(line)), across, owner, line))] = np.arange(len(line))
            for k, part in enumerate(block):
                places[part][free[k]] = offset + rank[owner == k]
            sizes.append(len(line))
            offset += len(line)
        return cls(tuple(places), tuple(sizes))

    @property
    def size(self) -> int:
        """The number of unknowns of all parts."""
        return sum(self.sizes)


def free_unknowns(model: PartModel) -> Indices:
    """The unknowns of a part's plate that are not built in."""
    return np.concatenate([model.plate.line_dofs(line) for line in model.free_lines])


def lines_across(model: PartModel) -> list[Indices]:
    """The unknowns that are not built in, on each mesh line across the longer direction of a part."""
    free = free_unknowns(model)
    line = min(_mesh_lines(model, free), key=_widest)
    return [free[line == k] for k in range(line.min(), line.max() + 1)]


def _mesh_lines(model: PartModel, unknowns: Indices) -> tuple[Indices, Indices]:
    """The number of the mesh line x = const, and of the line y = const, on which each unknown lies."""
    nx, ny = len(model.plate.x), len(model.plate.y)
    iy, _, ix, _ = np.unravel_index(unknowns, (ny, 2, nx, 2))
    # Parts have a common x and, from the junction on, a common y: lines of equal number lie side by side.
    return ix, iy - model.junction.start


def _widest(lines: Indices) -> int:
    """The largest number of unknowns on one line."""
    return int(np.bincount(lines - lines.min()).max())
