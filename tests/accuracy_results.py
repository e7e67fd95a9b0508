"""Made-up rows of a sweep over tolerances, with facts planted in them. Nothing was ever measured."""

from typing import Any

from synthetic_results import no_answer, row

LOW, HIGH = "4386/0100", "4386/1000"
DIGITS = range(2, 11)


def answer(scene: str, solver: str, digits: int, seconds: float, error: float, **more: Any) -> dict[str, Any]:
    """A row asked for 10^-digits that took `seconds` of solve and nothing else."""
    steps = dict.fromkeys(("convert_s", "prepare_s", "setup_s", "form_s"), 0.0)
    verdict = "within" if error <= 1e-7 else "outside"
    figures = {"solve_s": seconds, "displacement_error_mm": error, "verdict": verdict}
    return row(scene, solver, tolerance=float(f"1e-{digits}"), **(steps | figures | more))


def sweep() -> list[dict[str, Any]]:
    """honest: error = tolerance / 2, twice the time a digit (0.01 · 2^digits), 100 s once an assembly.
    liar: an eleventh of that time at 2 digits, error 900 times its tolerance.
    late: stopped at 68 s beyond 4 digits. coarse: never better than 3e-6 mm, on HIGH.
    """
    rows = []
    for scene in (LOW, HIGH):
        for k in DIGITS:
            tolerance = 10.0**-k
            rows.append(answer(scene, "honest", k, 0.01 * 2**k, tolerance / 2, prepare_s=100.0))
            rows.append(answer(scene, "liar", k, 0.0004 * 3**k, 900 * tolerance))
        rows += [answer(scene, "late", k, 1.0, 10.0**-k / 2) for k in (2, 4)]
        gone = no_answer("time_limit") | {"time_limit_s": 68.0}
        rows += [row(scene, "late", tolerance=10.0**-k, **gone) for k in (6, 8)]
        floor = 3e-6 if scene == HIGH else 1e-6
        rows += [answer(scene, "coarse", k, 2.0, max(10.0**-k / 2, floor)) for k in (2, 4, 6, 8)]
    return rows
