"""The patches of the junction that shims may fill, and the thicknesses in stock."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise, product
from operator import itemgetter
from pathlib import Path

import numpy as np

from harness.placement.candidates import Place, cells_of
from problems.effects.shims import Shims
from problems.errors import Fault, InputError
from problems.input.bounded_types import LARGEST
from problems.input.tables import CSV_MIB, Cells, read_columns
from problems.model.interface import AnyJoint, on_junction, places_of
from problems.model.joint import Pair
from problems.model.surface_cells import cross

MOST, USUAL = 1000, 16  # patches, and thicknesses; patches if none are given
NEAR = 1e-6  # mm: closer borders are one
RASTER = 32  # points along a side of the box of two outlines
BORDERS, CORNERS = ("x_min", "x_max", "y_min", "y_max"), ("x", "y")
SHAPE = "x_min < x_max and y_min < y_max, or 3 corners or more, each with the name of the outline"
Shape = tuple[str, tuple[Place, ...], str]  # name, corners, and where it is in its file
STOCK = f"thicknesses above 0, at most {LARGEST:g} mm, ascending, as 0.2,0.3,0.5, or FIRST:LAST:STEP"


@dataclass(frozen=True)
class Patch:
    """An area that a shim may fill.

    outline : the corners of the shim as cut, mm. shim : the effect, 1 mm thick.
    """

    name: str
    outline: tuple[Place, ...]
    shim: Shims

    @property
    def area(self) -> float:
        """mm²."""
        corners = np.array(self.outline)
        return float(abs(cross(corners, np.roll(corners, -1, axis=0)).sum()) / 2)


def stock_of(text: str) -> tuple[float, ...]:
    """The thicknesses of a stock, mm. Raises InputError unless they are positive and ascend."""
    try:
        values = list(map(float, text.split(":" if ":" in text else ",")))
        if ":" in text:
            first, last, step = values
            values = np.round(np.arange(first, min(last, first + MOST * step) + step / 2, step), 9).tolist()
    except (ValueError, ZeroDivisionError, AttributeError, TypeError):  # the last two: no text
        values = []
    usable = 0 < len(values) <= MOST and all(value <= LARGEST for value in values)
    if not usable or np.diff([0.0, *values]).min() <= 0:
        raise InputError.one("--stock", "thicknesses", text, STOCK)
    return tuple(values)


def patches_of(joint: AnyJoint, source: str | None) -> tuple[Patch, ...]:
    """The patches, in each contact of the joint. Raises InputError.

    source : columns x rows of equal cells of the junction, as 8x1, or the path of a CSV, mm: rectangles in
    columns x_min, x_max, y_min, y_max, perhaps name, or corners of outlines in columns name, x and y; None:
    USUAL cells, about square.
    """
    if source is None:
        length, width = np.ptp(joint.bounds, axis=0)
        columns = int(np.clip(round((USUAL * length / width) ** 0.5), 1, USUAL))
        source = f"{columns}x{USUAL // columns}"
    if counts := cells_of(source, "--patches", "columns x rows", "patches", MOST):
        x, y = (np.linspace(low, high, n + 1) for (low, high), n in zip(joint.bounds.T, counts, strict=True))
        cells = product(pairwise(y.tolist()), pairwise(x.tolist()))
        shapes = [(str(k), corners_of(*across, *up), "") for k, (up, across) in enumerate(cells, start=1)]
        return checked_patches(joint, shapes, joint.pairs)
    cut = not Cells.of(Path(source), CSV_MIB, BORDERS).header
    cut = cut and any(Cells.of(Path(source), CSV_MIB, [name]).header for name in CORNERS)
    table, shapes = read_columns(Path(source), CORNERS if cut else BORDERS), []
    names = table.words["name"] or [str(k + 1) for k in range(len(table.rows))]
    rows = zip(names, table.rows, table.lines, strict=True)
    for _, group in groupby(rows, itemgetter(0 if cut else 2)):
        (name, *_), corners, (line, *_) = zip(*group, strict=True)
        shapes.append((name, corners if cut else corners_of(*corners[0]), f"line {line}"))
    if table.faults:
        raise InputError(table.faults)
    return checked_patches(joint, shapes, joint.pairs, source)


def corners_of(west: float, east: float, south: float, north: float) -> tuple[Place, ...]:
    """The corners of a rectangle; only two of one without width or height."""
    corners = (west, south), (east, south), (east, north), (west, north)
    return corners if west < east and south < north else corners[::2]


def checked_patches(
    joint: AnyJoint, shapes: Sequence[Shape], pairs: Iterable[Pair], source: str = "--patches"
) -> tuple[Patch, ...]:
    """A patch for each shape in each pair where it has a contact; a cell, which is in no file, needs none.

    Raises InputError if an outline is none, off the junction, without a contact, or overlaps another.
    """
    low, high = joint.bounds[0] - NEAR, joint.bounds[1] + NEAR
    faults = [Fault(source, at, outline, SHAPE) for _, outline, at in shapes if len(outline) < 3]
    for k, (name, outline, at) in enumerate(shapes):
        if name in [other for other, *_ in shapes[:k]]:
            faults.append(Fault(source, at, name, "a name of its own, its corners one after another"))
        off = [place for place in outline if (place < low).any() or (place > high).any()]
        faults += [Fault(source, at, place, on_junction(joint)) for place in off[:1]]
    patches, sound, pairs = [], [shape for shape in shapes if len(shape[1]) >= 3], tuple(pairs)
    sheets = [Shims(kind="shims", thickness=1.0, outline=outline) for _, outline, _ in sound]
    for pair, ((name, outline, at), sheet) in product(pairs, zip(sound, sheets, strict=True)):
        here = sheet.covers(joint.places(pair), joint).any()
        if not here and (not at or sheet.covers(places_of(joint, pairs), joint).any()):
            continue
        between, where = (None, "") if len(joint.pairs) == 1 else (pair, f" {'–'.join(pair)}")
        shim = sheet.model_copy(update={"between": between})
        patches.append(Patch(f"{name}{where}", outline, shim))
        faults += [Fault(source, f"{at or name}, {f[0]}", *f[1:]) for f in shim.faults(joint)]
    for k, other in _overlaps(sheets, joint):
        (name, _, at), (other_name, _, other_at) = sound[k], sound[other]
        allowed = f"apart from other patches: it overlaps {other_at or other_name}"
        faults.append(Fault(source, at or name, name, allowed))
    if faults:
        raise InputError(faults)
    return tuple(patches)


def _overlaps(shims: Sequence[Shims], joint: AnyJoint) -> Iterator[tuple[int, int]]:
    """Yield the numbers of two shims that both cover a contact, or a point of a raster in the box of both."""
    contacts = places_of(joint, joint.pairs)
    boxes = np.array([shim.ranges for shim in shims]).reshape(-1, 2, 2)
    for k, shim in enumerate(shims):
        low, high = np.maximum(boxes[:k, :, 0], boxes[k, :, 0]), np.minimum(boxes[:k, :, 1], boxes[k, :, 1])
        for other in np.flatnonzero((high - low > NEAR).all(axis=1)).tolist():
            lines = np.linspace(low[other], high[other], 2 * RASTER + 1)[1::2].T
            points = np.concatenate([np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 2), contacts])
            if (shim.covers(points, joint) & shims[other].covers(points, joint)).any():
                yield k, other
