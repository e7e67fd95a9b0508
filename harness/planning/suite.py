"""A suite: which scenes, solvers, forms, tolerances and repeats to measure. A TOML file, validated whole.

title = "…"
scenes = ["4386/0107", "6112/*", "drawn/4386/0..59", "my-scene.toml"]  # names, globs, ranges, or paths
tolerances = [1e-9]
[[solver]]
name = "ipm"
forms = ["dual"]
"""

import re
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Literal

import tomlkit
from pydantic import AfterValidator, BaseModel, ConfigDict, Discriminator, Field, JsonValue, PositiveInt, Tag

from problems.errors import Fault, InputError
from problems.input.bounded_types import (
    PLAIN,
    VALUE,
    WORD,
    Count,
    Finite,
    Positive,
    Seed,
    Truth,
    is_word,
    resolved,
    unknown,
    valid_table,
)
from problems.ladders import prefix_of, rung_names
from problems.random_scenes import EXAMPLES, drawn_names
from problems.scene_files import is_scene_file, read_scene, read_toml, scene_name, scene_names
from solvers.base import Form
from solvers.registry import modules, solver_names

#: Keys that suites had until version 0.3.0.
FORMER = ("stop_at_times_fastest",)
SUITES = Path(__file__).parent.parent / "suites"
NonEmpty = Field(min_length=1)
FILE_NAME = r"^[^\x00-\x1f\x7f/\\]*$"  # no control characters, no slashes
FOLDER_NAME = r"^\.*[^\x00-\x1f\x7f/\\.][^\x00-\x1f\x7f/\\]*$"  # nor dots alone: another folder
Auto = Annotated[Literal["auto"], Tag(WORD)]
Repeats = Annotated[Annotated[int, Field(ge=1, le=1000), PLAIN, Tag(VALUE)] | Auto, Discriminator(is_word)]
Tolerances = Annotated[Annotated[list[Positive], NonEmpty, Tag(VALUE)] | Auto, Discriminator(is_word)]
Cases = Annotated[int, Field(ge=1, le=1_000_000), PLAIN]


def pinned(requirement: str) -> str:
    """A package in one version. Raises ValueError."""
    if not re.fullmatch(r"[A-Za-z0-9][\w.-]*==[\w.!+-]+", requirement):
        raise ValueError("must be NAME==VERSION, as piqp==0.6.2")
    return requirement


Requirement = Annotated[str, AfterValidator(pinned)]


class SolverEntry(BaseModel):
    """One [[solver]]: its name and options, and the scenes, forms and tolerances that it is measured on.

    The default of `forms` is the dual, or the primal if the solver takes no other. `threads` and `cases`
    override the suite's. "auto" as tolerances searches for the loosest that reaches the limit on each scene,
    as repeats it repeats what is quick (tolerance_search.py). batched : load cases of a series solved at
    once, by the solver's `batched`. with = ["piqp==0.6.2"] measures it in an environment that has this
    version of its library, and what else is listed. beside : it is measured again, at most an hour before
    what is not ours, so that ratios are of one machine and hour.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, serialize_by_alias=True, allow_inf_nan=False)

    name: str
    forms: Annotated[list[Form], NonEmpty] | None = None
    variant: Annotated[str, Field(max_length=60, pattern=FILE_NAME)] = ""
    options: dict[str, JsonValue] = {}
    tolerances: Tolerances | None = None
    scenes: Annotated[list[str], NonEmpty] | None = None
    repeats: Repeats | None = None
    threads: Annotated[list[Count], NonEmpty] | None = None
    cases: Cases | None = None
    batched: Count | None = None
    gated: Truth = True
    beside: Truth = False
    time_limit_s: Positive | None = None
    requirements: Annotated[list[Requirement] | None, NonEmpty, Field(alias="with")] = None

    @property
    def version(self) -> str:
        """The versions of `with`, without the solver's own name: "0.6.2", "proxsuite==0.7.2"; or ""."""
        return " ".join(self.requirements or ()).removeprefix(f"{self.name}==")

    @property
    def label(self) -> str:
        """The variant and the version, which distinguish the rows of the solver's entries."""
        return f"{self.variant} {self.version}".strip()

    def takes(self, name: str, source: str) -> bool:
        """Whether it is measured on a scene of the suite, by its own `scenes`."""
        return self.scenes is None or any(fnmatchcase(name, glob) or glob == source for glob in self.scenes)


class RandomCases(BaseModel):
    """[series]: each scene with `cases` random initial gaps, solved one after another in one process.

    mean, sd and correlation_length, mm, are by default those of the scene's `initial_gap`. fasteners :
    between two cases, a fastener of the scene is taken out or put back (problems/load_cases/stream.py).
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    cases: Cases
    seed: Seed = 0
    mean: Finite | None = None
    sd: Positive | None = None
    correlation_length: Positive | None = None
    fasteners: Annotated[Truth, Field(exclude_if=lambda moved: not moved)] = False


class Suite(BaseModel):
    """The content of a suite file; scenes are names, or absolute paths of files. `name` is the file's.

    yardstick measures a Cholesky factorisation of Q and a product Qv after each solve, in its process.
    trace also stops each solver after 1, 2, 4, … iterations, as long as these are fewer than it takes.
    time_limit_by_size_s, as in { 11308 = 80 }, is for scenes of that size n; time_limit_s for the rest.
    times_best_form leaves out forms in which a library is slow on smaller scenes (tolerance_search.py). After
    reference_limit_s no further method is tried for a reference; by default 60 s per thousand contacts, at
    least 60.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Annotated[str, Field(min_length=1, max_length=60, pattern=FOLDER_NAME)]
    title: str = ""
    description: str = ""
    scenes: Annotated[list[str], NonEmpty]
    tolerances: Tolerances = [1e-9]
    repeats: Repeats = 1
    threads: Annotated[list[Count], NonEmpty] = [2]
    time_limit_s: Positive = 60.0
    time_limit_by_size_s: dict[PositiveInt, Positive] = {}
    times_best_form: Annotated[float, Field(ge=1, allow_inf_nan=False), PLAIN] | None = None
    memory_limit_mib: Count = 8192
    reference_limit_s: Positive | None = None
    limit_mm: Positive = 1e-7
    yardstick: Truth = False
    trace: Truth = False
    plugin: str | None = None
    series: RandomCases | None = None
    solver: Annotated[list[SolverEntry], NonEmpty]

    def time_limit(self, n: int) -> float:
        """The limit in seconds on a scene of n unknowns."""
        return self.time_limit_by_size_s.get(n, self.time_limit_s)


def suite_names() -> list[str]:
    """The suites that come with the package."""
    return sorted(path.stem for path in SUITES.glob("*.toml"))


def read_suite(name_or_path: str) -> Suite:
    """Read a suite by name or by the path of its TOML file.

    Raises InputError naming the file, the key, the value and what is allowed, all faults at once.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml":
        path = SUITES / f"{name_or_path}.toml"
        if not path.is_file():
            raise InputError.one("SUITE", "name", name_or_path, unknown("suite", name_or_path, suite_names()))
    suite = suite_from(read_toml(path), path)
    if faults := [*_elsewhere(suite, path), *_overlapping(suite, path)]:
        raise InputError(faults)
    return suite


def suite_from(data: dict[str, Any], path: Path) -> Suite:
    """A suite from a TOML file's content; its globs and relative paths are resolved."""
    faults: list[Fault] = []
    data = {"name": path.stem, **data}
    if isinstance(data.get("scenes"), list):
        data["scenes"] = resolved_scenes(data["scenes"], str(path), "scenes", path.parent, faults)
    if isinstance(data.get("plugin"), str):
        data["plugin"] = str(resolved(path.parent / data["plugin"]))
    for entry in _entries(data):
        if isinstance(scenes := entry.get("scenes"), list):
            entry["scenes"] = [str(resolved(path.parent / s)) if is_scene_file(s) else s for s in scenes]
    faults += _unknown_solvers(data, path)
    return validated(data, path, faults)


def validated(data: dict[str, Any], path: Path, faults: Sequence[Fault] = ()) -> Suite:
    """A suite from resolved data, as `to_toml` writes them. Raises InputError with `faults` and its own."""
    faults = list(faults)
    suite = valid_table(Suite, data, path, faults)
    if suite is not None:
        faults += [*_indistinguishable(suite, path), *_of_series(suite, path), *_of_rounds(suite, path)]
    if faults or suite is None:
        raise InputError(faults)
    return suite


def read_written(path: Path) -> Suite:
    """The suite.toml of a results directory. Raises InputError."""
    return validated({key: value for key, value in read_toml(path).items() if key not in FORMER}, path)


def resolved_scenes(patterns: list[Any], where: str, key: str, base: Path, faults: list[Fault]) -> list[str]:
    """The scenes of names, globs, ranges and paths (relative to `base`), in order, without duplicates.

    Only patterns that begin with "hard/" or "hard-full/" match rungs of ladders, and only names and ranges
    ("drawn/4386/0..59") scenes drawn at random.
    """
    scenes: dict[str, None] = {}
    for pattern in map(str, patterns):
        if is_scene_file(pattern):
            path = resolved(base / pattern)
            if not path.is_file():
                faults.append(Fault(where, key, pattern, "no such file"))
            scenes[str(path)] = None
            continue
        prefix = prefix_of(pattern)
        packaged = rung_names(prefix) if prefix else scene_names()
        names = drawn_names(pattern) or [name for name in packaged if fnmatchcase(name, pattern)]
        if not names:
            faults.append(Fault(where, key, pattern, unknown("scene", pattern, [*packaged, *EXAMPLES])))
        scenes |= dict.fromkeys(names)
    return list(scenes) or list(map(str, patterns))


def _entries(data: dict[str, Any]) -> list[dict[str, Any]]:
    """The tables [[solver]]; what is something else is refused when they are validated."""
    entries = data["solver"] if isinstance(data.get("solver"), list) else []
    return [entry if isinstance(entry, dict) else {} for entry in entries]


def _unknown_solvers(data: dict[str, Any], path: Path) -> list[Fault]:
    names = {k: str(entry["name"]) for k, entry in enumerate(_entries(data)) if "name" in entry}
    solvers = [*modules(), *([Path(data["plugin"]).stem] if isinstance(data.get("plugin"), str) else [])]
    if not set(names.values()) <= set(solvers):
        solvers += [name for name in solver_names() if name not in solvers]  # slow: imports every library
    return [
        Fault(str(path), f"solver.{k}.name", name, unknown("solver", name, solvers))
        for k, name in names.items()
        if name not in solvers
    ]


def _indistinguishable(suite: Suite, path: Path) -> Iterator[Fault]:
    """Entries that could not be distinguished in a table."""
    above: dict[tuple[str, str], dict[str, object]] = {}
    for k, entry in enumerate(suite.solver):
        setting: dict[str, object] = {
            "options": entry.options,
            "`with`": entry.requirements,
            "`batched`": entry.batched is not None,
        }
        first = above.setdefault((entry.name, entry.label), setting)
        if other := [key for key in setting if first[key] != setting[key]]:
            allowed = f"{entry.name} has other {other[0]} under this variant above; choose another variant"
            yield Fault(str(path), f"solver.{k}.variant", entry.variant, allowed)


def _elsewhere(suite: Suite, path: Path) -> Iterator[Fault]:
    """Scenes of entries that are none of the suite's: there, nothing would be measured."""
    for k, entry in enumerate(suite.solver):
        for scene in entry.scenes or ():
            alone = entry.model_copy(update={"scenes": [scene]})
            if not any(alone.takes(scene_name(each), each) for each in suite.scenes):
                allowed = "a scene among those of the suite, or a glob of some"
                yield Fault(str(path), f"solver.{k}.scenes", scene, allowed)


def _overlapping(suite: Suite, path: Path) -> list[Fault]:
    """Entries that plan what one above plans, with another gate or time limit, of which a row has one.

    Options of the command line may bring some together, as `--tolerance` does: then the first counts.
    """
    faults: dict[str, Fault] = {}
    for (first, above), (k, entry) in combinations(enumerate(suite.solver), 2):
        for scene, words in _planned_twice(suite, above, entry):
            n, _ = read_scene(scene).expected_size or (0, 0)
            one_s, other_s = (each.time_limit_s or suite.time_limit(n) for each in (above, entry))
            terms = ("gated", above.gated, entry.gated), ("time_limit_s", one_s, other_s)
            for key, one, other in terms:
                if one != other:
                    allowed = f"{one} in solver.{first}, which plans {words} too: leave it to one of them"
                    place = f"solver.{k}.{key}"
                    faults.setdefault(place, Fault(str(path), place, other, allowed))
    return list(faults.values())


def _planned_twice(suite: Suite, one: SolverEntry, other: SolverEntry) -> Iterator[tuple[str, str]]:
    """Each scene with a measurement that two entries of other terms plan there. No form is the dual."""
    if (one.name, one.label, one.batched) != (other.name, other.label, other.batched):
        return
    if (one.gated, one.time_limit_s) == (other.gated, other.time_limit_s):
        return
    tolerances = [each.tolerances or suite.tolerances for each in (one, other)]
    numbers = [set(map("{:g}".format, each)) for each in tolerances if each != "auto"]
    tolerance = min(set.intersection(*numbers), default="") if numbers else "auto"
    form = min({*(one.forms or ["dual"])} & {*(other.forms or ["dual"])}, default="")
    threads = min({*(one.threads or suite.threads)} & {*(other.threads or suite.threads)}, default=0)
    for scene in suite.scenes if tolerance and form and threads else ():
        name = scene_name(scene)
        if one.takes(name, scene) and other.takes(name, scene):
            words = [name, one.name, form, *filter(None, [one.label]), f"tol={tolerance}"]
            yield scene, " ".join([*words, f"threads={threads}"])


def _of_rounds(suite: Suite, path: Path) -> Iterator[Fault]:
    """Entries with `beside` that a round cannot measure, or with a search that a trace would stop."""
    allowed = "needs numbers as tolerances, and a suite without [series]"
    for k, entry in enumerate(suite.solver):
        searched = (entry.tolerances or suite.tolerances) == "auto"
        if entry.beside and (suite.series or searched):
            yield Fault(str(path), f"solver.{k}.beside", True, allowed)
        if suite.trace and searched:
            yield Fault(str(path), f"solver.{k}.tolerances", "auto", "numbers: a trace searches for none")


def _of_series(suite: Suite, path: Path) -> Iterator[Fault]:
    """Keys that need [series] in a suite without it, and values that a suite with it cannot have."""
    places: list[tuple[str, Suite | SolverEntry]] = [("", suite)]
    places += [(f"solver.{k}.", entry) for k, entry in enumerate(suite.solver)]
    for where, place in places:
        if suite.series is None:
            wrong = {key: getattr(place, key, None) for key in ("cases", "batched")}
            allowed = "needs a suite with [series]"
        else:
            wrong = {key: getattr(place, key) for key in ("tolerances", "repeats")}
            wrong = {key: value for key, value in wrong.items() if value == "auto"}
            allowed = "numbers: a suite with [series] searches for none"
        for key, value in wrong.items():
            if value is not None:
                yield Fault(str(path), where + key, value, allowed)


def to_toml(suite: Suite) -> str:
    """The suite as a TOML file that reads back as the same suite."""
    return tomlkit.dumps(suite.model_dump(mode="json", exclude_none=True))
