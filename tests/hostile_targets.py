"""Folders of valid files, the commands on them, and what must hold if one succeeds on damaged files."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import tiny_joint
from hostile_draws import OF_SUFFIX
from sample_size import Fault
from small_joints import SCENE
from small_problems import make_load, make_prepared, solve_by_nnls
from suite_runs import rows_of, said_by
from superelements import flat, stiffnesses, two_plates, write_part
from synthetic_results import row, write_rows
from typer.testing import CliRunner

from harness.cli.app import app
from harness.measurement.suite_run import run
from harness.planning.suite import read_suite
from harness.results.records import Row
from harness.scene.export import matrices
from problems import formats
from problems.forms.assembly import Vector

POINTS = "x,y\n20.0,10.0\n50.0,25.0\n80.0,40.0\n"
RANDOM = "mean = 0.1\nrandom = { sd = 0.05, correlation_length = 30.0, seed = 1 }"
FASTENERS = '[[effect]]\nkind = "fasteners"\npreload = 20.0\nfile = "points.csv"\n'
JOINT = SCENE.replace("mean = 0.1", RANDOM) + FASTENERS


@dataclass(frozen=True)
class Target:
    """keeps : the files that stay. checked : takes (folder, words, exit code, output), raises Fault."""

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


def files_in(folder: Path, where: str) -> tuple[str, ...]:
    """But for locks and pages."""
    found = [path for path in (folder / where).rglob("*") if path.suffix in OF_SUFFIX]
    return tuple(str(path.relative_to(folder)) for path in found)


def own_matrices() -> formats.Data:
    """K (7, 7), A (7, 4), f, g."""
    data = make_prepared(3, 3, tools=1)
    return matrices(data, make_load(3, data)[0])


def made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def scene(root: Path) -> Target:
    folder = made(root / "scene")
    (folder / "scene.toml").write_text(JOINT)
    (folder / "points.csv").write_text(POINTS)
    (folder / "gaps.csv").write_text("\n".join(",".join(["0.1"] * 12) for _ in range(3)) + "\n")
    series = ("series", "@scene.toml", "--threads", "1", "--check", "0", "--out", "@out")
    commands = (
        *[("validate", "@scene.toml")] * 6,
        ("solve", "@scene.toml", "--allow-gap", "0.1", "--out", "@out"),
        ("export", "@scene.toml", "--format", "npz", "--out", "@out.npz"),
        (*series, "--gaps", "@gaps.csv"),
        (*series, "--sweep", "initial_gap.mean=0.1:0.2:2"),
    )
    return Target("scene", 0.3, folder, ("scene.toml", "scene.toml", "points.csv", "gaps.csv"), commands)


def own_files(root: Path, form: str, suffix: str) -> Target:
    folder = made(root / form)
    name = "own" if suffix == ".mtx" else f"own{suffix}"
    formats.FORMATS[form].write(folder / name, own_matrices())
    files = [f"own/{name}.mtx" for name in "KAfg"] if suffix == ".mtx" else [name]
    commands = [("import", *(f"@{name}" for name in files), "--out", "@out.npz")] * 2
    if suffix == ".npz":
        more = ("import @own.npz --out @own.npz", "validate @own.npz", "solve @own.npz --out @out")
        commands += [tuple(words.split()) for words in (*more, "solve @own.npz --solver gi --out @out")]
    if form == "mtx":
        text = "".join(f'{name} = "own/{name}.mtx"\n' for name in "KAfg")
        (folder / "scene.toml").write_text(f"[matrices]\n{text}")
        files.append("scene.toml")
        commands += [("validate", "@scene.toml"), ("solve", "@scene.toml", "--out", "@out")]
    return Target(form, 0.06, folder, tuple(files), tuple(commands), checked=says_numbers)


def says_numbers(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
    if code in (0, 1) and ("nan" in output.lower() or "inf mm, proven" in output):
        raise Fault("wrong", output[-200:])


def cached(root: Path) -> Target:
    """Own matrices whose cache is damaged: the answer is what it was, or there is none."""
    folder = made(root / "cached")
    formats.FORMATS["npz"].write(folder / "own.npz", own_matrices())
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIVETBENCH_CACHE", str(folder / "cache"))
        assert invoke(folder, ("solve", "@own.npz", "--out", "@answer"))[0] == 0
    files = files_in(folder, "cache")

    def same_answer(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
        if code == 0 and words[0] == "solve":
            with np.load(folder / "out/solution.npz") as new, np.load(folder / "answer/solution.npz") as old:
                if abs(new["x"] - old["x"]).max() > 1e-14:
                    raise Fault("wrong", f"off by {abs(new['x'] - old['x']).max()}")

    def kept(name: str) -> bool:
        return not name.startswith(("out", "cache"))

    commands = (("solve", "@own.npz", "--out", "@out"), ("validate", "@own.npz"))
    return Target("cache", 0.08, folder, files, commands, kept, same_answer)


def results(root: Path) -> Target:
    """A finished run of two rows."""
    folder = root / "results"

    def answer(folder: Path, row: Row) -> Vector:
        with np.load(folder / "done" / row["answer"]) as saved:
            return np.array(saved["x"])

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIVETBENCH_CACHE", str(root / "cache"))
        suite = read_suite(str(tiny_joint.write_suite(folder, tolerances=[1e-6, 1e-8])))
        assert said_by(run, suite, folder / "done")[0] == 0
        assert invoke(folder, ("gate", "@done"))[0] == 0
    exact = {row["key"]: answer(folder, row) for row in rows_of(folder / "done")}
    suite_text = (folder / "done" / "suite.toml").read_bytes()

    def accurate(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
        """The gate passes only what is there, complete and right."""
        if code or words[0] != "gate":
            return
        rows = rows_of(folder / "done")
        path = folder / "done" / "suite.toml"
        same_suite = path.is_file() and path.read_bytes() == suite_text
        if not path.is_file():
            raise Fault("wrong", "passed, and nobody knows which rows there should be")
        if same_suite and {row["key"] for row in rows if row["gated"]} != set(exact):
            raise Fault("wrong", "passed without all rows")
        known = [row for row in rows if row["gated"] and row["key"] in exact]
        wrong = [r["key"] for r in known if not abs(answer(folder, r) - exact[r["key"]]).max() <= 2e-7]
        if wrong:
            raise Fault("wrong", f"passed {wrong}")

    names = files_in(folder, "done")
    baseline = ("gate", "@done", "--baseline", "@done", "--json", "@out.json", "--junit", "@out.xml")
    commands = (*[("gate", "@done")] * 6, *[baseline] * 2, ("report", "@done"))

    def kept(name: str) -> bool:
        return "report/" not in name and not name.startswith("out.")

    return Target("results", 0.18, folder, names, commands, kept, accurate)


def series(root: Path) -> Target:
    """A finished series of six cases."""
    folder = made(root / "series")
    (folder / "scene.toml").write_text(JOINT)
    (folder / "points.csv").write_text(POINTS)
    words = ("series", "@scene.toml", "--cases", "6", "--threads", "1", "--check", "0", "--out", "@done")
    assert invoke(folder, words)[0] == 0
    (folder / "done" / ".lock").unlink(missing_ok=True)
    names = ("done/series.sqlite", "scene.toml")
    commands = (("report", "@done"), words, (*words[:3], "9", *words[4:]), (*words, "--sd", "0.02"))
    return Target("series", 0.04, folder, names, commands, lambda name: not name.startswith("done/"))


def placed(root: Path) -> Target:
    """A finished search for a plan: what it says is what it said, whatever was done to what it kept."""
    folder = original = made(root / "placed")
    (folder / "scene.toml").write_text(JOINT)
    (folder / "points.csv").write_text(POINTS)
    (folder / "holes.csv").write_text(POINTS + "35.0,35.0\n")
    words = ("place", "@scene.toml", "--candidates", "@holes.csv", "--cases", "3", "--share", "1")
    words += ("--count", "2", "--out", "@done")
    code, said = invoke(folder, words)
    assert code == 0
    (folder / "done" / ".lock").unlink(missing_ok=True)

    def same_plan(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
        inputs = [folder / name for name in ("scene.toml", "points.csv", "holes.csv")]
        regular = code == 0 and all(path.is_file() for path in inputs)
        same = regular and all(path.read_bytes() == (original / path.name).read_bytes() for path in inputs)
        if same and output.splitlines()[-1] != said.splitlines()[-1]:
            raise Fault("wrong", output[-200:])

    names = ("done/plans.jsonl", "done/plans.jsonl", "done/place.json", "done/plan.toml")
    names += ("done/plan/series.sqlite", "holes.csv", "scene.toml")
    return Target(
        "placed", 0.05, folder, names, (words,), lambda name: not name.startswith("done/"), same_plan
    )


def superelements(root: Path) -> Target:
    """Two parts whose K are files, with the tables of their nodes."""
    folder, joint = made(root / "parts"), two_plates((5, 3))
    ends = zip(("a", "b"), stiffnesses(joint), ("op4", "mtx"), strict=True)
    parts = [write_part(folder, name, K, flat(joint.nodes), format=form) for name, K, form in ends]
    keys = ("name", "superelement", "nodes")
    text = "".join(
        "[[joint.part]]\n"
        + "".join(f'{key} = "{str(part[key]).replace(f"{folder}/", "")}"\n' for key in keys)
        for part in parts
    )
    (folder / "scene.toml").write_text(text + SCENE[SCENE.index("[[effect]]") :])
    files = ("scene.toml", "a.op4", "a.csv", "b/K.mtx", "b.csv")
    commands = (*[("validate", "@scene.toml")] * 2, ("solve", "@scene.toml", "--out", "@out"))
    return Target("parts", 0.08, folder, files, commands)


def suite(root: Path) -> Target:
    """Read and refused: no scene has that name."""
    folder = root / "suite"
    tiny_joint.write_suite(folder, tolerances=[1e-6, 1e-8], gated=False)
    command = ("run", "@small.toml", "--scene", "nowhere", "--out", "@out")
    return Target("suite", 0.08, folder, ("small.toml",), (command,))


def compared(root: Path) -> Target:
    """Two runs of a few rows, one of them damaged: what is compared adds up."""
    folder = root / "compared"
    rows = [
        row(f"20/{k}", "exact", repeat=r, scene_key="one", key=f"{k} {r}") for k in range(3) for r in (0, 1)
    ]
    for name in ("old", "new"):
        write_rows(folder / name, rows)

    def counted(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
        for total, kinds in re.findall(r"(\d+) measurements?: ([^.]*)\.", output):
            if int(total) != sum(map(int, re.findall(r"(\d+) (?:worse|better|of|new|alike)", kinds))):
                raise Fault("wrong", f"{total}: {kinds}")

    commands = ("@old @new", "@new @old --out @out", "@new@1234 @old", "@old @new --key 0 0")
    asked = tuple(("compare", *words.split(maxsplit=3)) for words in commands)
    return Target("compared", 0.05, folder, ("new/measurements.jsonl",), asked, checked=counted)


def judged(root: Path) -> Target:
    """An exact answer in each kind of file."""
    folder = made(root / "judged")
    formats.FORMATS["npz"].write(folder / "own.npz", own_matrices())
    data = make_prepared(3, 3, tools=1)
    x, lam = solve_by_nnls(data, make_load(3, data)[0])
    np.save(folder / "x.npy", x)
    np.savez(folder / "xs.npz", x=x, lam=lam)
    np.savetxt(folder / "x.txt", x)
    scipy.io.mmwrite(folder / "x.mtx", x[:, None], precision=17)
    np.savetxt(folder / "x.csv", x, header="x", comments="")
    files = ("x.npy", "xs.npz", "x.txt", "x.mtx", "x.csv")
    commands = tuple(("judge", f"@{name}", "@own.npz") for name in files)
    return Target("judged", 0.05, folder, files, commands, checked=says_numbers)


MAKERS = (scene, cached, results, series, placed, superelements, suite, compared, judged)


def all_targets(root: Path) -> list[Target]:
    """Series and plans have no reports, which no command reads."""
    forms = {"npz": ".npz", "mtx": ".mtx", "abaqus": ".mtx", "op4": ".op4", "dmig": ".pch"}
    with pytest.MonkeyPatch.context() as patch:
        for writer in ("series_report", "place_report"):
            patch.setattr(f"report.writers.{writer}.write", lambda directory: directory)
        made = [make(root) for make in MAKERS]
    return [*made, *(own_files(root, form, suffix) for form, suffix in forms.items())]
