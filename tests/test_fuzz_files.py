"""Hostile files without end: each command ends soon with a documented exit code and words, and loses no file.

A few hundred inputs; RIVETBENCH_LONG=1 takes 20 000, RIVETBENCH_LONG=N takes N.
"""

from __future__ import annotations

import hashlib
import resource
import shutil
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
import tiny
from hostile_draws import mutate
from long import draws
from matplotlib.figure import Figure
from rich.console import Console
from small import make_load, make_prepared
from typer.testing import CliRunner

from harness.cli.app import app
from harness.measurement.run import run
from harness.planning.suite import read_suite
from harness.results import records
from harness.scene.exchange import matrices
from problems import formats
from report.figures import style

SEED = 17
TIME_LIMIT_S = 60  # per command
WORST_SHOWN = 25
DRAWN = 0.02  # of the reports: their pictures are saved, which takes a second
MEMORY = 6 * 2**30  # bytes of address space: what reads without end is a fault before the machine is full
CODES = {0, 1, 2, 3}
QUIET = Console(file=StringIO())

SCENE = """
title = "A joint"
[joint]
junction = { length = 100.0, width = 50.0, nodes = [4, 3] }
[[joint.part]]
name = "a"
thickness = 2.0
north = { length = 40.0, elements = 2 }
clamped = ["north"]
[[joint.part]]
name = "b"
thickness = 3.0
north = { length = 40.0, elements = 2 }
clamped = ["north"]
[[effect]]
kind = "initial_gap"
mean = 0.1
random = { sd = 0.05, correlation_length = 30.0, seed = 1 }
[[effect]]
kind = "fasteners"
preload = 20.0
file = "points.csv"
[[effect]]
kind = "pressure"
part = "a"
value = 1e-3
"""
POINTS = "x,y\n20.0,10.0\n50.0,25.0\n80.0,40.0\n"


class Fault(Exception):
    """What the test exists to find. kind : hang, traceback, lost, wrong or words."""

    def __init__(self, kind: str, what: object) -> None:
        super().__init__(kind, what)
        self.kind, self.what = kind, what


@dataclass(frozen=True)
class Target:
    """A folder of valid files, those to damage, the commands on it, and what must hold if one succeeds.

    keeps : which files no command may change. checked : (folder, words, exit code, output) → Fault, or none.
    """

    name: str
    share: float
    folder: Path
    damaged: tuple[str, ...]
    commands: tuple[tuple[str, ...], ...]
    keeps: Callable[[str], bool] = lambda name: not name.startswith("out")
    checked: Callable[[Path, tuple[str, ...], int, str], None] = lambda *_: None


def invoke(folder: Path, words: tuple[str, ...]) -> tuple[int, str]:
    """Exit code and output of a command; `@name` is a path in the folder."""
    done = CliRunner().invoke(app, [word.replace("@", f"{folder}/") for word in words])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.output


@contextmanager
def limited() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise Fault("hang", f"more than {TIME_LIMIT_S} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, TIME_LIMIT_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def contents(folder: Path, keeps: Callable[[str], bool]) -> dict[str, str]:
    """The kind or the hash of each file; pipes and devices are not read."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if keeps(name) and not (path.is_dir() and not path.is_symlink()):
            if path.is_symlink():
                found[name] = f"-> {path.readlink()}"
            elif path.is_file():
                found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
            else:
                found[name] = "special"
    return found


# --- what is damaged ------------------------------------------------------------------------------------


def own_matrices() -> formats.Data:
    """K (7, 7), A (7, 4), f, g."""
    data = make_prepared(3, 3, tools=1)
    return matrices(data, make_load(3, data)[0])


def scene(root: Path) -> Target:
    folder = root / "scene"
    folder.mkdir()
    (folder / "scene.toml").write_text(SCENE)
    (folder / "points.csv").write_text(POINTS)
    (folder / "gaps.csv").write_text("\n".join(",".join(["0.1"] * 12) for _ in range(3)) + "\n")
    series = ("series", "@scene.toml", "--threads", "1", "--check", "0", "--out", "@out")
    commands = (
        *[("validate", "@scene.toml")] * 6,
        ("solve", "@scene.toml", "--out", "@out"),
        ("export", "@scene.toml", "--format", "npz", "--out", "@out.npz"),
        (*series, "--gaps", "@gaps.csv"),
        (*series, "--sweep", "initial_gap.mean=0.1:0.2:2"),
    )
    return Target("scene", 0.3, folder, ("scene.toml", "scene.toml", "points.csv", "gaps.csv"), commands)


def own(root: Path, form: str, suffix: str) -> Target:
    folder = root / form
    folder.mkdir()
    made = folder / ("own" if suffix == ".mtx" else f"own{suffix}")
    formats.write(form, made, own_matrices())
    files = [f"own/{name}.mtx" for name in "KAfg"] if suffix == ".mtx" else [made.name]
    commands = [("import", *(f"@{name}" for name in files), "--out", "@out.npz")] * 2
    if suffix == ".npz":
        commands += [("import", "@own.npz", "--out", "@own.npz"), ("validate", "@own.npz")]
        commands += [
            ("solve", "@own.npz", "--out", "@out"),
            ("solve", "@own.npz", "--solver", "gi", "--out", "@out"),
        ]
    if form == "mtx":
        text = "".join(f'{name} = "own/{name}.mtx"\n' for name in "KAfg")
        (folder / "scene.toml").write_text(f"[matrices]\n{text}")
        files.append("scene.toml")
        commands += [("validate", "@scene.toml"), ("solve", "@scene.toml", "--out", "@out")]
    return Target(form, 0.08, folder, tuple(files), tuple(commands), checked=archive_is_whole)


def archive_is_whole(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
    if "nan mm" in output or "inf mm, proven" in output:
        raise Fault("wrong", output[-200:])


def cached(root: Path) -> Target:
    """Own matrices whose cache is damaged: the answer is what it was, or there is none."""
    folder = root / "cached"
    folder.mkdir()
    formats.write("npz", folder / "own.npz", own_matrices())
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIVETBENCH_CACHE", str(folder / "cache"))
        assert invoke(folder, ("solve", "@own.npz", "--out", "@answer"))[0] == 0
    files = [
        str(path.relative_to(folder))
        for path in (folder / "cache").rglob("*")
        if path.suffix in (".npy", ".json")
    ]

    def same_answer(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
        if code == 0 and words[0] == "solve":
            with np.load(folder / "out/solution.npz") as new, np.load(folder / "answer/solution.npz") as old:
                if abs(new["x"] - old["x"]).max() > 1e-14:
                    raise Fault("wrong", f"off by {abs(new['x'] - old['x']).max()}")

    commands = (("solve", "@own.npz", "--out", "@out"), ("validate", "@own.npz"))
    return Target(
        "cache",
        0.08,
        folder,
        tuple(files),
        commands,
        lambda name: not name.startswith(("out", "cache")),
        same_answer,
    )


def results(root: Path) -> Target:
    """A finished run of two rows."""
    folder = root / "results"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIVETBENCH_CACHE", str(root / "cache"))
        text = '[[solver]]\nname = "exact"\nforms = ["dual"]\n'
        suite = read_suite(str(tiny.write_suite(folder, text, tolerances=[1e-6, 1e-8])))
        assert run(suite, folder / "done", QUIET) == 0
        assert invoke(folder, ("gate", "@done"))[0] == 0
    rows = records.read(folder / "done" / records.MEASUREMENTS)
    exact = {}
    for row in rows:
        with np.load(folder / "done" / row["answer"]) as saved:
            exact[row["key"]] = saved["x"]
    keys = set(exact)
    suite_text = (folder / "done" / "suite.toml").read_bytes()

    def accurate(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
        """The gate passes only what is there, complete and right."""
        if code or words[0] != "gate":
            return
        found = records.read(folder / "done" / records.MEASUREMENTS)
        path = folder / "done" / "suite.toml"
        same_suite = path.is_file() and path.read_bytes() == suite_text
        if same_suite and {row["key"] for row in found if row["gated"]} != keys:
            raise Fault("wrong", "passed without all rows")
        for row in found:
            if row["gated"] and row["key"] in exact:
                with np.load(folder / "done" / row["answer"]) as saved:
                    if not abs(saved["x"] - exact[row["key"]]).max() <= 2e-7:
                        raise Fault("wrong", f"passed {row['key']}")

    names = tuple(
        str(path.relative_to(folder))
        for path in (folder / "done").rglob("*")
        if path.suffix in (".jsonl", ".toml", ".json", ".npz")
    )
    commands = (*[("gate", "@done")] * 4, ("report", "@done"))
    return Target("results", 0.18, folder, names, commands, lambda name: "report/" not in name, accurate)


def series(root: Path) -> Target:
    """A finished series of six cases: gone on with, it is what it was."""
    folder = root / "series"
    folder.mkdir()
    (folder / "scene.toml").write_text(SCENE)
    (folder / "points.csv").write_text(POINTS)
    words = ("series", "@scene.toml", "--cases", "6", "--threads", "1", "--check", "0", "--out", "@done")
    assert invoke(folder, words)[0] == 0
    shutil.rmtree(folder / "done" / "report")
    (folder / "done" / ".lock").unlink(missing_ok=True)
    gaps = np.fromfile(folder / "done" / "gaps.f4", np.float32)
    whole = (folder / "done" / "gaps.f4").read_bytes()

    def same_gaps(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
        path = folder / "done" / "gaps.f4"
        if code == 0 and words[0] == "report" and path.read_bytes() != whole:
            raise Fault("wrong", "reported on damaged gaps")
        if code == 0 and words[0] == "series":
            found = np.fromfile(path, np.float32)
            if found.size < gaps.size or abs(found[: gaps.size] - gaps).max() > 1e-6:
                raise Fault("wrong", "went on with damaged gaps")

    names = ("done/series.json", "done/gaps.f4", "done/cases.jsonl", "done/contacts.npz", "scene.toml")
    commands = (("report", "@done"), words, (*words[:3], "9", *words[4:]))
    return Target(
        "series", 0.06, folder, names, commands, lambda name: not name.startswith("done/"), same_gaps
    )


@pytest.fixture(scope="module")
def targets(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Target]]:
    root = tmp_path_factory.mktemp("targets")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIVETBENCH_CACHE", str(root / "cache"))
        patch.setattr(style, "DPI", 30)
        patch.setattr("harness.measurement.describe.TIME_LIMIT_S", 20, raising=False)
        made = [scene(root), cached(root), results(root), series(root)]
        made += [
            own(root, form, suffix)
            for form, suffix in (("npz", ".npz"), ("qpsolvers", ".npz"), ("mtx", ".mtx"))
        ]
        made += [
            own(root, form, suffix)
            for form, suffix in (("abaqus", ".mtx"), ("op4", ".op4"), ("dmig", ".pch"))
        ]
        before = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, before[1]))
        yield made
        resource.setrlimit(resource.RLIMIT_AS, before)


# --- the test ---------------------------------------------------------------------------------------------


def test_every_hostile_file_is_refused_or_right(
    targets: list[Target], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    count, start = draws(250, 20_000), time.monotonic()
    faults: Counter[str] = Counter()
    seen: Counter[str] = Counter()
    spent: Counter[str] = Counter()
    words: list[str] = []
    save = Figure.savefig
    shares = np.array([target.share for target in targets])
    for index in range(count):
        random = np.random.default_rng([SEED, index])
        drawn = random.random() < DRAWN
        monkeypatch.setattr(Figure, "savefig", save if drawn else lambda *_, **__: None)
        target = targets[random.choice(len(targets), p=shares / shares.sum())]
        begun = time.monotonic()
        what = ""
        try:
            what, code = _one(random, target, tmp_path / "work", monkeypatch)
            seen[f"{target.name} {code}"] += 1
        except Fault as fault:
            faults[fault.kind] += 1
            words.append(f"{fault.kind}: draw {index}, {target.name}: {fault.what}")
            print(words[-1], flush=True)
        spent[target.name] += time.monotonic() - begun  # type: ignore[assignment]
        if index % 1000 == 999:
            print(f"{index + 1} of {count}, {time.monotonic() - start:.0f} s, {dict(faults)}", flush=True)
    print(count, f"inputs, {time.monotonic() - start:.0f} s:", dict(faults), dict(seen))
    print({name: round(seconds, 1) for name, seconds in spent.items()})
    assert not faults, "\n".join([str(dict(faults)), *words[:WORST_SHOWN]])
    # Else little was tried: what is damaged is refused, and some of it is harmless.
    for target in targets:
        codes = {code for code in CODES if seen[f"{target.name} {code}"]}
        assert {0, 2} & codes, target.name


def _one(
    random: np.random.Generator, target: Target, work: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[str, int]:
    """One file damaged, one command: what was done, and its exit code. Raises Fault."""
    if work.exists():
        shutil.rmtree(work)
    shutil.copytree(target.folder, work, symlinks=True)
    if target.name == "cache":
        monkeypatch.setenv("RIVETBENCH_CACHE", str(work / "cache"))
    else:
        monkeypatch.setenv("RIVETBENCH_CACHE", str(target.folder.parent / "cache"))
    name = target.damaged[random.integers(len(target.damaged))]
    try:
        what = f"{name} {mutate(random, work / name)}"
    except (ValueError, TypeError, OverflowError) as error:  # the mutation does not fit
        return f"none, {error}", -1
    command = target.commands[random.integers(len(target.commands))]
    before = contents(work, target.keeps)
    said = f"{what}; {' '.join(command)}"
    try:
        with limited():
            code, output = invoke(work, command)
    except Fault as fault:
        raise Fault(fault.kind, f"{said}: {fault.what}") from None
    except Exception as error:
        import traceback

        where = traceback.extract_tb(error.__traceback__)
        mine = [f"{Path(f.filename).name}:{f.lineno}" for f in where if "/site-packages/" not in f.filename][
            -3:
        ]
        raise Fault("traceback", f"{said}: {error!r:.200} at {' '.join(mine)}") from error
    if code not in CODES:
        raise Fault("words", f"{said}: exit code {code}")
    if code and not output.strip():
        raise Fault("words", f"{said}: exit code {code} without a word")
    if "Traceback" in output or "\x1b" in output:
        raise Fault("words", f"{said}: {output[-300:]}")
    if contents(work, target.keeps) != before:
        raise Fault("lost", said)
    try:
        target.checked(work, command, code, output)
    except Fault as fault:
        raise Fault(fault.kind, f"{said}: {fault.what}") from None
    return said, code
