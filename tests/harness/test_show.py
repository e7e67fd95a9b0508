"""What the terminal shows of a run: a line per row."""

from io import StringIO
from typing import Any

from rich.console import Console

from harness.terminal.console import Display


def row(**changes: Any) -> dict[str, Any]:
    times = dict.fromkeys(["convert_s", "prepare_s", "setup_s", "solve_s", "form_s"], 0.25)
    words = {
        "scene": "small",
        "solver": "gi",
        "variant": "",
        "form": "dual",
        "status": "solved",
        "message": None,
    }
    figures = {"tolerance": 1e-9, "threads_asked": 2, "iterations": 7, "displacement_error_mm": 2e-11}
    return {**times, **words, **figures, "verdict": "within", **changes}


def test_a_line_says_the_outcome_and_why() -> None:
    shown = StringIO()
    with Display(Console(file=shown, width=60), 2, 0) as display:
        display.finished(row())
        nothing = dict.fromkeys(["convert_s", "prepare_s", "solve_s", "displacement_error_mm", "iterations"])
        failed = row(**nothing, status="crashed", verdict="no_answer", message="killed by SIGSEGV\nmore")
        display.finished(failed)
    heading, first, second, why = filter(str.strip, shown.getvalue().splitlines())
    assert heading.split()[:2] == ["scene", "solver"]
    assert " ".join(first.split()) == "small gi dual 1e-09 2 solved 7 0.50 0.75 2.0e-11 within"
    assert " ".join(second.split()) == "small gi dual 1e-09 2 crashed – – – – no_answer"
    assert why.strip() == "killed by SIGSEGV"
