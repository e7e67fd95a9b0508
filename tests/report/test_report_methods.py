"""The section on methods for contact problems: seconds and products with Q."""

from pathlib import Path
from typing import Any

from synthetic_results import no_answer, row, write_rows

from report.document.blocks import Section
from report.results.reader import read
from report.sections import methods

LOW, HIGH = "4386/0052", "4386/1074"


def told(directory: Path, rows: list[dict[str, Any]]) -> Section | None:
    return methods.section(read(write_rows(directory, rows)))


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
    section = told(tmp_path, rows)
    (table,) = section.blocks
    lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.markdown.splitlines()]
    assert lines[0] == ["method", LOW, HIGH]
    cells = {line[0]: line[1:] for line in lines[2:]}
    assert cells["newton (dual)"] == ["0.200 (15)", "0.100 (12)"]
    assert cells["piqp (dual)"] == ["1.25", "1.50"]
    assert cells["rough (dual)"] == ["", "0.0100 (outside) (9)"]
    assert cells["slow (dual)"] == ["> 60", ""]


def test_a_method_counts_with_its_best_tolerance(tmp_path: Path) -> None:
    rows = [measured(LOW, "newton", 0.2, 15), measured(LOW, "mprgp", 0.3, 11)]
    missed: dict[str, Any] = {"verdict": "outside", "displacement_error_mm": 1.5e-7}
    rows += [measured(LOW, "piqp", 1.5, None, tolerance=1e-9)]
    rows += [measured(LOW, "piqp", 1.0, None, tolerance=1e-8, **missed)]
    rows += [measured(LOW, "piqp", 2.0, None, tolerance=1e-10)]
    rows += [measured(LOW, "rough", 2.0, None, tolerance=1e-9, **missed | {"displacement_error_mm": 1e-5})]
    rows += [measured(LOW, "rough", 1.0, None, tolerance=1e-8, **missed | {"displacement_error_mm": 1e-4})]
    section = told(tmp_path, rows)
    (table,) = (block.markdown for block in section.blocks)
    assert " 1.50 |" in table
    assert " 2.00 (outside) |" in table


def test_one_method_that_counts_is_no_comparison(tmp_path: Path) -> None:
    assert told(tmp_path, [measured(LOW, "newton", 0.2, 15), measured(LOW, "piqp", 1.0, None)]) is None
