"""Made-up results of the suite `paper`, as the paper would have it unless a test changes them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
from synthetic_results import COND, no_answer, row, write_rows

from report.results.reader import Results
from report.results.rows import cells_of, frame
from studies.paper.rows import Study, study_of

LOADS = {
    4386: (52, 107, 418, 795, 863, 1074, 1128, 1347, 1471, 1592),
    6112: (160, 600, 1050, 1500, 2300, 2880),
    11308: (295, 1100, 2000, 2800, 4300, 5350),
}
SCALING = (1170, 2522, 4386, 6762, 11308)
ROOT = 0.3  # made-up exponent of the outer iterations, below the theory's 0.5
Row = dict[str, Any]
Rows = list[Row]

VARIANTS: dict[str, Row] = {
    "STP1": {"start": "stp1"},
    "STP2": {"start": "stp2"},
    "Mehrotra start": {"start": "mehrotra"},
    "Algorithm 4": {"start": "algorithm_4"},
    "V = I": {"preconditioner": "none", "max_cg": 200000},
    "U alone": {"preconditioner": "U"},
    "splitting": {"preconditioner": "splitting"},
    "direct": {"preconditioner": "direct"},
    "textbook": {"scheme": "mehrotra"},
    "CG 1e-10": {"cg_tolerance": 1e-10},
}
STARTS = ("STP1", "STP2", "Mehrotra start")
#: Of a variant, beside the plain method: CG iterations, and seconds.
TIMES = {"V = I": (60, 20), "U alone": (4, 3), "splitting": (2, 1.5), "direct": (0, 2), "CG 1e-10": (3, 3)}


def plain(scene: str, n: int, active: int, **changed: Any) -> Row:
    """A row of any solver on a scene, whatever it is called."""
    form, variant = changed.get("form", "dual"), changed.get("variant", "")
    solver = changed.get("solver", "ipm")
    key = f"{scene} {solver} {form}" + (f" {variant}" if variant else "")
    made = row("1/1", solver, form) | {"scene": scene, "n": n, "m": n // 2, "active": active, "key": key}
    made |= {"suite": "paper", "options": {}, "details": {}, "setup_s": 0.0, "form_s": 0.0, "convert_s": 0.0}
    made |= {"displacement_error_mm": 1e-9, "data_mib": 100.0, "time_limit_s": 5000.0}
    return made | changed


def ipm_row(scene: str, n: int, active: int, variant: str = "", **changed: Any) -> Row:
    options = {"ordering": "open_last"} if variant == "open gaps last" else VARIANTS.get(variant, {})
    more, slower = TIMES.get(variant, (1, 1))
    outer = round(20 * (n / 4386) ** ROOT) + (2 if variant in ("STP1", "STP2") else 0)
    late = 2.0 if variant == "open gaps last" else 1.0
    counts = [max(round(more * (14 - k / 4) / late), more > 0) for k in range(outer)]
    if more == 0:
        counts = [0] * outer
    start = {"mu": 1e3, "infeasibility_mm": 0.7 if variant in ("STP1", "STP2") else 1e-13}
    details = {
        "cg": {"predictor": counts, "corrector": [c + (c > 0) for c in counts]}, "mu": 1e-15,
        "start": start | {"corrections": 0, "multiplications": 5},
        "factorisations": outer if more == 0 else 0,
    }  # fmt: skip
    inner = sum(counts) + sum(c + (c > 0) for c in counts)
    size = n / 4386
    figures = {
        "variant": variant, "options": options, "details": details, "iterations": outer,
        "inner_iterations": inner,
        "solve_s": (inner or 1200) * size**2 * slower / 1000 * (1 + 0.2 * active / n),
        "prepare_s": 0.1 * size**3, "peak_rss_mib": 100 + 60 * size**2, "tolerance": 1e-14,
    }  # fmt: skip
    return plain(scene, n, active, **(figures | changed))


def gi_row(scene: str, n: int, active: int, form: str, **changed: Any) -> Row:
    """Pivots as many as the form has active constraints, n² of work each; half contact: as long as IPM."""
    size = n / 4386
    pivots = active if form == "primal" else n // 2 - active
    figures = {
        "solver": "gi", "form": form, "iterations": pivots, "tolerance": 1e-10,
        "solve_s": 1e-3 * (1.2 if form == "primal" else 0.8) * pivots * size**2, "prepare_s": 0.4 * size**3,
        "peak_rss_mib": 100 + 180 * size**2, "details": {"drops": 3, "refinements": 1},
    }  # fmt: skip
    return plain(scene, n, active, **(figures | changed))


def paper_rows() -> Rows:
    """Every row of a run of the suite in which the paper's claims hold."""
    rows: Rows = []
    for n, loads in LOADS.items():
        for active in loads:
            at = (f"{n}/{active:04d}", n, active)
            rows += [ipm_row(*at), ipm_row(*at, "open gaps last")]
            rows += [gi_row(*at, form) for form in ("dual", "primal")]
            rows.append(plain(*at, solver="piqp", solve_s=1.5 * (n / 4386) ** 3))
            if n == 4386:
                rows += [ipm_row(*at, name) for name in STARTS]
        at = (f"{n}/{loads[3]:04d}", n, loads[3])
        rows += [ipm_row(*at, name) for name in VARIANTS if n > 4386 or name not in STARTS]
    for n in SCALING:
        at = (f"scaling/{n}", n, round(0.4 * n / 2))
        rows += [ipm_row(*at), ipm_row(*at, "open gaps last")]
        rows += [gi_row(*at, form) for form in ("dual", "primal")]
    return rows


def write_paper(directory: Path, rows: Rows) -> Path:
    """A results directory of these rows."""
    write_rows(directory, rows)
    lines = [json.dumps(problem) + "\n" for problem in _problems(rows)]
    (directory / "problems.jsonl").write_text("".join(lines), "utf-8")
    return directory


def _problems(rows: Rows) -> Rows:
    return [_problem(r) for r in {r["scene"]: r for r in rows}.values()]


def changed(rows: Rows, chosen: Callable[[Row], bool], **figures: Any) -> Rows:
    """The rows, with `figures` in those that are chosen; callables are applied to the row."""
    return [r | {k: v(r) if callable(v) else v for k, v in figures.items()} if chosen(r) else r for r in rows]


def studied(rows: Rows) -> Study:
    """As if they had been read from a directory."""
    made = frame(rows)
    return study_of(Results(Path(), made, cells_of(made), pd.DataFrame(_problems(rows))))


def ipm(option: str = "", value: object = None) -> Callable[[Row], bool]:
    """Chooses rows of the interior-point method with that option, or with none."""

    def chosen(r: Row) -> bool:
        return r["solver"] == "ipm" and (r["options"].get(option) == value if option else not r["options"])

    return chosen


def gi(form: str) -> Callable[[Row], bool]:
    return lambda r: (r["solver"], r["form"]) == ("gi", form)


def late(limit: float) -> Row:
    """The figures of a run that its time limit ended."""
    return no_answer("time_limit") | {"time_limit_s": limit, "details": None}


def _problem(of: Row) -> Row:
    size = of["n"] / 4386
    build = {"condensation": 7.0 * size**2, "cholesky": 0.2 * size**3, "condition": 1.0, "Q": 1.0 * size**3}
    return {
        "scene": of["scene"], "title": "made up", "n": of["n"], "m": of["m"], "active": of["active"],
        "cond_K": COND.get(of["n"], 1e6), "lambda_min": 1.0, "lambda_max": 1e6, "build_s": build,
        "reference_s": 1.0, "reference_bound_mm": 1e-14, "reference_route": "newton, refined",
    }  # fmt: skip
