"""The report on ladders, from made-up rows: right or wrong, and whether the solver knew."""

import json
import re
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from matplotlib.image import imread
from synthetic_results import no_answer, results, write_rows
from synthetic_results import row as any_row

from report.sections.ladders import (
    CORRECT,
    CORRECT_UNCLAIMED,
    NO_ANSWER,
    UNJUDGED,
    WRONG_CLAIMED,
    WRONG_UNCLAIMED,
    claims,
    rungs_in_order,
    section,
    with_outcomes,
)
from report.writers.suite_report import write

EASY, MIDDLE, HARD, ODD = "hard/steep/1e1", "hard/steep/1e5", "hard/steep/1e9", "hard/odd/one"
WRONG = {"verdict": "outside", "displacement_error_mm": 3e-3, "limit_mm": 1e-6}


def row(scene: str, solver: str, **figures: Any) -> dict[str, Any]:
    size = {"n": 128, "m": 64, "active": 20, "backward_error": 1e-12, "limit_asked_mm": 1e-7}
    return any_row("4386/0052", solver) | size | {"scene": scene, "threads": 1} | figures


ROWS = [
    *(row(scene, "ipm") for scene in (EASY, MIDDLE, HARD, ODD)),
    row(EASY, "a"),
    row(MIDDLE, "a", **WRONG, status="inaccurate"),
    row(HARD, "a", **WRONG),
    row(ODD, "a", **no_answer("crashed")),
    row(EASY, "b", status="inaccurate"),
    row(MIDDLE, "b"),
    row(HARD, "b", **WRONG),
    row(ODD, "b", verdict="cannot_be_judged"),
    row(ODD, "b", form="primal", **no_answer("unsupported")),
]


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of `ROWS`, written once."""
    folder = write_rows(tmp_path_factory.mktemp("ladders"), ROWS)
    known = {"n": 128, "m": 64, "active": 20, "reference_bound_mm": 0.0, "reference_route": "chosen, exact"}
    problems = [
        {"scene": scene, "title": "made up", "cond_K": cond, **known}
        for scene, cond in ((EASY, 1e1), (MIDDLE, 1e5), (HARD, 1e13), (ODD, 1e3))
    ]
    problems.append({"scene": "hard/odd/loose", "title": "held by nothing", "refused": "K must be definite"})
    (folder / "problems.jsonl").write_text("".join(json.dumps(p) + "\n" for p in problems), "utf-8")
    scenes = [ODD, "hard/odd/loose", EASY, MIDDLE, HARD]
    lines = "".join(f'[[solver]]\nname = "{name}"\nforms = ["dual"]\n' for name in ("ipm", "a", "b"))
    (folder / "suite.toml").write_text(f"name = 'made-up'\nscenes = {json.dumps(scenes)}\n{lines}", "utf-8")
    return write(folder)


def test_the_worst_answer_is_counted_and_named(report: Path) -> None:
    table = pd.read_csv(report.parent / "honesty.csv").set_index("label")
    names = [CORRECT, CORRECT_UNCLAIMED, WRONG_UNCLAIMED, WRONG_CLAIMED, NO_ANSWER, UNJUDGED]
    assert table[names].T.to_dict("list") == {
        "ipm (dual)": [4, 0, 0, 0, 0, 0],
        "a (dual)": [1, 0, 1, 1, 1, 0],
        "b (dual)": [1, 1, 0, 1, 0, 1],
    }
    assert table["rungs"].tolist() == [4, 4, 4]
    assert table["where"].fillna("").tolist() == ["", "steep/1e9", "steep/1e9"]
    assert table.loc["a (dual)", "worst_share"] == pytest.approx(3e3)
    assert table.loc["ipm (dual)", "worst_share"] == pytest.approx(1e-2)


def test_wrong_answers_reported_as_solved_are_counted_apart(report: Path, tmp_path: Path) -> None:
    text = report.read_text("utf-8")
    assert "solved: none of 4 rows of our solvers, 2 of 8 rows of libraries." in text
    rows = [r | (WRONG if r["solver"] == "ipm" and r["scene"] == EASY else {}) for r in ROWS]
    assert "solved: 1 of 4 rows of our" in claims(with_outcomes(results(tmp_path, rows).cells))


def test_what_the_model_refuses_is_listed_and_not_awaited(report: Path) -> None:
    text = report.read_text("utf-8")
    assert re.search(r"\| hard/odd/loose +\| held by nothing +\| K must be definite +\|", text)
    assert "not finished" not in text


@pytest.mark.usefixtures("without_pictures")
def test_rungs_and_scenes_are_reported_apart(report: Path, tmp_path: Path) -> None:
    text = report.read_text("utf-8")
    assert re.findall("^## (.*)", text, re.M) == [
        "Where each solver fails, and whether it reports it",
        "The rungs",
        "Machine and method",
    ]
    assert imread(report.parent / "ladders.png")[..., :3].std() > 0.05
    both = write(write_rows(tmp_path, [*ROWS, any_row("4386/0052", "ipm")])).read_text("utf-8")
    assert "## Summary" in both
    assert "hard/steep" not in both[both.index("## Summary") : both.index("## Machine")]


def test_rungs_that_the_suite_does_not_list_come_as_they_were_measured(tmp_path: Path) -> None:
    found = results(tmp_path, [row(HARD, "ipm"), row(EASY, "ipm")])
    assert rungs_in_order(found, found.cells) == {"steep": ["1e9", "1e1"]}


def test_a_scene_without_the_name_of_a_rung_is_drawn(tmp_path: Path) -> None:
    """As of another version's ladder: alone, it leaves no text below its column."""
    assert section(results(tmp_path, [row("hard/x", "a")])) is not None
