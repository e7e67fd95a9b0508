"""How far a key may go: bisection against whole grids, its interval, resumption, and what is refused."""

import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from io import StringIO
from math import inf
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pandas as pd
import pytest
from clopper_pearson import interval_of
from commands import harness, onto, wrong_usage
from refusals import refusal_of
from strip_scene import write_strip

from harness.commands import limit_search
from harness.commands.limit_search import searched
from harness.results import series_file
from harness.scene.allowed_gap import share_interval
from harness.series.load_case_source import GapCases
from harness.series.session import Job, SeriesSession
from problems.load_cases import Listed
from problems.load_cases.sweep import keys_of
from problems.model.scene import JointScene
from problems.scene_files import read_scene
from rivetbench import run_series, tolerance

SD, FORCE = "initial_gap.random.sd", "fasteners.preload"
LIMIT, CASES = 0.5, 12
GRID = ("--allow-gap", LIMIT, "--cases", CASES, "--share", 0.7)


def counts(path: Path, key: str, values: Sequence[float]) -> list[int]:
    """In how many cases each value keeps the limit, all of them solved in one series."""
    scene, loads = read_scene(str(path)), []
    assert isinstance(scene, JointScene)
    one = keys_of(scene)[key]
    for value in values:
        effects = list(scene.effects)
        effects[one.effect] = one.changed(effects[one.effect], value, scene.joint)
        cases = GapCases(count=CASES).of(replace(scene, effects=tuple(effects)), "dual")
        loads += [cases.load(k) for k in range(CASES)]
    job = Job(scene=scene, cases=Listed(tuple(loads)), form="dual", check=0, threads=1)
    rows = [row for some in SeriesSession(job).solve(range(len(loads))) for row, _ in some]
    gaps = np.array([row["max_gap_mm"] for row in sorted(rows, key=lambda row: row["case"])])
    return (gaps.reshape(len(values), CASES) <= LIMIT).sum(axis=1).tolist()


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize(("key", "low", "high", "size"), [(SD, 0.02, 0.5, 8), (FORCE, 1.0, 600.0, 7)])
def test_the_value_is_that_of_a_grid(tmp_path: Path, key: str, low: float, high: float, size: int) -> None:
    """The largest scatter by one command, the least force by the other."""
    path, out, least = write_strip(tmp_path), tmp_path / "out", 9
    words = ("series", path, "--find", f"{key}={low}:{high}", "--check", 0)
    if key == SD:
        words = ("tolerance", path, "--key", key, "--range", f"{low}:{high}")
    words += (*GRID, "--resolution", 1 / (size - 1), "--out", out)
    done = harness(*words)
    assert done.exit_code == 0, done.output
    values = [float(f"{value:.10g}") for value in np.linspace(low, high, size)]
    kept = np.array(counts(path, key, values))
    keeps = kept >= least
    assert (np.diff(keeps.astype(int)) != 0).sum() == 1  # one limit on the whole grid
    best = values[np.flatnonzero(keeps)[-1 if key == SD else 0]]
    answer = json.loads((out / "tolerance.json").read_text())
    assert answer["value"] == best
    assert f"The {'largest' if key == SD else 'least'} {key} that keeps 0.5 mm in 70 %" in done.output
    assert "of 12 fresh cases, proven" in " ".join(done.output.split())
    assert (out / f"{best:.10g}-fresh" / "report" / "report.md").exists()
    fresh = series_file.read_facts(out / f"{best:.10g}-fresh")
    chosen = series_file.read_facts(out / f"{best:.10g}")
    assert fresh
    assert chosen
    assert fresh["identity"]["cases_key"] != chosen["identity"]["cases_key"]
    rows = {folder.name: [*series_file.rows(folder)] for folder in out.iterdir() if folder.is_dir()}
    if key == FORCE:  # it goes on where it stopped
        shutil.rmtree(out / f"{high:g}")
        assert harness(*words).exit_code == 0
        assert json.loads((out / "tolerance.json").read_text()) == answer
        for name, old in rows.items():
            assert ([*series_file.rows(out / name)] == old) == (name != f"{high:g}")
    else:
        bounds = [interval_of(k, CASES)[0] for k in kept.tolist()]
        sure = [value for value, bound in zip(values, bounds, strict=True) if bound >= 0.7]
        assert answer["interval"][0] == max(sure)


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize(("limit", "code", "said"), [(1e-3, 4, "Neither end keeps"), (9.0, 0, "Both ends")])
def test_the_ends_must_differ(tmp_path: Path, limit: float, code: int, said: str) -> None:
    words = "--key", SD, "--range", "0.1:0.2", "--allow-gap", limit, "--cases", 3
    done = harness("tolerance", write_strip(tmp_path), *words, "--out", tmp_path / "out")
    assert done.exit_code == code
    assert said in done.output
    assert json.loads((tmp_path / "out" / "tolerance.json").read_text())["value"] is None


def test_the_name_of_a_scene_is_no_markup(tmp_path: Path) -> None:
    """Neither in the report nor in its picture, where it is no mathematics."""
    path = write_strip(tmp_path).rename(tmp_path / "a$x_$ *b*.toml")
    words = "--key", SD, "--range", "0.1:0.2", "--allow-gap", 9.0, "--cases", 3
    assert harness("tolerance", path, *words, "--out", tmp_path / "out").exit_code == 0
    report = (tmp_path / "out" / "report.md").read_text("utf-8")
    assert report.startswith(f"# {SD} in a\\$x\\_\\$ \\*b\\*\n")


@pytest.mark.usefixtures("without_pictures")
def test_a_key_may_change_the_stiffness(tmp_path: Path) -> None:
    """Its series is that of a scene with the value."""
    cases = GapCases(count=3)
    both_keep = tolerance(write_strip(tmp_path), tmp_path / "out", "ribs.I=2:9000", 9.0, 0.5, 1.0, cases)
    assert both_keep.value is None
    path = write_strip(tmp_path, ("I = 2e3", "I = 9000"))
    run_series(path, tmp_path / "one", cases, report=False)
    both = [
        [row["max_gap_mm"] for row in series_file.rows(folder)]
        for folder in (tmp_path / "one", tmp_path / "out" / "9000", tmp_path / "out" / "2")
    ]
    np.testing.assert_allclose(both[0], both[1], rtol=0, atol=1e-9)
    assert max(abs(np.subtract(both[0], both[2]))) > 1e-3


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--find", "initial_gap.mean=0.5:0.1"), "LOW < HIGH"),
        (("--find", "shims.thickness=0.1:1"), "KEY one of initial_gap.mean"),
        (("--find", f"{SD}=0.1:0.4", "--sd", 0.1), "no option in its place"),
        (("--find", f"{SD}=0.1:0.4", "--resolution", 2), "a resolution from"),
        (("--find", f"{SD}=0.1:0.4", "--sweep", "initial_gap.mean=1,2"), "without --sweep"),
        (("--share", 0.5), "KEY=LOW:HIGH"),
        (("--find", ""), "KEY=LOW:HIGH"),
        (("--find", f"{FORCE}=-1:5"), "must be greater than 0"),
    ],
)
def test_bad_questions_are_refused(tmp_path: Path, words: tuple[object, ...], said: str) -> None:
    common = "--allow-gap", LIMIT, "--cases", 2, "--check", 0, "--out", tmp_path / "out"
    assert said in wrong_usage("series", write_strip(tmp_path), *words, *common)


def test_a_range_is_checked_before_its_first_end_is_solved(tmp_path: Path) -> None:
    words = "--key", FORCE, "--range", "1:1e16", "--allow-gap", LIMIT, "--cases", 2, "--out", tmp_path / "out"
    told = wrong_usage("tolerance", write_strip(tmp_path), *words)
    assert f"--find {FORCE}: {FORCE} = 1e+16: must be less than" in told
    assert not (tmp_path / "out").exists()


def test_a_directory_holds_the_series_of_one_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From its first series on."""
    path, out = write_strip(tmp_path), tmp_path / "out"
    monkeypatch.setattr(limit_search, "run_series", Mock(side_effect=MemoryError))
    with pytest.raises(MemoryError):
        tolerance(path, out, f"{FORCE} = 1:600", LIMIT)
    told = refusal_of(tolerance, path, out, f"{SD}=0.1:0.2", LIMIT)
    expected = [(str(out / "tolerance.json"), "key", FORCE)]
    assert [(fault.where, fault.key, fault.value) for fault in told.faults] == expected


#: The figures of a case, by the value, whether the cases are fresh, and its number.
Figures = Callable[[float, bool, int], dict[str, float]]


def known(gap: float) -> dict[str, float]:
    return {"max_gap_mm": gap, "gap_error_mm": 0.0}


@pytest.fixture
def made_up(monkeypatch: pytest.MonkeyPatch, without_pictures: None) -> Callable[[int, Figures], None]:
    """Lets each series have so many cases, with made-up figures."""

    def make_up(count: int, figures: Figures) -> None:
        def rows(folder: Path) -> list[dict[str, float]]:
            value, fresh = float(folder.name.removesuffix("-fresh")), folder.name.endswith("-fresh")
            return [{"case": k} | figures(value, fresh, k) for k in range(count)]

        monkeypatch.setattr(limit_search, "run_series", lambda *_, **__: None)
        monkeypatch.setattr(series_file, "read_facts", lambda _: {"cases": count})
        monkeypatch.setattr(series_file, "rows", rows)

    return make_up


def test_bisection_finds_the_limit_and_its_interval() -> None:
    """On drawn shares that change one way, rising and falling, of 2 to 60 values and 1 to 300 cases."""
    random = np.random.default_rng(5)
    for _ in range(20):
        size, count, share = random.integers(2, 61), int(random.integers(1, 301)), random.uniform(0.3, 1.0)
        values = np.cumsum(random.uniform(0.1, 1.0, size)).tolist()
        kept = np.sort(random.integers(0, count + 1, size))[:: random.choice([-1, 1])]
        by_value = dict(zip(values, kept.tolist(), strict=True))
        asked: list[float] = []
        outcome = searched(lambda v, a=asked, b=by_value: a.append(v) or (b[v], b[v]), values, share, count)
        keeps, intervals = kept >= share * count, [share_interval(int(k), count) for k in kept]
        if keeps[0] == keeps[-1]:
            assert outcome.value is None
            assert outcome.passed == keeps[0]
            continue
        falling = keeps[0]
        inside = np.array(values)[keeps]
        assert outcome.value == (inside.max() if falling else inside.min())
        sure = [v for v, (low, _) in zip(values, intervals, strict=True) if low >= share]
        impossible = [v for v, (_, high) in zip(values, intervals, strict=True) if high < share]
        ends = (sure, impossible) if falling else (impossible, sure)
        assert outcome.interval == (max(ends[0], default=-inf), min(ends[1], default=inf))
        assert len(set(asked)) <= 2 + 3 * np.ceil(np.log2(size + 1))


def test_a_value_that_fresh_cases_contradict_moves(
    made_up: Callable[[int, Figures], None], tmp_path: Path
) -> None:
    """Half-way to the end of its interval where the share is surely kept, until they do not."""
    count = 100
    made_up(count, lambda value, fresh, k: known(float(k < count * value * (1.5 if fresh else 1.0))))
    found = tolerance(write_strip(tmp_path), tmp_path / "out", f"{SD}=0.01:0.61", 0.5, 0.7, 1 / 60)
    ends = np.array([interval_of(kept, count) for kept in range(count + 1)])
    sure, possible = (ends >= 0.7).argmax(axis=0)  # the fewest cases that do not exclude the share
    assert found.interval == pytest.approx((1 - sure / count, 1 - (possible - 1) / count))
    assert [text.split()[1] for text in found.sentences[1:]] == ["0.3", "0.25"]
    assert (found.value, found.passed) == (0.25, True)
    table = pd.read_csv(tmp_path / "out/shares.csv")
    assert table[table["fresh"]]["kept"].tolist() == [62, 55]
    np.testing.assert_allclose(table[["low", "high"]], ends[table["kept"]], rtol=1e-9)
    assert "](shares.png)" in (tmp_path / "out/report.md").read_text()


def test_cases_without_an_answer_are_counted(made_up: Callable[[int, Figures], None], tmp_path: Path) -> None:
    """In each line, in the outcome and in the table; they keep no limit, and are not known to exceed it."""
    made_up(10, lambda value, _, k: known(k * value) if k else {})
    said = StringIO()
    asked = f"{SD}=0.1:0.5", 1.0, 0.5, 0.5
    found = tolerance(write_strip(tmp_path), tmp_path / "out", *asked, reporter=onto(said))
    assert f"{SD} = 0.1: within 1 mm in 9 of 10 cases, 1 without an answer." in said.getvalue()
    assert found.value == 0.1
    assert found.sentences[1] == "Without an answer, and not counted as kept: 4 of 40 cases over all values."
    table = pd.read_csv(tmp_path / "out/shares.csv")
    assert table["no_answer"].tolist() == [1] * 4
    low, high = table.loc[table["kept"] == 9, ["low", "high"]].to_numpy().T
    np.testing.assert_allclose((low, high), (low * 0 + interval_of(9, 10)[0], low * 0 + 1.0), rtol=1e-9)


@pytest.mark.parametrize("figures", [{}, {"max_gap_mm": 0.5}], ids=["no answer", "no error known"])
def test_where_nothing_is_known_at_both_ends_nothing_is_judged(
    made_up: Callable[[int, Figures], None], tmp_path: Path, figures: dict[str, float]
) -> None:
    """The key is not to blame."""
    made_up(2, lambda *_: figures)
    words = "--key", SD, "--range", "0.1:0.2", "--allow-gap", 1.0, "--cases", 2
    done = harness("tolerance", write_strip(tmp_path), *words, "--out", tmp_path / "out")
    assert done.exit_code == 3
    assert "cannot be judged: of 2 and 2 cases it is not known" in " ".join(done.output.split())


@pytest.mark.parametrize(("kept", "passed"), [(6, True), (4, None)])
def test_fresh_cases_that_are_not_known_decide_nothing(
    made_up: Callable[[int, Figures], None], tmp_path: Path, kept: int, passed: bool | None
) -> None:
    """Of 20 fresh cases 6 are known to keep it, or 4 with the rest unknown: 6 reach a share of a half."""
    assert share_interval(6, 20)[1] >= 0.5 > share_interval(4, 20)[1]
    only_gap = {"max_gap_mm": 0.1}
    made_up(20, lambda value, new, k: only_gap if new and k >= kept else known(0.1 if new else value))
    found = tolerance(write_strip(tmp_path), tmp_path / "out", f"{SD}=0.1:0.5", 0.3, 0.5, 0.5)
    assert (found.value, found.passed) == (0.3, passed)
    assert ("cannot be judged" in found.sentences[-1]) == (passed is None)
