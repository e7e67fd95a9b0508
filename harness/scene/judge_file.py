"""The verdict on an answer that another program has computed: x or λ from a .npz or .csv file."""

from __future__ import annotations

import csv
from collections.abc import Callable
from math import inf
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from harness.results.incomparable import Incomparable
from harness.terminal.exit_codes import DONE, FAILED, NOTHING_JUDGED
from harness.terminal.progress import STYLES
from harness.verification.judge import Judgement
from harness.verification.reference_problem import ReferenceProblem, reference_problem
from problems.errors import InputError
from problems.forms.assembly import Vector
from problems.forms.names import Form
from problems.input.bounded import regular_file

MIB = 1024
#: The headings of a column of displacements and of contact forces, in a table with several.
HEADINGS = {"x": ("x", "displacement_mm"), "lam": ("lam", "force_N")}
ALLOWED = "a .npz or .csv file with numbers"
CODES = {"within": DONE, "outside": FAILED, "cannot_be_judged": NOTHING_JUDGED}
#: The vector that has none of these names, by the form that it was computed in.
VECTOR_OF = {"primal": "x", "dual": "lam", "sparse": "x"}


def judge_file(
    path: Path,
    source: str,
    form: Form,
    limit_mm: float,
    console: Console,
    reference_limit_s: float | None = None,
) -> int:
    """Print the verdict on the answer in a file; returns 0 within the limit, 1 outside, 3 if not known.

    x (n,) mm, in the sparse form all N unknowns; where there is only λ (m,) N, x = K⁻¹(f − Aλ). Raises
    InputError, Incomparable if a vector is of another length.
    """
    if not 0 < limit_mm < inf:
        raise InputError.one("--limit", "limit, mm", limit_mm, "must be positive and finite")
    given = {name or VECTOR_OF[form]: vector for name, vector in read_answer(path).items()}
    problem = reference_problem(source, limit_s=reference_limit_s, form=form)
    assembly = problem.prepared.assembly
    for name, size in (("x", assembly.n), ("lam", assembly.m)):
        if name in given and len(given[name]) != size:
            allowed = f"{size} in the {form} form of {problem.scene.name}; name another form with --form"
            raise Incomparable.one(path, f"length of {name}", len(given[name]), allowed)
    x, lam = given.get("x"), given.get("lam")
    if x is None:
        assert lam is not None
        x = problem.prepared.recover(lam, problem.load)
    forces = np.full(assembly.m, np.nan) if lam is None else lam
    limit = problem.limit_mm(limit_mm)
    found = problem.judged(x, forces, limit)
    console.print(_table(problem, found, x))
    console.print(_sentence(problem, found, limit), style=STYLES[found.verdict])
    return CODES[found.verdict]


def _sentence(problem: ReferenceProblem, found: Judgement, limit_mm: float) -> str:
    if found.verdict == "cannot_be_judged":
        bound = problem.reference.bound_mm
        return (
            f"Cannot be judged: the reference is proven only to {bound:.1e} mm ({problem.reference.route})."
        )
    return f"{found.verdict.capitalize()} {limit_mm:.3g} mm."


def _table(problem: ReferenceProblem, found: Judgement, x: Vector) -> Table:
    """The judge's figures, and where the largest error is."""
    table = Table("figure", "value", title=f"{problem.scene.name}: the answer judged")
    error, bound = found.displacement_error_mm or 0.0, problem.reference.bound_mm
    figures = {
        "largest displacement error, mm": f"{error:.3e} {_place(problem, x)}",
        "proven: every displacement within, mm": f"{error + bound:.3e}",
        "error bound of the reference, mm": f"{bound:.1e}",
        "contacts open or closed by mistake": str(found.contact_mismatch),
        "largest overlap, mm": f"{found.primal_residual or 0.0:.3e}",
    }
    if found.dual_residual is not None:
        figures |= {
            "largest unbalanced force, N": f"{found.dual_residual:.3e}",
            "duality gap, N·mm": f"{found.duality_gap:.3e}",
        }
    for name, value in figures.items():
        table.add_row(name, value)
    return table


def _place(problem: ReferenceProblem, x: Vector) -> str:
    assembly = problem.prepared.assembly
    nodes = assembly.asked_nodes
    worst = int(np.argmax(assembly.at_junction(abs(x - problem.reference.x))))
    return f"at entry {worst}" if nodes is None else f"at ({nodes[worst, 0]:.4g}, {nodes[worst, 1]:.4g}) mm"


def read_answer(path: Path) -> dict[str, Vector]:
    """What the file holds: "x" (displacements), "lam" (contact forces), or "" for a vector of another name.

    An .npz has arrays x or displacement_mm, lam or force_N, never both of a pair, or one alone; a .csv has a
    header with such columns (as in nodes.csv and contacts.csv of `solve`), or one column of numbers.
    Raises InputError.
    """
    regular_file(path, "file", MIB)
    try:
        match path.suffix.lower():
            case ".npz":
                with np.load(path, allow_pickle=False) as archive:
                    found = _named(path, archive.files, archive.__getitem__)
            case ".csv":
                found = _columns(path)
            case suffix:
                raise InputError.one(path, "suffix", suffix, ALLOWED)
    except InputError:
        raise
    except Exception as error:  # numpy, zipfile and csv raise kinds of their own
        raise InputError.one(path, "file", f"{type(error).__name__}: {error}", ALLOWED) from error
    for name, vector in found.items():
        wrong = np.flatnonzero(~np.isfinite(vector))
        if len(wrong):
            key = f"{name or 'entry'}[{wrong[0]}]"
            allowed = f"must be finite; {len(wrong)} of {len(vector)} are not"
            raise InputError.one(path, key, float(vector[wrong[0]]), allowed)
    return found


def _columns(path: Path) -> dict[str, Vector]:
    with path.open(encoding="utf-8-sig", newline="") as file:
        first, *rest = [row for row in csv.reader(file) if any(cell.strip() for cell in row)]
    heading = [cell.strip() for cell in first]
    if len(heading) == 1 and _is_number(heading[0]):
        return {"": np.array([float(row[0]) for row in (first, *rest)])}
    return _named(path, heading, lambda name: [float(row[heading.index(name)]) for row in rest])


def _named(path: Path, names: list[str], read: Callable[[str], object]) -> dict[str, Vector]:
    """Those of HEADINGS, else the only one."""
    found = {}
    for name, headings in HEADINGS.items():
        known = [each for each in headings if each in names]
        if len(known) > 1:
            allowed = "one of them alone: the other is not what is judged"
            raise InputError.one(path, "columns", ", ".join(known), allowed)
        if known:
            found[name] = _vector(read(known[0]))
    if not found and len(names) != 1:
        wanted = " or ".join(each for headings in HEADINGS.values() for each in headings)
        raise InputError.one(path, "names", names, f"{wanted}, or one alone")
    return found or {"": _vector(read(names[0]))}


def _vector(array: object) -> Vector:
    values = np.asarray(array)
    if values.dtype.kind not in "fiu":
        raise ValueError(f"an array of {values.dtype}")
    if values.size != max(values.shape, default=1):
        raise ValueError(f"an array of shape {values.shape}, not a vector")
    return values.astype(float).ravel()


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
