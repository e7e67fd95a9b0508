"""The sections on speed and on methods for contact problems: times within one run, and products with Q."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import linregress
from synthetic_results import no_answer, results, row, shown, table

from report.analysis.time_to_solution import exponent
from report.figures import style
from report.sections import speed

LOW, HIGH = "4386/0052", "4386/1074"
TIMES = {"setup_s": 0.0, "form_s": 0.0}


def timed(scene: str, solver: str, seconds: float, form: str = "dual", **figures: Any) -> dict[str, Any]:
    known = {"solve_s": seconds, "cholesky_s": 0.5, "product_s": 0.01}
    return row(scene, solver, form, **(TIMES | known | figures))


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


def test_an_exponent_has_the_error_of_a_least_squares_fit() -> None:
    sizes = [1170.0, 2522.0, 4386.0, 6762.0, 11308.0]
    noisy = [n**2 * f for n, f in zip(sizes, (1.1, 0.8, 1.3, 0.9, 1.0), strict=True)]
    fit, other = exponent(sizes, noisy), linregress(np.log(sizes), np.log(noisy))
    assert fit is not None
    assert (fit.slope, fit.error) == pytest.approx((other.slope, other.stderr))
    assert exponent(sizes, [1.0, 2.0, math.nan, 0.0, math.nan]) is None


def test_the_machines_speed_is_that_of_each_number_of_contacts(tmp_path: Path) -> None:
    """Of two scenes with as many unknowns; 2e9 operations and 3e9 bytes a second."""
    sizes = {"one": 1000, "other": 2000}
    rows = [
        timed(LOW, "ipm", 1.0, cholesky_s=m**3 / 3 / 2e9, product_s=8 * m**2 / 3e9) | {"scene": name, "m": m}
        for name, m in sizes.items()
    ]
    lines = shown(table(speed.machine(results(tmp_path, rows))))[1:]
    assert [[*line[:4], line[5], line[7]] for line in lines] == [
        ["4386", f"{m}", "2", "1", "2.00", "3.00"] for m in sizes.values()
    ]


# Methods for contact problems.


def told(directory: Path, rows: list[dict[str, Any]]) -> list[list[str]]:
    return shown(table(speed.methods(results(directory, rows))))


def measured(scene: str, solver: str, seconds: float, products: int | None, **more: Any) -> dict[str, Any]:
    details = {} if products is None else {"products": products}
    return timed(scene, solver, seconds, **{"owner": "ours", "details": details} | more)


def test_seconds_and_products_stand_together(tmp_path: Path) -> None:
    rows = [measured(LOW, "newton", 0.2, None, iterations=15), measured(HIGH, "newton", 0.1, 12)]
    rows += [measured(LOW, "mprgp", 0.3, 11), measured(HIGH, "mprgp", 0.05, 14)]
    rows += [measured(LOW, "counts once", 0.4, 3), measured(HIGH, "counts once", 0.4, None)]
    rows += [measured(LOW, "slow", 0.0, None) | no_answer("time_limit")]
    rows += [measured(LOW, "piqp", 1.25, None), measured(HIGH, "piqp", 1.5, None)]
    rows += [measured(HIGH, "rough", 0.01, 9, verdict="outside", displacement_error_mm=3e-5)]
    lines = told(tmp_path, rows)
    assert lines[0] == ["method", LOW, HIGH]
    cells = {line[0]: line[1:] for line in lines[1:]}
    assert cells["newton (dual)"] == ["0.200 (15)", "0.100 (12)"]
    assert cells["piqp (dual)"] == ["1.25", "1.50"]
    assert cells["rough (dual)"] == ["", "0.0100 (outside) (9)"]
    assert cells["slow (dual)"] == ["> 60", ""]


def test_a_method_counts_with_its_best_tolerance(tmp_path: Path) -> None:
    rows = [measured(LOW, "newton", 0.2, 15), measured(LOW, "mprgp", 0.3, 11)]
    missed = {"verdict": "outside", "displacement_error_mm": 1.5e-7}
    rows += [measured(LOW, "piqp", s, None, tolerance=t) for s, t in ((1.5, 1e-9), (2.0, 1e-10))]
    rows += [measured(LOW, "piqp", 1.0, None, tolerance=1e-8, **missed)]
    for seconds, tolerance, error in ((2.0, 1e-9, 1e-5), (1.0, 1e-8, 1e-4)):
        wrong = missed | {"displacement_error_mm": error}
        rows.append(measured(LOW, "rough", seconds, None, tolerance=tolerance, **wrong))
    cells = dict(told(tmp_path, rows)[1:])
    assert (cells["piqp (dual)"], cells["rough (dual)"]) == ("1.50", "2.00 (outside)")
