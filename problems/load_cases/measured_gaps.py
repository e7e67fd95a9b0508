"""Load cases with measured gaps: a table with one row per case and one column per contact, mm."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from problems.build import load_case
from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.input.bounded_types import regular_file
from problems.input.matrix_files import reading
from problems.input.scan_points import neighbours, outliers
from problems.input.tables import AS_NAMED, TableOptions
from problems.model.interface import AnyJoint
from problems.model.scene import JointScene, Scene
from problems.storage import digest

from . import REPLACED, LoadCases
from .gap_tables import read_gaps

MAX_NOTES = 10  # on unusual gaps; further ones are counted
TABLE_MIB = 2**15
AT_ONCE = 2**22  # gaps of a table, which may be larger than the memory


@dataclass(frozen=True)
class MeasuredGaps(LoadCases):
    """Case k is the scene with a row of the table in place of the gaps that are measured.

    rest : the forces and the other gaps of the scene. gaps : (rows, m) mm. numbers : the case number of each
    row; empty if they are 0, 1, 2, …
    """

    rest: LoadCase
    gaps: Matrix
    count: int
    numbers: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Hash of the number of contacts alone: a table may grow during a series; `parameters` has a hash of
        each case.
        """
        return digest("table", self.gaps.shape[1])

    @property
    def content_key(self) -> str:
        rows = [digest(some.tobytes()) for _, some in _blocks(self.gaps[: self.count])]
        return digest("table", self.gaps.shape[1], rows)

    def parameters(self, k: int) -> dict[str, float | str]:
        """The hash of the gaps of case k, which reveals a row that has changed since."""
        return {"gaps": digest(np.ascontiguousarray(self._row(k)).tobytes())}

    def load(self, k: int) -> LoadCase:
        return LoadCase(self.rest.f, self.rest.g + self._row(k))

    def only(self, numbers: Sequence[int]) -> "MeasuredGaps":
        """The table without the rows of other cases."""
        return replace(self, gaps=np.array([self._row(k) for k in numbers]), numbers=tuple(numbers))

    def _row(self, k: int) -> Vector:
        return self.gaps[self.numbers.index(k) if self.numbers else k]


def measured_gaps(
    scene: Scene,
    path: Path,
    count: int | None = None,
    form: Form = "dual",
    options: TableOptions = AS_NAMED,
) -> MeasuredGaps:
    """The first `count` rows, or all, of a .csv (numbers; # begins a comment), .npz or .npy.

    An .npz must hold an array `gaps`, or a single array; an .npy is memory-mapped, the others are read into
    memory. A .csv (or .csv.gz) may have a header and a column that counts its rows: see gap_tables.py. A gap
    that `options` marks as missing becomes that of the nearest contact of its pair. A row replaces the
    effects of the kinds REPLACED and adds to other gaps. Raises InputError, which names the first case with
    a fault.
    """
    effects = scene.effects if isinstance(scene, JointScene) else ()
    rest = load_case(scene, form, [effect for effect in effects if effect.kind not in REPLACED])
    m = len(rest.g)
    ids = scene.joint.ids if isinstance(scene, JointScene) else None
    if not isinstance(scene, JointScene):  # the only gap that matrices have
        rest = LoadCase(rest.f, np.zeros(m))
    labels = [] if ids is None else ids[1].tolist()
    suffix = Path(path.name.lower().removesuffix(".gz")).suffix
    gaps = _read(regular_file(path, "file", TABLE_MIB), suffix, m, options, labels)
    if gaps.ndim != 2 or gaps.shape[1] != m or not len(gaps):
        allowed = f"one row per case, one column for each of {m} contacts"
        raise InputError.one(path, "shape", gaps.shape, allowed)
    if count is not None and count > len(gaps):
        raise InputError.one("--cases", "cases", count, f"{path} has {len(gaps)} rows")
    gaps, notes = gaps[:count], list[str]()
    if options.missing and suffix != ".csv":  # the marks of a .csv are those of its cells, in its unit
        marks = np.array(options.numbers, dtype=gaps.dtype if gaps.dtype.kind == "f" else float)
        gaps = np.where(np.isin(gaps, marks), np.nan, gaps)
    if options.missing and isinstance(scene, JointScene):
        gaps, lost = _completed(scene.joint, gaps)
        notes = [f"{path}: {lost} missing gaps are taken from the nearest contact of their case"] * bool(lost)
    _refuse_infinite(path, gaps)
    notes += _unusual(scene, path, gaps)
    return MeasuredGaps(rest, gaps, len(gaps), notes=tuple(notes))


def _blocks(gaps: Matrix) -> Iterator[tuple[int, Matrix]]:
    """The rows of a table, some at a time, with the number of the first of them."""
    size = max(AT_ONCE // max(gaps.shape[1], 1), 1)
    return ((start, gaps[start : start + size]) for start in range(0, len(gaps), size))


def _completed(joint: AnyJoint, gaps: Matrix) -> tuple[Matrix, int]:
    """The gaps (rows, m), each NaN replaced by the gap of the nearest contact of its pair, and their number.

    A case with no gap of a pair keeps its NaN.
    """
    from scipy.spatial import cKDTree

    lost = np.isnan(gaps)
    for pair in joint.pairs:
        span, places = joint.span(pair), joint.places(pair)
        for case, gone in zip(gaps[:, span], lost[:, span], strict=True):
            if gone.any() and not gone.all():
                case[gone] = case[~gone][cKDTree(places[~gone]).query(places[gone])[1]]
    return gaps, int(lost.sum())


def _unusual(scene: Scene, path: Path, gaps: Matrix) -> Iterator[str]:
    """Sentences on gaps that are outliers among those of their case."""
    joint, near = scene.joint if isinstance(scene, JointScene) else None, None
    if joint:
        beside = [joint.span(pair).start + neighbours(joint.places(pair)) for pair in joint.pairs]
        near = np.concatenate(beside) if len({some.shape[1] for some in beside}) == 1 else None
    count = 0
    for k, case in enumerate(map(np.asarray, gaps)):
        marked = np.flatnonzero(outliers(case, near))
        for contact in marked[: max(MAX_NOTES - count, 0)]:
            usual = f"{np.median(case):.3g} mm, the median of the case"
            yield f"{path}: case {k}, contact {contact} = {case[contact]:g} is unusual; usual is {usual}"
        count += len(marked)
    if count > MAX_NOTES:
        yield f"{path}: {count - MAX_NOTES} more gaps are unusual"


def _refuse_infinite(path: Path, gaps: Matrix) -> None:
    """Raises InputError with the first gap that is not finite, and the number of cases that have one."""
    wrong = [
        start + k for start, some in _blocks(gaps) for k in np.flatnonzero(~np.isfinite(some).all(axis=1))
    ]
    if wrong:
        case = np.asarray(gaps[wrong[0]])
        contact = np.flatnonzero(~np.isfinite(case))[0]
        more = f"; {len(wrong) - 1} more cases have such gaps" if len(wrong) > 1 else ""
        allowed = f"every gap must be a finite number, in mm{more}"
        raise InputError.one(path, f"case {wrong[0]}, contact {contact}", float(case[contact]), allowed)


def _read(path: Path, suffix: str, m: int, options: TableOptions, labels: Sequence[int]) -> Matrix:
    with reading(path, "file", "a readable table of numbers"):
        match suffix:
            case ".csv":
                return read_gaps(path, m, TABLE_MIB, options, labels)
            case ".npy":
                gaps: Matrix = np.load(path, mmap_mode="r")
            case ".npz":
                with np.load(path) as archive:
                    names = ["gaps"] if "gaps" in archive.files else archive.files
                    if len(names) != 1:
                        raise InputError.one(path, "arrays", names, "gaps, or one array alone")
                    gaps = archive[names[0]]
            case _:
                raise InputError.one(path, "file", suffix, "a .csv, .npz or .npy")
        if gaps.dtype.kind not in "fiu":
            raise ValueError(f"an array of {gaps.dtype}")
        return gaps
