"""The section on methods for contact problems: seconds and products with Q."""

from pathlib import Path
from typing import Any

from synthetic_results import no_answer, results, row, shown, table

from report.sections import speed

LOW, HIGH = "4386/0052", "4386/1074"


def told(directory: Path, rows: list[dict[str, Any]]) -> list[list[str]]:
    return shown(table(speed.methods(results(directory, rows))))


def measured(scene: str, solver: str, seconds: float, products: int | None, **more: Any) -> dict[str, Any]:
    details = {} if products is None else {"products": products}
    figures = {"setup_s": 0.0, "form_s": 0.0, "solve_s": seconds, "owner": "ours", "details": details}
    return row(scene, solver, **figures | more)


def test_seconds_and_products_stand_together(tmp_path: Path) -> None:
    rows = [measured(LOW, "newton", 0.2, 15), measured(HIGH, "newton", 0.1, 12)]
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
