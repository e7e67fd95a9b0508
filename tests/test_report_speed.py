"""The section on speed: ratios of times within one run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from synthetic_results import no_answer, row, write_rows

from report.rows import read
from report.sections import speed

LOW, HIGH = "4386/0052", "4386/1074"
TIMES = {"setup_s": 0.0, "form_s": 0.0}


def timed(scene: str, solver: str, seconds: float, form: str = "dual", **figures: Any) -> dict[str, Any]:
    known = {"solve_s": seconds, "cholesky_s": 0.5, "product_s": 0.01}
    return row(scene, solver, form, **(TIMES | known | figures))


def results(directory: Path, rows: list[dict[str, Any]]):
    return read(write_rows(directory, rows))


def test_ratios_are_to_the_fastest_library_of_the_same_round(tmp_path: Path) -> None:
    rows = [timed(LOW, "newton", 1.0), timed(LOW, "piqp", 8.0), timed(LOW, "proxqp", 4.0, "primal")]
    rows += [timed(LOW, "newton", 2.0, repeat=1), timed(LOW, "piqp", 6.0, repeat=1)]
    rows += [timed(HIGH, "newton", 1.0), timed(HIGH, "piqp", 10.0)]
    rows += [timed(HIGH, "proxqp", 1.0, "primal", verdict="outside")]  # fast, and wrong
    cases = speed.load_cases(results(tmp_path, rows))
    mine = cases[cases["solver"] == "newton"].set_index(["scene", "repeat"])["to_library"]
    assert mine.to_dict() == pytest.approx({(LOW, 0): 1 / 4, (LOW, 1): 1 / 3, (HIGH, 0): 1 / 10})
    assert cases["to_cholesky"].tolist() == pytest.approx((cases["load_case_s"] / 0.5).tolist())


def test_the_table_gives_median_least_and_most(tmp_path: Path) -> None:
    rows = [timed(scene, "piqp", 10.0, repeat=k) for scene in (LOW, HIGH) for k in range(3)]
    seconds = {LOW: (1.0, 2.0, 3.0), HIGH: (4.0, 4.0, 4.0)}
    rows += [timed(scene, "newton", s, repeat=k) for scene in seconds for k, s in enumerate(seconds[scene])]
    section = speed.section(results(tmp_path, rows))
    assert section is not None
    table, yardsticks, figure = section.blocks
    line = table.data[table.data["series"] == "newton (dual)"].iloc[0]
    found = [line[name] for name in ("to_library", "to_library_least", "to_library_most")]
    assert found == pytest.approx([0.3, 0.1, 0.4])
    assert (line["scenes"], line["runs"]) == (2, 6)
    assert "0.300 (0.10 to 0.40)" in table.markdown
    known = yardsticks.data.iloc[0]
    assert known["gflops"] == pytest.approx(2193**3 / 3 / 0.5 / 1e9)
    assert known["gb_per_s"] == pytest.approx(8 * 2193**2 / 0.01 / 1e9)
    assert figure.name == "speed"


def test_without_an_answering_library_there_is_no_ratio_to_it(tmp_path: Path) -> None:
    rows = [timed(LOW, "newton", 1.0), timed(LOW, "piqp", 8.0) | no_answer("time_limit")]
    section = speed.section(results(tmp_path, rows))
    assert section is not None
    assert "–" in section.blocks[0].markdown


def test_without_a_yardstick_there_is_no_section(tmp_path: Path) -> None:
    assert speed.section(results(tmp_path, [row(LOW, "newton")])) is None
