"""What the terminal shows: a line a row, and the time that is left."""

from io import StringIO
from typing import Any

from rich.console import Console

from harness.planning.plan import Measurement
from harness.terminal.progress import Display


def measurement(scene: str, solver: str = "gi", time_limit_s: float = 1000.0) -> Measurement:
    return Measurement("s", scene, scene, solver, "dual", "", {}, 1e-9, 2, 0, time_limit_s, 100, 1e-7, True)


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
    plan = [measurement("small"), measurement("large")]
    with Display(Console(file=shown, width=60), plan, 0, {}) as display:
        display.finished(plan[0], row(), 1.0)
        nothing = dict.fromkeys(["convert_s", "prepare_s", "solve_s", "displacement_error_mm", "iterations"])
        failed = row(**nothing, status="crashed", verdict="no_answer", message="killed by SIGSEGV\nmore")
        display.finished(plan[1], failed, 1.0)
    heading, first, second, why = filter(str.strip, shown.getvalue().splitlines())
    assert heading.split()[:2] == ["scene", "solver"]
    assert " ".join(first.split()) == "small gi dual 1e-09 2 solved 7 0.50 0.75 2.0e-11 within"
    assert " ".join(second.split()) == "small gi dual 1e-09 2 crashed – – – – no_answer"
    assert why.strip() == "killed by SIGSEGV"
