"""The patches of the junction that shims may fill, and the thicknesses in stock."""

from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path

import numpy as np

from harness.placement.candidates import ROWS_AND_COLUMNS
from problems.effects.shims import Shims
from problems.errors import Fault, InputError
from problems.forms.assembly import Matrix
from problems.input.tables import read_columns
from problems.model.interface import AnyJoint, on_junction

MOST, USUAL = 1000, 16  # patches, and thicknesses; patches if none are given
NEAR = 1e-6  # mm: closer borders are one
STOCK = "thicknesses above 0 mm in ascending order, as 0.2,0.3,0.5, or FIRST:LAST:STEP"


@dataclass(frozen=True)
class Patch:
    """x, y : the range of the shim as it is cut, mm. area : mm². shim : the effect, 1 mm thick."""

    name: str
    x: tuple[float, float]
    y: tuple[float, float]
    area: float
    shim: Shims


def stock_of(text: str) -> tuple[float, ...]:
    """The thicknesses of a stock, mm. Raises InputError unless they are positive and ascend."""
    try:
        values = list(map(float, text.split(":" if ":" in text else ",")))
        if ":" in text:
            first, last, step = values
            values = np.round(np.arange(first, min(last, first + MOST * step) + step / 2, step), 9).tolist()
    except (ValueError, ZeroDivisionError):
        values = []
    if not 0 < len(values) <= MOST or not np.isfinite(values).all() or np.diff([0.0, *values]).min() <= 0:
        raise InputError.one("--stock", "thicknesses", text, STOCK)
    return tuple(values)


def patches_of(joint: AnyJoint, source: str | None) -> tuple[Patch, ...]:
    """The patches, in each contact of the joint. Raises InputError.

    source : columns x rows of equal cells of the junction, as 8x1, or the path of a CSV with columns x_min,
    x_max, y_min, y_max, mm, perhaps name; None: USUAL cells, about square.
    """
    names: list[str] = []
    if source is None:
        length, width = np.ptp(joint.bounds, axis=0)
        columns = int(np.clip(round((USUAL * length / width) ** 0.5), 1, USUAL))
        source = f"{columns}x{USUAL // columns}"
    if pattern := ROWS_AND_COLUMNS.fullmatch(source):
        counts = [int(number or 0) for number in pattern.groups()]
        if not 0 < counts[0] * counts[1] <= MOST:
            allowed = f"columns x rows, 1 to {MOST} patches, or a CSV file"
            raise InputError.one("--patches", "patches", source, allowed)
        x, y = (np.linspace(low, high, n + 1) for (low, high), n in zip(joint.bounds.T, counts, strict=True))
        cells = np.array([(*across, *up) for up, across in product(pairwise(y), pairwise(x))])
        faults = []
    else:
        table = read_columns(Path(source), ("x_min", "x_max", "y_min", "y_max"))
        cells, names = np.array(table.rows).reshape(-1, 4), table.words["name"]
        faults = table.faults + _faults(joint, cells, source, table.lines)
    patches = []
    for pair in joint.pairs if not faults else ():
        between, where = (None, "") if len(joint.pairs) == 1 else (pair, f" {'–'.join(pair)}")
        for k, (w, e, s, n) in enumerate(cells.tolist()):
            name, (west, south) = (
                f"{names[k] if names else k + 1}{where}",
                _inner(cells, k, joint.places(pair)),
            )
            shim = Shims(kind="shims", thickness=1.0, x=(west, e), y=(south, n), between=between)
            patches.append(Patch(name, (w, e), (s, n), (e - w) * (n - s), shim))
            faults += [Fault(source, f"patch {name}, {f[0]}", *f[1:]) for f in shim.faults(joint)]
    if faults:
        raise InputError(faults)
    return tuple(patches)


def _faults(joint: AnyJoint, cells: Matrix, source: str, lines: list[int]) -> list[Fault]:
    """A fault for each rectangle without width, beyond the junction, or over an earlier one."""
    low, high, faults = cells[:, ::2], cells[:, 1::2], []
    for k, line in enumerate(lines):
        over = (np.minimum(high, high[k]) - np.maximum(low, low[k]) > NEAR).all(axis=1)[:k]
        wrong = [
            ("x_min < x_max and y_min < y_max", (low[k] >= high[k]).any()),
            (
                on_junction(joint),
                (low[k] < joint.bounds[0] - NEAR).any() or (high[k] > joint.bounds[1] + NEAR).any(),
            ),
            (f"apart from other patches: it overlaps line {lines[over.argmax()] if k else 0}", over.any()),
        ]
        faults += [Fault(source, f"line {line}", cells[k].tolist(), text) for text, there in wrong if there]
    return faults


def _inner(cells: Matrix, k: int, places: Matrix) -> list[float]:
    """The least x and y of patch k; where a neighbour ends with contacts on that border, half-way to the next
    ones, since shims that overlap would add up.
    """
    low, high = cells[:, ::2], cells[:, 1::2]
    inner = low[k].tolist()
    beside = np.minimum(high, high[k]) - np.maximum(low, low[k]) > NEAR
    for axis in (0, 1):
        further = places[places[:, axis] > inner[axis] + NEAR, axis]
        if ((abs(high[:, axis] - low[k, axis]) < NEAR) & beside[:, 1 - axis]).any() and len(further):
            inner[axis] = float((inner[axis] + further.min()) / 2)
    return inner
