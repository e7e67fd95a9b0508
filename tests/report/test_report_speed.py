"""The section on speed: ratios of times within one run."""

from pathlib import Path
from typing import Any

import pytest
from synthetic_results import results, row, table

from report.figures import style
from report.sections import speed

LOW, HIGH = "4386/0052", "4386/1074"
TIMES = {"setup_s": 0.0, "form_s": 0.0}


def timed(scene: str, solver: str, seconds: float, form: str = "dual", **figures: Any) -> dict[str, Any]:
    known = {"solve_s": seconds, "cholesky_s": 0.5, "product_s": 0.01}
    return row(scene, solver, form, **(TIMES | known | figures))


def test_the_yardsticks_stand_alone_where_no_answer_is_within_the_limit(tmp_path: Path) -> None:
    found = results(tmp_path, [timed(LOW, "newton", 1.0, verdict="cannot_be_judged")])
    known = table(speed.machine(found)).data.iloc[0]
    assert known["gflops"] == pytest.approx(2193**3 / 3 / 0.5 / 1e9)
    assert known["gb_per_s"] == pytest.approx(8 * 2193**2 / 0.01 / 1e9)


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
