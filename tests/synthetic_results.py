"""Made-up results directories for the tests of the report. Nothing in them was ever measured."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from report.document.blocks import Section, Table
from report.results.reader import Results, read

GRIDS = {4386: (129, 17), 6112: (191, 16), 11308: (257, 22)}
#: Numbers of active contacts in made-up scenes, by n.
SIZES = {4386: [100, 1500], 11308: [2500]}
COND = {4386: 2.6303e6, 6112: 1.112e7, 11308: 1.7692e7}

#: solver, form, seconds of solve at n = 4386 and half contact, growth with contact, error in mm
LINES = [
    ("ipm", "dual", "", 2.3, 0.2, 3e-10),
    ("ipm", "dual", "pcg", 7.1, 0.3, 2e-9),
    ("gi", "dual", "", 0.9, 1.6, 2e-12),
    ("gi", "primal", "", 5.0, 1.4, 3e-12),
    ("piqp", "dual", "", 1.2, 0.1, 4e-9),
    ("piqp", "primal", "", 21.8, 0.1, 2e-11),
    ("proxqp", "dual", "", 3.7, 0.4, 1.4e-9),
    ("proxqp", "primal", "", 7.5, 0.5, 9e-8),
    ("clarabel", "dual", "", 8.5, 0.1, 7.8e-6),
    ("clarabel", "primal", "", 9.9, 0.1, 6.8e-8),
    ("osqp", "dual", "", 20.3, 0.6, 1.6e-11),
    ("osqp", "primal", "", 280.0, 0.0, 1e-6),
    ("daqp", "dual", "", 5.0, 1.5, 2e-11),
    ("quadprog", "primal", "", 40.7, 1.2, 7e-12),
    ("mysolver", "dual", "", 1.25, 0.5, 1e-9),
]


def row(scene: str = "4386/0052", solver: str = "ipm", form: str = "dual", **figures: Any) -> dict[str, Any]:
    """A row of measurements.jsonl in which everything went well, with `figures` changed."""
    return {
        "suite": "made-up", "scene": scene, "n": int(scene.split("/")[0]), "m": int(scene.split("/")[0]) // 2,
        "active": int(scene.split("/")[1]), "solver": solver, "form": form, "variant": "", "tolerance": 1e-9,
        "threads": 2, "repeat": 0, "status": "solved", "iterations": 20, "inner_iterations": None,
        "convert_s": 0.1, "prepare_s": 0.2, "setup_s": 0.3, "solve_s": 1.0, "solver_reported_s": 1.0,
        "displacement_error_mm": 1e-9, "limit_mm": 1e-7, "limit_asked_mm": 1e-7,
        "verdict": "within", "reference_bound_mm": 1e-12,
        "contact_mismatch": 0, "min_gap_mm": -1e-13, "primal_residual": 1e-13, "dual_residual": 1e-9,
        "duality_gap": 1e-10, "peak_rss_mib": 512.0, "machine": "Made-up CPU, 2 cores", "form_s": 0.05,
        "kernels": "openblas SkylakeX", "threads_asked": 2, "solver_version": "1.0", "message": None,
        "rivetbench_version": "0.1.0", "recorded_at": "2025-01-01T00:00:00Z", "time_limit_s": 60.0,
        "owner": "ours" if solver in ("ipm", "gi", "newton", "ipm-fast") else "library",
        "stages": "K factors Q",
    } | figures  # fmt: skip


def no_answer(status: str) -> dict[str, Any]:
    """The figures of a run that gave none."""
    names = ("convert_s", "prepare_s", "setup_s", "solve_s", "form_s", "solver_reported_s", "iterations")
    more = ("displacement_error_mm", "contact_mismatch", "min_gap_mm", "primal_residual", "dual_residual")
    return dict.fromkeys((*names, *more, "duality_gap"), None) | {"status": status, "verdict": "no_answer"}


def times(**seconds: float) -> dict[str, float]:
    """A row's times: nothing but these."""
    return dict.fromkeys(("convert_s", "prepare_s", "setup_s", "solve_s", "form_s"), 0.0) | seconds


def write_rows(directory: Path, rows: list[dict[str, Any]]) -> Path:
    directory.mkdir(parents=True, exist_ok=True)
    text = "".join(json.dumps(r) + "\n" for r in rows)
    (directory / "measurements.jsonl").write_text(text, "utf-8")
    return directory


def results(directory: Path, rows: list[dict[str, Any]], *problems: dict[str, Any]) -> Results:
    """A directory of these rows and scenes, read."""
    write_rows(directory, rows)
    (directory / "problems.jsonl").write_text("".join(json.dumps(each) + "\n" for each in problems), "utf-8")
    return read(directory)


def table(section: Section | None, name: str = "") -> Table:
    """The section's table of that name, or its only one."""
    assert section is not None
    (found,) = (b for b in section.blocks if isinstance(b, Table) and name in ("", b.name))
    return found


def shown(table: Table) -> list[list[str]]:
    """The cells of its Markdown, line by line, the headings first."""
    lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.markdown.splitlines()]
    return [lines[0], *lines[2:]]


def everything(directory: Path, scenes_of: dict[int, list[int]]) -> Path:
    """A whole directory: all three sizes, all kinds of status, nulls, scene files."""
    random = np.random.default_rng(7)
    rows, problems = [], []
    for n, counts in scenes_of.items():
        for active in counts:
            scene = f"{n}/{active:04d}"
            rows += [_made_up(scene, n, active, random, *line) for line in LINES]
            rows.append(row(scene, "highs", "primal", **no_answer("crashed")))
            rows.append(row(scene, "highs", "dual", **no_answer("unsupported")))
            problems.append(_problem(scene, n, active))
            _scene_file(directory, scene, n, active, random)
    write_rows(directory, rows)
    text = "".join(json.dumps(p) + "\n" for p in problems)
    (directory / "problems.jsonl").write_text(text, "utf-8")
    suite = 'name = "made-up"\ntitle = "Made-up results"\ndescription = "For the tests of the report."\n'
    (directory / "suite.toml").write_text(suite + "time_limit_s = 60\nmemory_limit_mib = 8192\n", "utf-8")
    machine = {
        "machine": "Made-up CPU, 2 cores", "cpu": "Made-up CPU", "cores": 2,
        "blas": ["openblas SkylakeX"], "versions": {"numpy": "2.0", "piqp": "0.6"},
    }  # fmt: skip
    (directory / "machine.json").write_text(json.dumps(machine), "utf-8")
    return directory


def _made_up(
    scene: str, n: int, active: int, random: np.random.Generator,
    solver: str, form: str, variant: str, seconds: float, growth: float, error: float,
) -> dict[str, Any]:  # fmt: skip
    share = active / (n / 2)
    solve = seconds * (n / 4386) ** 2.7 * (0.15 + share) ** growth * random.lognormal(0, 0.1)
    error *= random.lognormal(0, 0.7)
    dual = form == "dual"
    figures = {
        "variant": variant, "solve_s": solve, "setup_s": 0.05 * seconds,
        "prepare_s": 0.2 if solver == "gi" else 0.0, "convert_s": 0.001 * n / 100,
        "form_s": 0.03 * (n / 4386) ** 2 if dual else None,
        "displacement_error_mm": error, "verdict": "within" if error <= 1e-7 else "outside",
        "iterations": int(30 + active / 3), "inner_iterations": 3231 if variant == "pcg" else None,
        "peak_rss_mib": (300 if dual else 900) * (n / 4386) ** 2,
    }  # fmt: skip
    if solve > 60:
        figures |= no_answer("memory_limit" if solver == "quadprog" and n > 6200 else "time_limit")
    elif solver == "clarabel":
        figures["status"] = "inaccurate" if dual else "solved"
    return row(scene, solver, form, **figures)


def _problem(scene: str, n: int, active: int) -> dict[str, Any]:
    title = "Initial gap of 0.6 mm, pressed by fasteners"
    return {"scene": scene, "title": title, "n": n, "m": n // 2, "active": active, "cond_K": COND[n]}


def _scene_file(directory: Path, scene: str, n: int, active: int, random: np.random.Generator) -> None:
    nx, ny = GRIDS[n]
    X, Y = np.meshgrid(np.linspace(0, 4000, nx), np.linspace(0, 400, ny), indexing="ij")
    initial = 0.6 + 0.2 * np.sin(X / 300) * np.cos(Y / 150) + 0.05 * np.sin(X / 90 + Y / 70)
    pressed = initial - 0.55 * (0.6 + 0.4 * np.cos(X / 700)) - 0.05 * np.cos(Y / 60)
    level = np.sort(pressed.ravel())[active]
    after = np.maximum(pressed - level, 0.0)
    fasteners = np.array([(x, y) for x in np.linspace(100, 3900, 39) for y in (100.0, 300.0)])
    lam = np.where(after.ravel() == 0, random.exponential(3.0, after.size), 0.0)
    near = [int(np.argmin(np.hypot(X.ravel() - x, Y.ravel() - y))) for x, y in fasteners]
    lam[near] *= 60
    (directory / "scenes").mkdir(parents=True, exist_ok=True)
    np.savez(
        directory / "scenes" / (scene.replace("/", "_") + ".npz"),
        contact_nodes=np.column_stack([X.ravel(), Y.ravel()]),
        gap_before=initial.ravel(), gap_after=after.ravel(), lam=lam, fasteners=fasteners,
    )  # fmt: skip


# --- a sweep over tolerances ------------------------------------------------------------------------------

LOW, HIGH = "4386/0100", "4386/1000"


def answer(scene: str, solver: str, digits: int, seconds: float, error: float, **more: Any) -> dict[str, Any]:
    """A row asked for 10^-digits that took `seconds` of solve and nothing else."""
    verdict = "within" if error <= 1e-7 else "outside"
    figures = times(solve_s=seconds) | {"displacement_error_mm": error, "verdict": verdict}
    return row(scene, solver, tolerance=float(f"1e-{digits}"), **(figures | more))


def sweep() -> list[dict[str, Any]]:
    """honest: error = tolerance / 2, twice the time a digit (0.01 · 2^digits), 100 s once an assembly.
    liar: an eleventh of that time at 2 digits, error 900 times its tolerance.
    late: stopped at 68 s beyond 4 digits. coarse: never better than 3e-6 mm, on HIGH.
    """
    rows = []
    for scene in (LOW, HIGH):
        for k in range(2, 11):
            tolerance = 10.0**-k
            rows.append(answer(scene, "honest", k, 0.01 * 2**k, tolerance / 2, prepare_s=100.0))
            rows.append(answer(scene, "liar", k, 0.0004 * 3**k, 900 * tolerance))
        rows += [answer(scene, "late", k, 1.0, 10.0**-k / 2) for k in (2, 4)]
        gone = no_answer("time_limit") | {"time_limit_s": 68.0}
        rows += [row(scene, "late", tolerance=10.0**-k, **gone) for k in (6, 8)]
        floor = 3e-6 if scene == HIGH else 1e-6
        rows += [answer(scene, "coarse", k, 2.0, max(10.0**-k / 2, floor)) for k in (2, 4, 6, 8)]
    return rows
