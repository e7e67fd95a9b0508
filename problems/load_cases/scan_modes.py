"""Random gaps that vary as many scans do: their mean field and its principal modes.

Scan i of s gives the gaps h_i (m,) at the contacts, as a `measured_gap` does. With their mean h̄ and the
singular value decomposition USVᵀ of the rows (h_i − h̄)/√(s − 1), the covariance of the scans is VS²Vᵀ.
Case k is, with the fewest modes r that keep a share of the variance Σ s_j² (Jolliffe, Principal Component
Analysis, 2002, 6.1.1),

    h̄ + Σ_{j ≤ r} z_j s_j v_j,    z ~ N(0, I).
"""

from dataclasses import dataclass
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np

from problems.build import load_case
from problems.effects.initial_gap import InitialGap
from problems.effects.measured_gap import MeasuredGap
from problems.errors import Fault, InputError, read_all
from problems.forms import Form
from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.input.bounded_types import valid_table
from problems.input.tables import AS_NAMED, TableOptions, read_columns
from problems.model.interface import AnyJoint
from problems.model.joint import Pair
from problems.model.scene import JointScene, Scene
from problems.storage import digest

from . import LoadCases
from .random_gaps import case_seed, only_field

VARIANCE = 0.99  # kept, if no share is given


@dataclass(frozen=True)
class ScanModes(LoadCases):
    """Case k is the scene with the mean of the scans and a draw of their modes.

    rest : the scene's forces and its other gaps. scans : the hash of their gaps. mean : (m,) mm. modes :
    (r, m), s_j v_j, mm.
    """

    rest: LoadCase
    scans: str
    mean: Vector
    modes: Matrix
    seed: int
    count: int
    notes: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        return digest("scans", self.scans, len(self.modes), self.seed)

    def parameters(self, k: int) -> dict[str, Any]:
        """The seed of the draw of case k."""
        return {"gap_seed": case_seed(self.seed, k)}

    def load(self, k: int) -> LoadCase:
        z = np.random.default_rng(case_seed(self.seed, k)).standard_normal(len(self.modes))
        return LoadCase(self.rest.f, self.rest.g + self.mean + z @ self.modes)


def scan_modes(
    scene: Scene,
    pattern: str,
    count: int,
    seed: int,
    variance: float = VARIANCE,
    form: Form = "dual",
    options: TableOptions = AS_NAMED,
) -> ScanModes:
    """Load cases of the scans in the files of a pattern, as "scans/*.csv", in place of the scene's gap.

    variance : the share of it that the modes keep, at most 1. Raises InputError with the faults of all files.
    """
    where = f"scene {scene.name}"
    if not isinstance(scene, JointScene):
        allowed = "scans need a joint; own matrices take a table of gaps (--gaps)"
        raise InputError.one(where, "assembly", "own matrices", allowed)
    if any(isinstance(effect, MeasuredGap) for effect in scene.effects):
        raise InputError.one(
            where, "measured_gap", "an effect of the scene", f"remove it: {pattern} has them"
        )
    paths = [Path(name) for name in sorted(glob(pattern))]
    if len(paths) < 2:
        raise InputError.one("--scans", "files", pattern, f"two files or more; {len(paths)} there")
    joint, notes = scene.joint, list[str]()
    field = only_field(scene)
    between = field.between if field else None
    scans = np.array(read_all(lambda path: gaps_of(joint, path, options, notes, between), paths))
    mean = scans.mean(axis=0)
    _, s, V = np.linalg.svd((scans - mean) / np.sqrt(len(scans) - 1), full_matrices=False)
    total = np.cumsum(s**2)
    r = int(np.searchsorted(total, variance * total[-1] * (1 - 1e-12))) + 1 if total[-1] else 0
    kept = f"{r} of {len(paths) - 1} principal modes of {len(paths)} scans keep"
    share = f"{total[r - 1] / total[-1]:.4g} of their variance" if r else "all: the scans are equal"
    notes.append(f"{kept} {share}; each contact counts alike")
    rest = load_case(scene, form, [effect for effect in scene.effects if not isinstance(effect, InitialGap)])
    modes = s[:r, None] * V[:r]
    return ScanModes(rest, digest(scans.tobytes()), mean, modes, seed, count, tuple(notes))


def gaps_of(
    joint: AnyJoint, path: Path, options: TableOptions, notes: list[str], between: Pair | None = None
) -> Vector:
    """The gaps (m,) mm of a scan at the contacts, of one pair or of all; notes are added to the list. Raises
    InputError.
    """
    read = read_columns(path, MeasuredGap.columns, options)
    faults = list(read.faults)
    table = {"kind": "measured_gap", "points": read.rows, "between": between}
    effect = None if faults else valid_table(MeasuredGap, table, path, faults)
    if effect is not None:
        effect._lines = tuple(f"line {line}" for line in read.lines)
        faults += [Fault(str(path), *fault) for fault in effect.faults(joint)]
    if effect is None or faults:
        raise InputError(faults)
    notes += [
        f"{path}: {key} = {value} is unusual; usual is {usual}" for key, value, usual in effect.unusual(joint)
    ]
    return effect.gap(joint)
