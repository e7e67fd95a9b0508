"""What a hostile user writes into files and options: one clear message, soon, and no traceback."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from commands import harness, wrong_usage
from refusals import refusal_of
from small_joints import SCENE

from harness.planning.suite import read_suite
from problems.errors import InputError
from problems.load_cases.sweep import sweep
from problems.scene_files import read_scene


def scene_file(folder: Path, *replaced: tuple[str, str]) -> Path:
    """scene.toml, some of its text replaced."""
    text = SCENE
    for old, new in replaced:
        assert old in text
        text = text.replace(old, new)
    (folder / "scene.toml").write_text(text)
    return folder / "scene.toml"


def words_of(path: Path) -> str:
    return str(refusal_of(read_scene, str(path)))


PRESSURE = 'kind = "pressure"\npart = "a"\nvalue = 1e-3'
STRINGERS = 'kind = "stringers"\npart = "a"\npitch = 1e-9\nstart = 0\nstop = 9\nI = 1'
FASTENERS = 'kind = "fasteners"\npreload = 1.0\n'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("elements = 2", "elements = 1000000000", "less than or equal to 100000"),
        ("nodes = [4, 3]", "nodes = [4, 99999999]", "less than or equal to 100000"),
        ("nodes = [4, 3]", "nodes = [40000, 30000]", "at most 10000000 nodes"),
        (PRESSURE, STRINGERS, "at least 0.0"),
        ("thickness = 2.0", "thickness = 1e200", "less than or equal to 1"),
        ("thickness = 2.0", "thickness = inf", "part.0.thickness"),
        ("value = 1e-3", "value = -1e300", "greater than or equal to -1"),
        ("mean = 0.1", "mean = nan", "initial_gap"),
        ("mean = 0.1", f"mean = {'1' * 5000}", "TOML"),
        ("mean = 0.1", f"mean = {'[' * 100_000}", "TOML"),
        ("mean = 0.1", "mean = 2020-01-01", "initial_gap"),
        ('name = "a"', f'name = "{"a" * 20_000}"', "at most 60"),
        ('name = "a"', 'name = "a\\nb"', "pattern"),
        (
            PRESSURE,
            f"{FASTENERS}pattern = {{ columns = 100000, rows = 100000 }}",
            "less than or equal to 10000",
        ),
    ],
)
def test_what_no_structure_has_is_refused_with_the_key(old: str, new: str, said: str, tmp_path: Path) -> None:
    assert said in words_of(scene_file(tmp_path, (old, new)))


POSITIVE = "positive and finite"
NOT_ASKED_FOR = "--solver: name = 'newton': mine, that of --plugin"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        *((f"series SCENE --tolerance {value}", POSITIVE) for value in ("inf", "nan", "-1", "0")),
        ("series SCENE --limit nan", POSITIVE),
        ("solve SCENE --tolerance nan", POSITIVE),
        ("check --time-limit nan", "--time-limit"),
        ("solve SCENE --reference-limit nan", "--reference-limit"),
        ("series SCENE --cases 1000000000000", "--cases"),
        ("solve SCENE --tolerance 1e-6", "--tolerance: tolerance = 1e-06: needs --solver"),
        ("export SCENE --form dual --reference-limit 5", "--reference-limit: seconds = 5.0: needs"),
        ("gate DIR --margin 2", "--margin: factor = 2.0: needs --baseline"),
        ("series SCENE --plugin PLUGIN", NOT_ASKED_FOR),
        ("run gate --solver newton --plugin PLUGIN", NOT_ASKED_FOR),
        ("check --solver newton --plugin PLUGIN", NOT_ASKED_FOR),
    ],
)
def test_an_option_that_is_not_bounded_or_without_effect_is_refused(
    words: str, said: str, tmp_path: Path
) -> None:
    """It is without effect if what it is for is not asked."""
    mine = tmp_path / "mine.py"
    mine.write_text("raise SystemExit\n")
    places: dict[str, object] = {"SCENE": scene_file(tmp_path), "DIR": tmp_path, "PLUGIN": mine}
    command, *others = words.split()
    out = () if command in ("gate", "check") else ("--out", tmp_path / "out")
    assert said in wrong_usage(command, *(places.get(word, word) for word in others), *out)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("line", "of_solver"),
    [
        *(
            ("times_best_form = nan", ""),
            ("limit_mm = inf", ""),
            ("tolerances = [nan]", ""),
            ("repeats = 100000000000", ""),
        ),
        *(("time_limit_s = inf", ""), ('name = "../../x"', ""), ('name = "a\\u0000b"', "")),
        *(("", 'variant = "a\\u0000"'), ("", "options = { nested = 2020-01-01 }")),
        ('scenes = ["a\\u0000b.toml"]', ""),
    ],
)
def test_a_suite_is_bounded(line: str, of_solver: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    scenes = "" if "scenes" in line else 'scenes = ["4386/0107"]'
    path.write_text(f'{line}\n{scenes}\n[[solver]]\nname = "newton"\n{of_solver}\n')
    said = str(refusal_of(read_suite, str(path)))
    assert (line or of_solver).partition(" ")[0] in said
    assert ".toml" not in line or "without NUL" in said


@pytest.mark.parametrize("values", ["0.1:1.0:1000000000", "0:1:11000", "1:2:-3", "1:2:1e9"])
def test_sweeps_are_bounded(values: str, tmp_path: Path) -> None:
    texts = [f"initial_gap.mean={values}", "pressure.value=1:2:1000"]
    with pytest.raises(InputError, match=r"at most|FIRST:LAST:COUNT"):
        sweep(read_scene(str(scene_file(tmp_path))), texts)


MAKE: dict[str, Callable[[Path], object]] = {
    "loop": lambda path: path.symlink_to(path.name),
    "pipe": os.mkfifo,
    "device": lambda path: path.symlink_to("/dev/zero"),
}


@pytest.mark.parametrize("kind", MAKE)
def test_what_is_no_regular_file_is_not_read(kind: str, tmp_path: Path) -> None:
    """Nor written to, if it is a loop of links."""
    tables = [f"gaps.{suffix}" for suffix in ("csv", "npz", "npy")]
    for name in ("scene.toml", "own.npz", "points.csv", *tables):
        MAKE[kind](tmp_path / name)
    fastened = SCENE.replace(PRESSURE, f'{FASTENERS}file = "points.csv"')
    (tmp_path / "good.toml").write_text(SCENE)
    (tmp_path / "fastened.toml").write_text(fastened)
    (tmp_path / "suite.toml").write_text('plugin = "mine.py"\nscenes = ["scene.toml"]\n')
    commands = [
        *("validate scene.toml", "validate own.npz", "validate fastened.toml", "run gate --scene scene.toml"),
        *("solve scene.toml --out new.d", "series scene.toml --out new.d"),
        *(f"series good.toml --gaps {table} --out new.d" for table in tables),
    ]
    if kind == "loop":
        for name in ("mine.py", "out.npz", "loop.d"):
            MAKE[kind](tmp_path / name)
        commands += ["run suite.toml", "run gate --plugin mine.py", "report loop.d", "gate loop.d"]
        commands += ["series good.toml --out loop.d", "export good.toml --format npz --out out.npz/file.npz"]
    for words in commands:
        done = harness(*(str(tmp_path / word) if "." in word else word for word in words.split()))
        assert done.exit_code == 2, words
        assert done.output.strip()
        if "gaps" in words:
            assert "a readable file" in done.output


def test_a_large_file_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate(11 * 2**20)
    assert "at most 10 MiB" in words_of(tmp_path / "large.toml")


@pytest.mark.parametrize("form", ["dual", "sparse"])
def test_loads_whose_displacements_overflow_are_refused(form: str, tmp_path: Path) -> None:
    K, A = 1e-3 * np.array([[2.0, 1.0], [1.0, 2.0]]), np.ones((2, 1))  # x = ±inf, p = inf − inf
    np.savez(tmp_path / "own.npz", K=K, A=A, g=np.ones(1), f=np.full(2, 1.7e308))
    given = ["solve", str(tmp_path / "own.npz"), "--form", form, "--out", str(tmp_path / "out")]
    assert "largest |f| = 1.7e+308: loads with finite displacements" in wrong_usage(*given)
    assert not (tmp_path / "out").exists()
