"""The section on speed: ratios of times within one run."""

from pathlib import Path
from typing import Any

import pytest
from synthetic_results import no_answer, results, row, shown, table

from report.figures import style
from report.sections import speed
from report.sections.speed import load_cases

LOW, HIGH = "4386/0052", "4386/1074"
TIMES = {"setup_s": 0.0, "form_s": 0.0}


def timed(scene: str, solver: str, seconds: float, form: str = "dual", **figures: Any) -> dict[str, Any]:
    known = {"solve_s": seconds, "cholesky_s": 0.5, "product_s": 0.01}
    return row(scene, solver, form, **(TIMES | known | figures))


def test_ratios_are_to_the_median_of_the_fastest_library(tmp_path: Path) -> None:
    rows = [timed(LOW, "newton", 1.0), timed(LOW, "piqp", 8.0), timed(LOW, "proxqp", 4.0, "primal")]
    rows += [timed(LOW, "newton", 2.0, repeat=1), timed(LOW, "piqp", 6.0, repeat=1)]
    rows += [timed(HIGH, "newton", 1.0, threads=1), timed(HIGH, "piqp", 10.0, threads=1)]
    rows += [timed(HIGH, "proxqp", 1.0, "primal", threads=1, verdict="outside")]  # fast, and wrong
    cases = load_cases(results(tmp_path, rows))
    mine = cases[cases["solver"] == "newton"].set_index(["scene", "repeat"])["to_library"]
    assert mine.to_dict() == pytest.approx({(LOW, 0): 1 / 4, (LOW, 1): 2 / 4, (HIGH, 0): 1 / 10})
    assert cases["to_cholesky"].tolist() == pytest.approx((cases["load_case_s"] / 0.5).tolist())
    assert set(cases["method"]) == {"newton (dual)", "piqp (dual)", "proxqp (primal)"}  # without the threads


def test_the_table_gives_median_least_and_most(tmp_path: Path) -> None:
    rows = [timed(scene, "piqp", 10.0, repeat=k) for scene in (LOW, HIGH) for k in range(3)]
    seconds = {LOW: (1.0, 2.0, 3.0), HIGH: (4.0, 4.0, 4.0)}
    rows += [timed(scene, "newton", s, repeat=k) for scene in seconds for k, s in enumerate(seconds[scene])]
    found = results(tmp_path, rows)
    ratios = table(speed.relative(found))
    line = ratios.data.set_index("method").loc["newton (dual)"]
    assert [line[f"to_library{end}"] for end in ("", "_least", "_most")] == pytest.approx([0.3, 0.1, 0.4])
    assert (line["scenes"], line["runs"]) == (2, 6)
    assert shown(ratios)[1][2:4] == ["newton (dual)", "0.300 (0.10 to 0.40)"]
    known = table(speed.machine(found)).data.iloc[0]
    assert known["gflops"] == pytest.approx(2193**3 / 3 / 0.5 / 1e9)
    assert known["gb_per_s"] == pytest.approx(8 * 2193**2 / 0.01 / 1e9)


def test_without_an_answering_library_there_is_no_ratio_to_it(tmp_path: Path) -> None:
    rows = [timed(LOW, "newton", 1.0), timed(LOW, "piqp", 8.0) | no_answer("time_limit")]
    assert shown(table(speed.relative(results(tmp_path, rows))))[1][3] == "–"


def test_where_no_answer_is_within_the_limit_the_yardsticks_stand_alone(tmp_path: Path) -> None:
    found = results(tmp_path, [timed(LOW, "newton", 1.0, verdict="cannot_be_judged")])
    assert speed.relative(found) is None
    assert speed.machine(found) is not None


def test_with_preparation_the_ratio_is_to_the_library_that_is_fastest_with_its_own(tmp_path: Path) -> None:
    rows = [timed(LOW, "newton", 1.0, convert_s=0.0, prepare_s=3.0)]
    rows += [timed(LOW, "piqp", 10.0, convert_s=0.0, prepare_s=0.0)]
    rows += [timed(LOW, "proxqp", 8.0, convert_s=1.0, prepare_s=7.0)]
    cases = load_cases(results(tmp_path, rows)).set_index("solver")
    assert cases.loc["newton", ["to_library", "total_to_library"]].tolist() == pytest.approx([1 / 8, 4 / 10])


def test_the_exponents_of_the_scaling_are_those_of_the_powers_put_in(tmp_path: Path) -> None:
    rows = []
    for n in (1000, 2000, 4000, 8000, 100_000):
        grid = {"scene": f"scaling/{n}", "n": n, "m": n // 2}
        memory = {"data_mib": 100.0, "peak_rss_mib": 100.0 + 1e-5 * n**2}
        none = {"cholesky_s": None, "product_s": None}
        rows.append(timed(LOW, "newton", 1e-4 * n, "sparse", **none, **memory) | grid)
        if n < 100_000:
            figures = {"cholesky_s": 1e-10 * n**3, "product_s": 1e-9 * n**2}
            rows.append(timed(LOW, "newton", 1e-6 * n**1.5, **figures, **memory) | grid)
    section = speed.scaling(results(tmp_path, rows))
    data = table(section).data.set_index("method")
    assert data["load_case_s"].to_dict() == pytest.approx({"newton (sparse)": 1.0, "newton (dual)": 1.5})
    assert data.loc["newton (dual)", "working_mib"] == pytest.approx(2.0)
    assert data["largest"].tolist() == [100_000, 8000]
    with style.applied():
        section.blocks[0].drawing.savefig(tmp_path / "scaling.png")
    assert speed.scaling(results(tmp_path / "few", rows[:4])) is None
