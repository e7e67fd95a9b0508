"""Load cases that differ in a random initial gap."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from problems.build import load_case
from problems.effects.initial_gap import InitialGap
from problems.effects.measured_gap import MeasuredGap
from problems.errors import Fault, InputError, number_faults, refuse_text
from problems.forms import Form
from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.input.bounded_types import validation_faults
from problems.input.tables import AS_NAMED, TableOptions
from problems.model.interface import AnyJoint
from problems.model.junction_terms import at_contacts
from problems.model.scene import JointScene, Scene
from problems.storage import digest

from . import LoadCases
from .gaps_through_scan import Scan, read_scan
from .sweep import MOST_CASES

#: The bits of a case's seed: integers of this size are exact in every JSON reader.
SEED_BITS = 53


def case_seed(seed: int, k: int) -> int:
    """The seed of the gap of case k of a series with this seed."""
    state = np.random.SeedSequence((seed, k)).generate_state(1, np.uint64)[0]
    return int(state) >> (64 - SEED_BITS)


def only_field(scene: JointScene) -> InitialGap | None:
    """The scene's `initial_gap`, None without one. Raises InputError if there are several."""
    fields = [*scene.effects_of(InitialGap)]
    if len(fields) > 1:
        where, found = f"scene {scene.name}", f"{len(fields)} effects"
        raise InputError.one(where, "initial_gap", found, "at most one can be random")
    return fields[0] if fields else None


@dataclass(frozen=True)
class RandomGaps(LoadCases):
    """Case k is the scene with its `initial_gap` drawn anew, with a seed derived from (seed, k).

    rest : the scene's forces and its other gaps. field : the `initial_gap`. points : of a scan that the gaps
    pass through, (s, 3) x, y, gap in mm.
    """

    joint: AnyJoint
    rest: LoadCase
    field: InitialGap
    seed: int
    count: int
    points: Matrix | None = None
    notes: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        given = [] if self.points is None else [self.points.tolist()]
        return digest(self.field.model_dump(mode="json"), self.seed, *given)

    def parameters(self, k: int) -> dict[str, Any]:
        """The seed which, written into the scene's `random`, gives this case, if there is no scan."""
        return {"gap_seed": case_seed(self.seed, k)}

    def load(self, k: int) -> LoadCase:
        return LoadCase(self.rest.f, self.rest.g + self.gap(k, self.field))

    def gap(self, k: int | None, law: InitialGap) -> Vector:
        """The gap of case k, (m,) mm, with this law of the field; without k the mean of all cases."""
        assert law.random is not None
        seed, sd = (0, 0.0) if k is None else (self.parameters(k)["gap_seed"], law.random.sd)
        field = law.model_copy(update={"random": law.random.model_copy(update={"seed": seed, "sd": sd})})
        if (scan := self.scan) is None:
            return field.gap(self.joint)
        random = np.random.default_rng((seed, 1))
        through = {pair: scan.through(z, sd, random) for pair, z in field.on_grid(self.joint).items()}
        return at_contacts(lambda pair: self.joint.from_grid(pair, through[pair]), list(through), self.joint)

    @property
    def scan(self) -> Scan | None:
        """Not kept here, as it would be sent with each block of cases."""
        if self.points is None:
            return None
        assert self.field.random is not None
        return Scan.of(self.joint, self.points, self.field.random.correlation_length)


def random_gaps(
    scene: Scene,
    cases: int,
    seed: int,
    mean: float | None = None,
    sd: float | None = None,
    correlation_length: float | None = None,
    form: Form = "dual",
    around: Path | str | None = None,
    options: TableOptions = AS_NAMED,
) -> RandomGaps:
    """Make load cases with random gaps around the scene's `initial_gap`.

    Parameters
    ----------
    scene : Scene
        A joint with at most one `initial_gap`.
    cases : int
        How many.
    seed : int
        Case k depends on the seed and k alone.
    mean, sd, correlation_length : float, optional
        Of the random field, mm; by default those of the scene. Around a measured gap the mean is 0 by
        default, through a scan it is the mean of the scan.
    form : str, optional
        The form that will be solved: f has an entry per unknown of its K.
    around : Path, optional
        A CSV of a scan, with columns x, y and gap in mm, that the gaps pass through.
    options : TableOptions, optional
        How that CSV is read.

    Returns
    -------
    RandomGaps
        The load cases: f (n,) in N, g (m,) in mm.

    Raises
    ------
    InputError
        If a number is out of range, the mean, sd or correlation length is given neither here nor in the
        scene, or the scene has no joint, or more than one `initial_gap`.

    Examples
    --------
    >>> from rivetbench import load_scene, random_gaps
    >>> scene = load_scene("gallery/three-part-stack")
    >>> cases = random_gaps(scene, 100, seed=1, sd=0.1, correlation_length=100.0)
    >>> cases.load(0).g.shape
    (738,)
    """
    refuse_text("random_gaps", columns=options.columns, missing=options.missing)
    where = f"scene {scene.name}"
    if not isinstance(scene, JointScene):
        allowed = "a random field needs a joint; own matrices take a table of gaps (--gaps)"
        raise InputError.one(where, "assembly", "own matrices", allowed)
    only, measured = only_field(scene), [*scene.effects_of(MeasuredGap)]
    table: dict[str, Any] = only.model_dump() if only else {"kind": "initial_gap"}
    if only is None and 1 < len(measured) < len(scene.joint.pairs):
        found, allowed = f"{len(measured)} effects", "one, or one for each contact, can scatter"
        raise InputError.one(where, "measured_gap", found, allowed)
    if only is None and len(measured) == 1:  # which scatters where it is
        table["between"] = measured[0].between
    law = {"mean": mean, "sd": sd, "correlation_length": correlation_length}
    pair = table.get("between")
    points, notes = (None, []) if around is None else read_scan(Path(around), scene.joint, options, pair)
    usual = None if points is None else float(points[:, 2].mean())
    if measured:
        if around is not None:
            allowed = f"remove it: the gaps pass through {around}"
            raise InputError.one(where, "measured_gap", "an effect of the scene", allowed)
        usual = 0.0
    values = {"mean": table.get("mean", usual)} | (table.get("random") or {})
    values |= {key: value for key, value in law.items() if value is not None}
    faults = number_faults(cases=(cases, 1, MOST_CASES), seed=(seed, 0))
    allowed = "is not in the scene: give --{}, in mm"
    missing = [key for key in law if values.get(key) is None]
    faults += [Fault(where, key, None, allowed.format(key.replace("_", "-"))) for key in missing]
    if faults:
        raise InputError(faults)
    random = {"sd": values["sd"], "correlation_length": values["correlation_length"], "seed": 0}
    try:
        field = InitialGap.model_validate(table | {"mean": values["mean"], "random": random})
    except ValidationError as error:
        raise InputError(list(validation_faults("series", InitialGap, error, "initial_gap"))) from error
    for key, value, usable in field.faults(scene.joint) if scene.joint.pairs else ():  # of a length too short
        raise InputError.one("series", f"initial_gap.{key}", value, usable)
    others = [effect for effect in scene.effects if effect is not only]
    made = RandomGaps(scene.joint, load_case(scene, form, others), field, seed, cases, points)
    if made.scan is None:
        return made
    notes.append(f"The cases pass through {around}: their mean {made.scan.mean_says(values['mean'])}")
    return replace(made, notes=tuple(notes))
