"""The section "from scene to answer": stages, totals, and who is the fastest in any form."""

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from synthetic_results import no_answer, results, row, table

from harness.results import schema
from problems import forms
from report.analysis.time_to_solution import stage_seconds
from report.figures import style
from report.results.reader import Results
from report.sections import summary
from report.sections.time_to_solution import section as from_scene
from report.writers.sections_writer import written

LOW, HIGH = "4386/0107", "4386/1471"
BUILD = {"condensation": 8.0, "ties": 0.5, "cholesky": 1.0, "condition": 100.0, "Q": 2.0}
STORED = {"K": 80.0, "factors": 80.0, "Q": 40.0}


def sparse(scene: str = LOW, solver: str = "newton", **figures: Any) -> dict[str, Any]:
    """0.9 s to the first answer, 0.3 s for each further one, the model included only once."""
    known = {"model_s": 0.4, "load_s": 0.6, "convert_s": 0.05, "prepare_s": 0.15, "setup_s": 0.1}
    return row(scene, solver, "sparse", **(known | {"solve_s": 0.2, "form_s": None, "stages": "K"} | figures))


def dense(scene: str = LOW, solver: str = "newton", form: str = "dual", **figures: Any) -> dict[str, Any]:
    """11.5 s to K, factors and Q, then 0.3 s once and 0.1 s per load case."""
    known = {"convert_s": 0.1, "prepare_s": 0.2, "setup_s": 0.02, "solve_s": 0.05, "form_s": 0.03}
    return row(scene, solver, form, **(known | {"stages": "K factors Q"} | figures))


def built(directory: Path, rows: list[dict[str, Any]], **facts: Any) -> Results:
    """The results of rows on scenes of a known cost."""
    known = {"n": 4386, "m": 2193, "build_s": BUILD, "stored_mib": STORED} | facts
    scenes = {r["scene"]: {"scene": r["scene"], "active": r["active"]} | known for r in rows}
    return results(directory, rows, *scenes.values())


def lines(directory: Path, rows: list[dict[str, Any]], **facts: Any) -> pd.DataFrame:
    return stage_seconds(built(directory, rows, **facts)).set_index("method")


def totals(line: pd.Series) -> list[float]:
    return [line[f"total_{k}_s"] for k in (1, 10, 1000)]


def test_the_reports_forms_are_those_of_the_problems() -> None:
    assert set(schema.FORMS) == set(forms.FORMS)
    assert set(schema.DENSE_FORMS) == set(forms.DENSE_FORMS)


def test_each_form_pays_for_its_own_stages(tmp_path: Path) -> None:
    rows = [sparse(), dense(), dense(solver="clarabel", form="primal", stages="K", form_s=None)]
    stages = lines(tmp_path, rows)
    assert totals(stages.loc["newton (sparse)"]) == pytest.approx([0.9, 0.9 + 9 * 0.3, 0.9 + 999 * 0.3])
    assert totals(stages.loc["newton (dual)"]) == pytest.approx([11.9, 11.9 + 0.9, 11.9 + 99.9])
    primal = stages.loc["clarabel (primal)"]
    assert totals(primal) == pytest.approx([8.5 + 0.37, 8.87 + 9 * 0.07, 8.87 + 999 * 0.07])
    assert (primal["factors_s"], primal["Q_s"], primal["stored_mib"]) == (0, 0, 80)
    assert stages["stored_mib"][["newton (dual)", "newton (sparse)"]].tolist() == [200, 0]


@pytest.mark.parametrize(
    ("solver", "form", "first"),
    [("newton", "dual", 11.9), ("gi", "primal", 11.9), ("clarabel", "primal", 8.9)],
)
def test_the_form_tells_the_stages(tmp_path: Path, solver: str, form: str, first: float) -> None:
    """One that was stopped does not."""
    rows = [sparse(solver="other"), dense(solver="another"), dense(solver=solver, form=form, stages=None)]
    assert totals(lines(tmp_path, rows).loc[f"{solver} ({form})"])[0] == pytest.approx(first)


def test_only_answers_within_the_limit_at_a_known_cost_have_a_total(tmp_path: Path) -> None:
    """A dense form whose condensation nobody timed wins nothing."""
    rows = [sparse(), dense(), dense(solver="piqp", verdict="outside"), dense(solver="osqp")]
    rows[-1] |= no_answer("time_limit")
    found = lines(tmp_path / "known", rows)
    assert not found.loc[["piqp (dual)", "osqp (dual)"], ["total_1_s", "total_1000_s"]].notna().any(axis=None)
    unknown = lines(tmp_path / "unknown", [sparse(), dense()], build_s={"model": 0.4})
    assert pd.isna(unknown.loc["newton (dual)", "total_1_s"])


def test_matrices_cost_what_they_took_on_the_machine_of_a_row(tmp_path: Path) -> None:
    """Rows of rounds of two machines stand beside one another."""
    rows = [sparse(), dense(), dense(machine="Slow CPU")]
    slow = {step: 10 * seconds for step, seconds in BUILD.items()}
    problems = [
        {"scene": LOW, "machine": machine, "build_s": build}
        for machine, build in (("Made-up CPU, 2 cores", BUILD), ("Slow CPU", slow))
    ]
    found = stage_seconds(results(tmp_path, rows, *problems))[lambda lines: lines["form"] == "dual"]
    assert found.set_index("machine")["K_s"].to_dict() == {"Made-up CPU, 2 cores": 8.5, "Slow CPU": 85.0}


def test_without_an_answer_within_the_limit_the_stages_are_still_shown(tmp_path: Path) -> None:
    section = from_scene(built(tmp_path, [sparse(verdict="outside"), dense(verdict="outside")]))
    assert len(section.blocks) == 1
    assert "(outside)" in table(section).markdown


def test_the_section_has_a_picture_and_a_table_of_all_stages(tmp_path: Path) -> None:
    rows = [r for s in (LOW, HIGH) for r in (sparse(s), dense(s), dense(s, "piqp", solve_s=6.1))]
    with style.applied():
        section = from_scene(built(tmp_path, rows))
    assert [block.name for block in section.blocks] == ["roads", "roads"]
    written(tmp_path / "report.md", "", [section])
    assert (tmp_path / "roads.png").stat().st_size > 10_000
    saved = pd.read_csv(tmp_path / "roads.csv")
    assert {"model_s", "K_s", "factors_s", "Q_s", "once_s", "solving_s", "recovery_s"} <= set(saved)
    assert saved["total_1_s"].min() == pytest.approx(0.9)


def test_the_advice_counts_from_the_scene_on_too(tmp_path: Path) -> None:
    """newton 0.9 s on the sparse form and 11.9 s on the dual; Clarabel 1.8 s on the sparse form."""
    rows = [sparse(), dense(), sparse(solver="clarabel", solve_s=1.1)]
    advice = table(summary.advice(built(tmp_path, rows))).data.set_index("seconds of")
    ways = [summary.EACH, summary.PREPARED, summary.FROM_SCENE]
    assert advice["use"][ways].tolist() == ["newton (dual)", "newton (dual)", "newton (sparse)"]
    line = advice.loc[summary.FROM_SCENE]
    assert (line["library"], line["to_library"]) == ("clarabel (sparse)", pytest.approx(1.8 / 0.9))
