"""Where the load cases of `series`, `place` and `shim` come from: random gaps and keys, scans, or a table."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from glob import glob
from itertools import chain
from pathlib import Path

from problems.build import load_case
from problems.effects.initial_gap import InitialGap
from problems.errors import Fault, InputError, number_faults, refuse_text
from problems.forms import Form
from problems.input.tables import AS_NAMED, TableOptions
from problems.load_cases import Listed, LoadCases
from problems.load_cases.measured_gaps import measured_gaps
from problems.load_cases.random_gaps import random_gaps
from problems.load_cases.random_inputs import random_inputs
from problems.load_cases.scan_modes import VARIANCE, scan_modes
from problems.load_cases.sweep import MOST_CASES
from problems.model.scene import JointScene, Scene
from problems.model.stage_answers import last_scene

from .staged import refuse_staged_gaps

RANDOM = 100  # cases, if no number is given
#: The options for the field of the gap, and the keys that are the same.
OF_FIELD = {
    "--mean": "initial_gap.mean",
    "--sd": "initial_gap.random.sd",
    "--correlation-length": "initial_gap.random.correlation_length",
}


@dataclass(frozen=True)
class GapCases:
    """Load cases that differ in their gaps (random, measured or of scans) or in random keys of the scene.

    Parameters
    ----------
    count : int, optional
        Number of cases; by default 100 random ones, or all of a table.
    seed : int, optional
        Seed of the random gaps; by default 0.
    mean, sd, correlation_length : float, optional
        Mean, standard deviation and correlation length of the random gaps, mm; by default the scene's.
    around : str or Path, optional
        A scan, CSV with columns x, y and gap in mm, that the random gaps pass through.
    gaps : str or Path, optional
        Measured gaps in place of random ones: .csv, .npz or .npy, one row per case, one column per contact,
        mm.
    options : TableOptions, optional
        Headings of the scan's columns x, y and gap, and marks of missing gaps.
    random : tuple of str, optional
        KEY=DISTRIBUTION, keys of the scene that are random, as "fasteners.preload=each normal(1000, 100)",
        beside those of its table [random]; in a series also of K, as "ribs.I=8 of normal(2000, 100)".
    contributors : int, optional
        Number N of base points, a power of 2: the cases are the N (d + 2) that show what d inputs contribute.
    scans : str or Path, optional
        The files of scans of many joints, as ``scans/*.csv``: the gaps vary about their mean by their
        principal modes.
    variance : float, optional
        The share of the variance of `scans` that the modes keep; by default 0.99.

    Examples
    --------
    >>> from rivetbench import GapCases
    >>> GapCases(count=200, sd=0.02, correlation_length=150.0).seed is None
    True
    """

    count: int | None = None
    seed: int | None = None
    mean: float | None = None
    sd: float | None = None
    correlation_length: float | None = None
    around: str | Path | None = None
    gaps: str | Path | None = None
    options: TableOptions = AS_NAMED
    random: tuple[str, ...] = ()
    contributors: int | None = None
    scans: str | Path | None = None
    variance: float | None = None

    def __post_init__(self) -> None:
        lists = {"random": self.random, "columns": self.options.columns, "missing": self.options.missing}
        refuse_text("GapCases", **lists)

    @property
    def files(self) -> list[str | Path]:
        """The files that the cases are read from."""
        return [*(file for file in (self.around, self.gaps) if file), *glob(str(self.scans or ""))]

    def faults(self, sweep: Sequence[str] = (), table: bool = False) -> list[Fault]:
        """A fault for each number out of range, if the cases come from more than one source, or if options of
        tables have none. table : whether another one has `columns`.
        """
        names = (*("seed",)[bool(self.scans) :], "mean", "sd", "correlation_length", "around")
        random = [f"--{name.replace('_', '-')}" for name in names if getattr(self, name) is not None]
        random += ["--random"] * bool(self.random)
        files = ["--scans"] * bool(self.scans), ["--gaps"] * bool(self.gaps)
        sources, points = (*files, ["--sweep"] * bool(sweep), random), (self.contributors, 1)
        faults = number_faults(cases=(self.count, 1, MOST_CASES), seed=(self.seed, 0), contributors=points)
        empty = (name for name in ("gaps", "scans") if getattr(self, name) == "")
        faults += [Fault(f"--{name}", "file", "", "the path of one: an empty text is none") for name in empty]
        if self.variance is not None and not (self.scans and 0 < self.variance <= 1):
            faults.append(Fault("--variance", "share", self.variance, "above 0, at most 1, with --scans"))
        if self.options.columns and not (self.around or self.scans or table):
            allowed = "those of --around and --scans; the columns of --gaps are the contacts, in their order"
            faults.append(Fault("--columns", "headings", ", ".join(self.options.columns), allowed))
        if self.options.missing and not (self.around or self.scans or self.gaps):
            marks = ", ".join(map(str, self.options.missing))
            faults.append(Fault("--missing", "marks", marks, "those of --around, --scans or --gaps"))
        if self.contributors is not None and (self.count is not None or not self.random):
            allowed = "--random, or [random] in the scene, and no --cases: there are N (inputs + 2)"
            faults.append(Fault("--contributors", "base points", self.contributors, allowed))
        if sum(map(bool, sources)) > 1:
            allowed = "--scans, random gaps, --gaps or --sweep" if sweep else "--scans, random gaps or --gaps"
            faults.append(Fault("cases", "given", " ".join(chain(*sources)), allowed))
        return faults

    def is_single(self, scene: JointScene) -> bool:
        """Whether a search has one case, the scene itself.

        No option but `options` is given, and nothing of the scene is random.
        """
        random = scene.random or any(gap.random for gap in scene.effects_of(InitialGap))
        return replace(self, options=AS_NAMED) == DEFAULT and not random

    def of_search(self, scene: JointScene, form: Form) -> LoadCases:
        """The load cases of a search on a scene, whose figures need cases that are drawn independently."""
        if self.contributors is not None:
            allowed = "leave it out: the cases of contributors are not independent"
            raise InputError.one("--contributors", "base points", self.contributors, allowed)
        if self.is_single(scene):
            return Listed((load_case(last_scene(scene), form),))
        return self.of(scene, form)

    def laws(self, scene: Scene) -> tuple[str, ...]:
        """`random`, and the entries of a scene's [random] for other keys; measured gaps leave these out."""
        told = {text.partition("=")[0].strip() for text in self.random}
        table = () if self.gaps or self.scans or not isinstance(scene, JointScene) else scene.random
        return (*(text for text in table if text.partition("=")[0] not in told), *self.random)

    def of(self, scene: Scene, form: Form, stiffness: bool = False) -> LoadCases:
        """The load cases of a scene, of one with stages those of the last. stiffness : whether keys may
        change K.

        Raises InputError, as `measured_gaps` and `random_gaps` do; or if gaps are drawn that a stage sets, or
        a number of their field is random and an option, too.
        """
        random, last, law = self.laws(scene), last_scene(scene), (self.mean, self.sd, self.correlation_length)
        keys = {text.partition("=")[0].strip() for text in random}
        faults = [
            Fault(option, "mm", number, f"leave it out: {key} is random")
            for (option, key), number in zip(OF_FIELD.items(), law, strict=True)
            if number is not None and key in keys
        ]
        if faults:
            raise InputError(faults)
        count, seed = int(self.count or RANDOM), int(self.seed or 0)  # also of NumPy, which keys cannot hold
        fields = scene.effects_of(InitialGap) if isinstance(scene, JointScene) else ()
        drawn = not random or self.around or law != (None, None, None) or any(one.random for one in fields)
        if drawn:
            refuse_staged_gaps(scene)
        if self.gaps:
            return measured_gaps(last, Path(self.gaps), self.count, form, self.options)
        if self.scans:
            draw = count, seed, self.variance or VARIANCE
            return scan_modes(last, str(self.scans), *draw, form, self.options)
        gaps = random_gaps(last, count, seed, *law, form, self.around, self.options) if drawn else None
        if gaps and not random:
            return gaps
        return random_inputs(scene, random, form, gaps, count, seed, self.contributors, stiffness)


DEFAULT = GapCases()
