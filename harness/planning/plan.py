"""From a suite to the list of measurements, in the order of execution."""

import json
import random
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from itertools import product
from math import inf
from typing import Any

from harness.results.schema import ROUND
from problems.errors import Fault, InputError, read_all
from problems.model.scene import Scene
from problems.scene_files import read_scene
from solvers.base import FORMS, Form

from .suite import RandomCases, SolverEntry, Suite

#: The tolerances of "auto", the loosest first: decades, and one about half-way between each two.
HALF_DECADES = [float(text) for k in range(3, 17) for text in (f"1e-{k}", f"3e-{k + 1}")][:-1]
MOST_REPEATS = 5  # of "auto"
ROUND_REPEATS = 3  # at most, of what is measured in a round
#: Numbers of iterations after which a trace stops a solver.
ITERATION_LIMITS = [2**k for k in range(20)]
BEST = 1.0
QUICK = 0.1  # of the time limit: what the other scenes of a size may take
LEGIBLE = 120  # characters of a file name


@dataclass(frozen=True)
class Measurement:
    """One solver on one scene in one form, perhaps on one load case of a series.

    entry : the settings, one of the suite's. scene : the name in the tables; source : a name or an absolute
    path for `read_scene`. case : the number of the load case in a series.

    guide : (scene, times, seconds): the form is measured only if on that scene it took at most `times` as
    long as the library's best form, and that one at most `seconds`, as far as rows of it are
    there (tolerance_search.py); None: all forms are.

    round : when a round began, in which an entry with `beside` is measured again; beside_round : the round
    beside which this one is measured. iteration_limit : in a trace, after which the solver stops.
    """

    suite: Suite
    entry: SolverEntry
    scene: str
    source: str
    form: Form
    tolerance: float
    threads: int
    repeat: int
    time_limit_s: float
    case: int | None = None
    guide: tuple[str, float, float] | None = None
    round: str = ""
    beside_round: str = ""
    iteration_limit: int | None = None

    @property
    def solver(self) -> str:
        return self.entry.name

    @property
    def variant(self) -> str:
        """The entry's label, and the limit on iterations."""
        limit = "" if self.iteration_limit is None else f" stopped at {self.iteration_limit}"
        return f"{self.entry.label}{limit}".strip()

    @property
    def searched(self) -> bool:
        """Whether the tolerance is one of a search (tolerance_search.py)."""
        return (self.entry.tolerances or self.suite.tolerances) == "auto"

    @property
    def paced(self) -> bool:
        """Whether the number of repeats depends on the seconds of the first."""
        return (self.entry.repeats or self.suite.repeats) == "auto"

    @property
    def series(self) -> RandomCases | None:
        series, cases = self.suite.series, self.entry.cases
        return series.model_copy(update={"cases": cases}) if series and cases else series

    @property
    def process(self) -> tuple[object, ...]:
        """The identity of a process, which load cases of a series may share."""
        words = self.scene, self.solver, self.form, self.variant, self.tolerance, self.threads, self.repeat
        return *words, self.entry.batched

    @cached_property
    def key(self) -> str:
        """Identity of the measurement, the same in every run: '4386/0107 ipm dual tol=1e-09 …'."""
        words = [self.scene, self.solver, self.form, *([self.variant] if self.variant else [])]
        words += [f"tol={self.tolerance:g}", f"threads={self.threads}", f"repeat={self.repeat}"]
        words += [] if self.entry.batched is None else [f"batched={self.entry.batched}"]
        words += [] if self.case is None else [f"case={self.case}"]
        options = self.entry.options
        words += [json.dumps(options, sort_keys=True)] if options else []
        return " ".join(words) + (f"{ROUND}{self.round}" if self.round else "")

    def same_settings(self, row: Mapping[str, Any]) -> bool:
        """Whether a row is of this solver, form, options and threads, whatever its scene and tolerance."""
        settings = (self.solver, self.form, self.variant, self.entry.options, self.threads)
        names = ("solver", "form", "variant", "options", "threads_asked")
        return tuple(map(row.get, names)) == settings

    @property
    def stem(self) -> str:
        """The stem of its file names: its key, legible, and a fingerprint that keeps it distinct."""
        legible = re.sub(r"[^\w.+-]+", "-", self.key, flags=re.ASCII)[:LEGIBLE]
        return f"{legible}-{sha256(self.key.encode(errors='backslashreplace')).hexdigest()[:10]}"


def expand(suite: Suite) -> list[Measurement]:
    """All measurements of a suite, scene by scene, except on rungs that the model should refuse.

    Repeats are interleaved: a round in the suite's order, then rounds in random orders, so that a drift of
    the machine does not affect one solver alone. Measurements that differ only in tolerance or load case keep
    their order.

    Raises InputError if nothing is left to measure or if the files of two scenes would have the same names.
    """
    scenes: dict[str, Scene] = {}
    files: dict[str, str] = {}
    faults: list[Fault] = []
    for source, scene in zip(suite.scenes, read_all(read_scene, suite.scenes), strict=True):
        file = scene.name.replace("/", "_")
        if files.setdefault(file, source) != source:
            allowed = f"another is called {file} too, in the names of files; rename one"
            faults.append(Fault(suite.name, "scenes", source, allowed))
        if not scene.refused:
            scenes[source] = scene
    if faults:
        raise InputError(faults)
    plan: dict[str, Measurement] = {}
    guides = _guides(suite, list(scenes.values()))
    for source, scene in scenes.items():
        entries = [entry for entry in suite.solver if entry.takes(scene.name, source)]
        measurements = [
            replace(m, guide=guides[scene.name]) for e in entries for m in _of_entry(suite, e, scene, source)
        ]
        for m in sorted(measurements, key=_round_and_place):
            plan.setdefault(m.key, m)
    if not plan:
        allowed = f"no solver is meant for these: { ({entry.name: entry.scenes for entry in suite.solver}) }"
        if not scenes:
            allowed = "rungs that a model should refuse are not measured, and there are no other scenes"
        raise InputError.one(suite.name, "scenes", suite.scenes, allowed)
    return list(plan.values())


def _guides(suite: Suite, scenes: Sequence[Scene]) -> dict[str, tuple[str, float, float] | None]:
    """The guide of each scene in a suite with `times_best_form`.

    The first scene of a size is guided by the first of the next smaller size; any other scene by the first of
    its size, where the form must have been the best, and quick. Own matrices, whose size is not known here,
    neither guide nor are guided.
    """
    sizes = {scene.name: expected[0] for scene in scenes if (expected := scene.expected_size)}
    first = {n: name for name, n in reversed(sizes.items())}
    guides: dict[str, tuple[str, float, float] | None] = {scene.name: None for scene in scenes}
    for name, n in sizes.items() if suite.times_best_form else ():
        smaller = max((size for size in first if size < n), default=None)
        if name != first[n]:
            guides[name] = first[n], BEST, QUICK * suite.time_limit(n)
        elif smaller is not None:
            guides[name] = first[smaller], suite.times_best_form or BEST, inf
    return guides


def _of_entry(suite: Suite, entry: SolverEntry, scene: Scene, source: str) -> Iterator[Measurement]:
    tolerances = entry.tolerances or suite.tolerances
    repeats = entry.repeats or suite.repeats
    n, _ = scene.expected_size or (0, 0)
    time_limit_s = entry.time_limit_s or suite.time_limit(n)
    for form, tolerance, iteration_limit, threads, repeat, case in product(
        entry.forms or FORMS,
        HALF_DECADES if tolerances == "auto" else tolerances,
        (None, *ITERATION_LIMITS) if suite.trace else (None,),
        entry.threads or suite.threads,
        range(MOST_REPEATS if repeats == "auto" else repeats),
        range(entry.cases or suite.series.cases) if suite.series else (None,),
    ):
        at = form, tolerance, threads, repeat, time_limit_s, case
        yield Measurement(suite, entry, scene.name, source, *at, iteration_limit=iteration_limit)


def round_beside(m: Measurement, time: str) -> list[Measurement]:
    """The suite's entries with `beside` on m's scene, to be measured in a round that begins at a time."""
    scene = read_scene(m.source)
    entries = (e for e in m.suite.solver if e.beside and e.takes(scene.name, m.source))
    of_scene = (measurement for e in entries for measurement in _of_entry(m.suite, e, scene, m.source))
    return [
        replace(measurement, round=time)
        for measurement in of_scene
        if measurement.repeat < ROUND_REPEATS and measurement.iteration_limit is None
    ]


def _round_and_place(m: Measurement) -> tuple[int, float]:
    """The round of a measurement, and a random place in it, where the first round keeps the suite's order."""
    words = f"{m.scene} {m.repeat} {m.solver} {m.form} {m.variant} {m.threads}"
    return m.repeat, random.Random(words).random() if m.repeat else 0.0


def with_key(suite: Suite, key: str) -> Suite:
    """The suite with the scene and the solver entries that a row's key names. Raises InputError."""
    scenes = [scene for scene in suite.scenes if key.startswith(f"{read_scene(scene).name} ")]
    words = {*key.split()}
    entries = [e for e in suite.solver if f" {e.name} " in key and {*e.label.split()} <= words]
    if not scenes or not entries:
        raise _unknown(suite.name, key)
    return suite.model_copy(update={"scenes": scenes, "solver": entries})


def of_key(plan: Sequence[Measurement], key: str) -> list[Measurement]:
    """The measurement with this key after its earlier repeats, of an entry that plans no others.

    A load case of a series comes after the earlier ones of its process, because its start depends on them.
    Raises InputError.
    """
    chosen = next((m for m in plan if m.key == key), None)
    if chosen is None:
        raise _unknown(plan[0].suite.name, key)
    at_once, repeats = chosen.entry.batched or 1, chosen.repeat + 1
    end = inf if chosen.case is None else (chosen.case // at_once + 1) * at_once
    processes = {replace(chosen, repeat=k).process for k in range(repeats)}
    needed = [m for m in plan if m.process in processes and (m.case or 0) < end]
    only = {"forms": [chosen.form], "tolerances": [chosen.tolerance], "threads": [chosen.threads]}
    cases = None if chosen.case is None else len(needed) // repeats
    entry = chosen.entry.model_copy(update=only | {"repeats": repeats, "cases": cases})
    return [replace(m, entry=entry) for m in needed]


def _unknown(suite: str, key: str) -> InputError:
    return InputError.one("--key", "key", key, f"the `key` of a row that suite {suite} plans, in full")
