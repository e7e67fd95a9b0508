"""The section on scenes drawn at random: every time, the worst cases, the failures, the looser tolerances."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic_results import no_answer, results, row, shown, table, write_rows

from report.document.blocks import Figure, Section
from report.figures import style
from report.figures.line_charts import against_contacts, styles_of
from report.sections import random_scenes as drawn_scenes
from report.writers.suite_report import write

pytestmark = pytest.mark.usefixtures("without_pictures")
SECONDS = {
    **{("newton", "dual"): 0.05, ("mprgp", "dual"): 0.1},
    **{("newton", "sparse"): 0.3, ("mprgp", "sparse"): 0.4},
}
SCENES = 5


def drawn(k: int, solver: str, form: str, n: int = 4386, **figures: Any) -> dict[str, Any]:
    """A row of scene k; it takes (1 + k/10) times as long as that of scene 0."""
    usual = {
        **{"active": 400 * k + 50, "owner": "ours", "tolerance": 1e-10, "threads": 1, "threads_asked": 1},
        **{"setup_s": 0.0, "solve_s": SECONDS[solver, form] * (1 + k / 10)},
    }
    return row(f"{n}/0001", solver, form, **usual | figures) | {"scene": f"drawn/{n}/{k}"}


def every_row() -> list[dict[str, Any]]:
    return [drawn(k, *line) for k in range(SCENES) for line in SECONDS]


def section_of(directory: Path, rows: list[dict[str, Any]]) -> Section:
    section = drawn_scenes.section(results(directory, rows).about("drawn"))
    assert section is not None
    return section


def test_medians_and_worst_cases(tmp_path: Path) -> None:
    """A cliff is the worst case, however rare."""
    rows = [*every_row(), drawn(5, "newton", "dual", solve_s=7.9), drawn(6, "newton", "dual", solve_s=1.5)]
    section = section_of(tmp_path, rows)
    assert [getattr(block, "name", "") for block in section.blocks] == ["drawn", "drawn"]
    cells = {line[1]: [line[0], *line[2:]] for line in shown(table(section, "drawn"))[1:]}
    assert cells == {
        "newton (sparse)": ["4386", "5", "5", "0.360", "0.420", "1.17", "drawn/4386/4"],
        "newton (dual)": ["4386", "7", "7", "0.0650", "7.90", "122", "drawn/4386/5"],
        "mprgp (sparse)": ["4386", "5", "5", "0.480", "0.560", "1.17", "drawn/4386/4"],
        "mprgp (dual)": ["4386", "5", "5", "0.120", "0.140", "1.17", "drawn/4386/4"],
    }


def test_load_cases_of_a_series_are_told_elsewhere(tmp_path: Path) -> None:
    assert drawn_scenes.section(results(tmp_path, [each | {"case": 0} for each in every_row()])) is None


@pytest.mark.parametrize("methods", [1, 2])
def test_the_picture_is_of_what_was_run_on_half_of_the_scenes(tmp_path: Path, methods: int) -> None:
    """Where that is one method only, of all that was run."""
    often = [line for k in range(SCENES) for line in every_row()[4 * k : 4 * k + methods]]
    (figure, _) = section_of(tmp_path, [*often, drawn(0, "newton", "sparse")]).blocks[:2]
    assert isinstance(figure, Figure)
    names = [text.get_text() for text in figure.drawing.legends[0].get_texts()]
    assert len(names) == 2
    assert ("at least half" in figure.caption) == (methods == 2)
    assert ("newton (sparse)" in names) == (methods == 1)


@pytest.mark.parametrize(
    "failure",
    [
        *(no_answer("time_limit"), no_answer("crashed"), no_answer("not_run"), {"status": "inaccurate"}),
        *({"verdict": "outside", "displacement_error_mm": 3e-6}, {"verdict": "cannot_be_judged"}),
    ],
    ids=lambda failure: failure.get("status", failure.get("verdict")),
)
def test_a_failure_is_counted_shown_and_never_fast(tmp_path: Path, failure: dict[str, Any]) -> None:
    fast = {"solve_s": 1e-9} | failure
    rows = [row for row in every_row() if row["scene"] != "drawn/4386/2"]
    rows += [drawn(2, *line) | (fast if line[1] == "dual" else {}) for line in SECONDS]
    section = section_of(tmp_path, rows)
    found = table(section, "drawn").data.set_index("method")
    assert found["scenes"].to_list() == [5] * 4
    assert found["within"].to_dict() == {f"{s} ({f})": 4 if f == "dual" else 5 for s, f in SECONDS}
    failed = table(section, "drawn-failures").data[["scene", "method"]]
    assert failed.to_numpy().tolist() == [
        ["drawn/4386/2", f"{solver} (dual)"] for solver in ("mprgp", "newton")
    ]


def test_other_tolerances_enter_no_figure(tmp_path: Path) -> None:
    rows = every_row()
    for k, factor in ((0, 0.5), (1, 0.7), (2, 3.0)):
        seconds = factor * SECONDS["newton", "dual"] * (1 + k / 10)
        rows.append(drawn(k, "newton", "dual", tolerance=1e-2, solve_s=seconds, verdict="outside"))
    rows.append(drawn(0, "newton", "dual", tolerance=1e-12) | no_answer("failed"))
    section = section_of(tmp_path, rows)
    assert table(section, "drawn").data["scenes"].to_list() == [5] * 4
    assert not any(getattr(block, "name", "") == "drawn-failures" for block in section.blocks)


def test_the_report_keeps_many_drawn_scenes_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("report.results.reader.MOST_SHOWN", SCENES + 1)
    rows = [*every_row(), row("4386/0107", "newton"), row("4386/0107", "piqp")]
    rows += [drawn(k, "newton", "sparse", n=6112) for k in range(2)]
    page = write(write_rows(tmp_path, rows)).read_text("utf-8")
    assert "## Scenes drawn at random" in page
    assert "**Scene 4386/0107**" in page
    assert "**Scene drawn/" not in page
    assert (tmp_path / "report" / "drawn.png").is_file()
    assert pd.read_csv(tmp_path / "report" / "drawn.csv")["n"].to_list() == [4386] * 4 + [6112]


def test_a_series_on_many_drawn_scenes_is_in_the_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("report.results.reader.MOST_SHOWN", SCENES - 1)
    rows = [drawn(k, "newton", "dual", case=case, warm=case > 0) for k in range(SCENES) for case in range(2)]
    page = write(write_rows(tmp_path, rows)).read_text("utf-8")
    assert "## Series of load cases" in page
    assert len(pd.read_csv(tmp_path / "report" / "series.csv")) == SCENES


def test_nothing_but_failures_is_a_section_too(tmp_path: Path) -> None:
    rows = [row | no_answer("not_run") for row in every_row()]
    write(write_rows(tmp_path, [*rows, every_row()[0] | {"n": None, "scene": "drawn/"}]))
    assert pd.read_csv(tmp_path / "report" / "drawn.csv")["within"].to_list() == [0] * 4
    assert len(pd.read_csv(tmp_path / "report" / "drawn-failures.csv")) == 4 * SCENES


def superelements(k: int, solver: str, prepare_s: float, solve_s: float, **figures: Any) -> dict[str, Any]:
    usual = {"convert_s": 0.0, "prepare_s": prepare_s, "solve_s": solve_s, "form_s": 0.0}
    other = {"solver": solver, "scene": f"drawn/superelements/{k}"}
    return drawn(k, "newton", "dual", n=900 + k, **usual | figures) | other


def test_superelements_are_compared_with_the_textbook_with_preparation(tmp_path: Path) -> None:
    """A scene that it misses gives no ratio, one that newton misses the worst; tables of sizes lack them."""
    rows = every_row()
    for k, seconds in enumerate(((0.1, 0.1), (0.2, 0.4), (0.4, 0.4), (5.0, 5.0))):
        rows.append(superelements(k, "newton", *seconds))
        rows.append(superelements(k, "textbook-active-set", 0.0, 0.2, owner="textbook"))
    rows[-1] |= no_answer("crashed")
    section = section_of(tmp_path, rows)
    found = table(section, "drawn-superelements").data.set_index("method").loc["newton (dual)"]
    assert found[["scenes", "within"]].to_list() == [4, 4]
    assert found[["median_ratio", "worst_ratio"]].to_list() == pytest.approx([3.0, 4.0])
    assert found["worst_scene"] == "drawn/superelements/2"
    assert found[["median_s", "worst_s"]].to_list() == pytest.approx([0.7, 10.0])
    assert table(section, "drawn").data["n"].to_list() == [4386] * 4
    assert len(table(section, "drawn-failures").data) == 1
    missed = section_of(tmp_path / "missed", [*rows[:-4], rows[-4] | no_answer("time_limit"), *rows[-3:]])
    lines = table(missed, "drawn-superelements").data.set_index("method")
    assert lines.loc["newton (dual)", "worst_ratio"] == np.inf


def test_runs_without_an_answer_leave_the_axis_of_one_scene_as_it_is(tmp_path: Path) -> None:
    """They stand side by side, not at contacts that are some more."""
    for active in (52, 10):  # of the answer's scene, or of one with fewer contacts
        missed = [row(f"4386/{active:04d}", name, **no_answer("crashed")) for name in ("gi", "piqp")]
        cells = results(tmp_path, [row(), *missed]).cells
        _, axes = style.single(3.0)
        against_contacts(axes, cells, styles_of(cells))
        low, high = axes.get_xlim()
        assert low < active
        assert high > 54
