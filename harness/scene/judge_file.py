"""The verdict on an answer that another program has computed: x or λ from a .npz or .csv file."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from harness.results.comparison import Incomparable
from harness.terminal import DONE, FAILED, NOTHING_JUDGED
from harness.terminal.console import STYLES
from harness.verification.judge import Judgement
from harness.verification.reference_problem import ReferenceProblem, reference_problem
from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import Vector
from problems.input.bounded_types import regular_file
from problems.input.matrix_files import damage
from problems.input.tables import Cells, doubt, is_stray, number
from report.document.numbers import position

MIB = 1024
#: The names of displacements and of contact forces.
HEADINGS = {"x": ("x", "displacement_mm"), "lam": ("lam", "force_N")}
ALLOWED = "a .npz or .csv file with numbers"
CODES = {"within": DONE, "outside": FAILED, "cannot_be_judged": NOTHING_JUDGED}


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
    given = read_answer(path)
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
    nodes = assembly.at_junction(assembly.nodes)
    worst = int(np.argmax(assembly.at_junction(abs(x - problem.reference.x))))
    return f"at entry {worst}" if nodes is None else f"at {position(nodes[worst], nodes)}"


def read_answer(path: Path) -> dict[str, Vector]:
    """What the file holds: "x" (displacements) and "lam" (contact forces), or one of them.

    An .npz has arrays of the names in HEADINGS, a .csv columns, as nodes.csv and contacts.csv of `solve`;
    never both names of one vector. Raises InputError.
    """
    if path.suffix.lower() not in (".npz", ".csv"):
        raise InputError.one(path, "suffix", path.suffix, ALLOWED)
    regular_file(path, "file", MIB)
    try:
        if path.suffix.lower() == ".npz":
            with np.load(path, allow_pickle=False) as archive:
                names = archive.files
                found = _named(names, archive.__getitem__)
        else:
            columns = _columns(path)
            found = _named(names := list(columns), columns.__getitem__)
    except InputError:
        raise
    except Exception as error:  # numpy, zipfile and csv raise kinds of their own
        raise InputError.one(path, "file", damage(error), ALLOWED) from error
    if not found:
        wanted = " or ".join(each for headings in HEADINGS.values() for each in headings)
        raise InputError.one(path, "names", names, wanted)
    for name, vector in found.items():
        wrong = np.flatnonzero(~np.isfinite(vector))
        if len(wrong):
            allowed = f"must be a finite number; {len(wrong)} of {len(vector)} are not"
            raise InputError.one(path, f"{name}[{wrong[0]}]", float(vector[wrong[0]]), allowed)
    return found


def _columns(path: Path) -> dict[str, Vector]:
    """The columns of HEADINGS in a CSV file, by the rules of `problems.input.tables`. Raises InputError."""
    table = Cells.of(path, MIB, ())
    rows = table.rows()
    wanted = [name for names in HEADINGS.values() for name in names]
    heads = ([cell.lstrip("# ") for cell in cells] for _, cells in rows)
    header = next((cells for cells in heads if not {*wanted}.isdisjoint(cells)), [])
    names = [name for name in wanted if name in header]
    if twice := [name for name in names if header.count(name) > 1]:
        raise InputError.one(path, "names", twice, "each heading once")
    at = [header.index(name) for name in names]
    mark, read, index = table.decimal_mark(at), [], []
    for line, cells in rows:
        texts = [cells[k] if k < len(cells) else "" for k in at]
        read.append([number(text, mark)[0] for text in texts])
        if is_stray(header, cells) or not np.isfinite(read[-1]).all():
            allowed = (
                doubt(texts, mark) or f"every cell must be a finite number, one for each heading; {ALLOWED}"
            )
            raise InputError.one(path, f"line {line}", table.delimiter.join(cells), allowed)
        index.append(number(cells[0], mark)[0])
    ascending = sorted(index)
    if 0 not in at and index != ascending and (np.diff(ascending) == 1).all():
        raise InputError.one(path, "first column", header[0], "an index that ascends: sort the rows by it")
    return {name: np.array([row[k] for row in read]) for k, name in enumerate(names)}


def _named(names: list[str], read: Callable[[str], object]) -> dict[str, Vector]:
    """The vectors of HEADINGS among them. Raises ValueError."""
    found = {}
    for name, headings in HEADINGS.items():
        known = [each for each in headings if each in names]
        if len(known) > 1:
            raise ValueError(f"has {' and '.join(known)}: give one of them alone")
        if known:
            array = np.asarray(read(known[0]))
            if array.dtype.kind not in "fiu" or array.size != max(array.shape, default=1):
                raise ValueError(
                    f"{known[0]} is an array of {array.dtype} of shape {array.shape}, not a vector"
                )
            found[name] = array.astype(float).ravel()
    return found
