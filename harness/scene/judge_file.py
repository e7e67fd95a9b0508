"""Judges an answer that another program has computed: x or λ from a .npz or .csv file."""

from collections.abc import Mapping
from math import inf, nan
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from harness.planning.form_choice import form_of_answer
from harness.results.comparison import Incomparable
from harness.terminal import DONE, FAILED, NOTHING_JUDGED
from harness.terminal.console import STYLES
from harness.verification.assess import error_bound
from harness.verification.judge import Judgement
from harness.verification.reference_problem import ReferenceProblem, measurable
from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import Assembly, Vector
from problems.input.bounded_types import regular_file
from problems.input.matrix_files import reading
from problems.input.tables import Cells, doubt, is_stray, number
from problems.model.scene import JointScene
from problems.scene_files import read_scene
from report.document.numbers import error_beside, limit_beside, position, proven_to, upwards

LARGEST_MIB = 1024
#: The vectors of an answer, by their names in a file.
VECTORS = {"x": "x", "displacement_mm": "x", "lam": "lam", "force_N": "lam"}
SHOWN = "displacement_mm"  # of nodes.csv, along the normals
PLACES = ("x_mm", "y_mm")
SAME_PLACE = 1e-6  # of the extent of the nodes
ALLOWED = "a .npz or .csv file with numbers"
CODES = {"within": DONE, "outside": FAILED, "cannot_be_judged": NOTHING_JUDGED}


def judge_file(
    path: Path,
    source: str,
    form: Form | None,
    limit_mm: float,
    console: Console,
    reference_limit_s: float | None = None,
) -> int:
    """Print the verdict on the answer in a file; returns 0 within the limit, 1 outside, 3 if not known.

    x (n,) mm, in the sparse form all N unknowns; where there is only λ (m,) N, x = K⁻¹(f − Aλ). form : see
    `form_of_answer`. Raises InputError, Incomparable if a vector is of another length.
    """
    if not 0 < limit_mm < inf:
        raise InputError.one("--limit", "limit, mm", limit_mm, "must be positive and finite")
    answer, scene = read_answer(path), read_scene(source)
    form = form_of_answer(scene, form)
    problem = measurable(scene, limit_s=reference_limit_s, form=form)
    assembly = problem.prepared.assembly
    if SHOWN in answer and isinstance(scene, JointScene) and scene.joint.shown is not None:
        allowed = "x, all unknowns of K, as `unknowns` of solution.npz: these are displacements along normals"
        raise InputError.one(path, "names", SHOWN, allowed)
    for name, size in (("x", assembly.n), ("lam", assembly.m)):
        if name in answer and len(answer[name]) != size:
            allowed = f"{size} in the {form} form of {problem.scene.name}; name another form with --form"
            raise Incomparable.one(path, f"length of {name}", len(answer[name]), allowed)
    refuse_other_places(path, answer, assembly)
    lam = answer.get("lam", np.full(assembly.m, np.nan))
    x = answer["x"] if "x" in answer else _recovered(path, problem, lam)
    limit = problem.limit_mm(limit_mm)
    judgement, bound = problem.judged(x, lam, limit), problem.reference.bound_mm
    console.print(_table(problem, judgement, x, limit))
    shown = limit_beside(judgement.displacement_error_mm, limit)
    text = f"{judgement.verdict.capitalize()} {shown} mm."
    if judgement.verdict == "cannot_be_judged":
        how = problem.reference.route
        text = f"Cannot be judged: the reference is {proven_to(bound)} ({how})."
    console.print(text, style=STYLES[judgement.verdict])
    return CODES[judgement.verdict]


def _recovered(path: Path, problem: ReferenceProblem, lam: Vector) -> Vector:
    """x = K⁻¹(f − Aλ), (n,) mm. Raises InputError if it overflows, as of a λ that means no value."""
    with np.errstate(over="ignore", invalid="ignore"):
        x = problem.prepared.recover(lam, problem.load)
    if not np.isfinite(x).all():
        k = int(np.argmax(abs(lam)))
        raise InputError.one(path, f"lam[{k}]", float(lam[k]), "forces whose displacements do not overflow")
    return x


def _table(problem: ReferenceProblem, judgement: Judgement, x: Vector, limit_mm: float) -> Table:
    """The judge's figures, and where the largest error is."""
    error, bound = judgement.displacement_error_mm or 0.0, problem.reference.bound_mm
    assembly = problem.prepared.assembly
    away = abs(x - problem.reference.x) * problem.reference.unit_mm
    nodes, worst = assembly.at_junction(assembly.nodes), int(np.argmax(assembly.at_junction(away)))
    at = f"entry {worst}" if nodes is None else position(nodes[worst], nodes)
    table = Table("figure", "value", title=f"{problem.scene.name}: the answer judged")
    table.add_row("largest displacement error, mm", f"{error_beside(limit_mm, error)} at {at}")
    table.add_row("proven: every displacement within, mm", upwards(error_bound(error, bound), 4))
    table.add_row("error bound of the reference, mm", upwards(bound))
    table.add_row("contacts open or closed by mistake", str(judgement.contact_mismatch))
    table.add_row("largest overlap, mm", f"{judgement.primal_residual or 0.0:.3e}")
    if judgement.dual_residual is not None:
        table.add_row("largest unbalanced force, N", f"{judgement.dual_residual:.3e}")
        table.add_row("duality gap, N·mm", f"{judgement.duality_gap:.3e}")
    return table


def read_answer(path: Path) -> dict[str, Vector]:
    """The vectors of a file by name: "x" (displacements) and "lam" (contact forces), or one of them; SHOWN if
    x had that name; and the PLACES of a .csv that has them.

    An .npz has arrays of the names in VECTORS, a .csv columns, as nodes.csv and contacts.csv of `solve`;
    never both names of one vector. x of solution.npz is `unknowns` if that is beside it. Raises InputError.
    """
    if path.suffix.lower() not in (".npz", ".csv"):
        raise InputError.one(path, "suffix", path.suffix, ALLOWED)
    regular_file(path, "file", LARGEST_MIB)
    with reading(path, "file", ALLOWED):
        if path.suffix.lower() == ".csv":
            arrays: Mapping[str, Any] = _columns(path)
        else:
            with np.load(path, allow_pickle=False) as archive:
                names = {name: name for name in VECTORS if name in archive.files}
                if "x" in names and "unknowns" in archive.files:
                    names["x"] = "unknowns"
                arrays = {name: np.asarray(archive[stored]) for name, stored in names.items()}
    vectors: dict[str, Vector] = {}
    for heading, array in arrays.items():
        if array.dtype.kind not in "fiu" or array.size != max(array.shape, default=1):
            raise InputError.one(path, heading, f"{array.dtype}, {array.shape}", "a vector of numbers")
        vector = array.astype(float).ravel()
        wrong = np.flatnonzero(~np.isfinite(vector))
        if len(wrong):
            allowed = f"must be a finite number; {len(wrong)} of {len(vector)} are not"
            raise InputError.one(path, f"{heading}[{wrong[0]}]", float(vector[wrong[0]]), allowed)
        vectors[VECTORS.get(heading, heading)] = vector
    if not vectors or len(vectors) < len(arrays):
        allowed = "x or displacement_mm, lam or force_N: one of them alone"
        raise InputError.one(path, "names", list(arrays), allowed)
    return vectors | ({SHOWN: vectors["x"]} if SHOWN in arrays else {})


def refuse_other_places(path: Path, answer: Mapping[str, Vector], assembly: Assembly) -> None:
    """Raise InputError if a CSV file with x_mm and y_mm has its rows in another order than the scene."""
    nodes = assembly.at_junction(assembly.nodes) if "x" in answer else assembly.contact_nodes
    if nodes is None or not {*PLACES} <= answer.keys() or len(answer[PLACES[0]]) != len(nodes):
        return
    told = np.column_stack([answer[heading] for heading in PLACES])
    away = abs(told - nodes).max(axis=1) > SAME_PLACE * np.ptp(nodes, axis=0).max()
    for k in np.flatnonzero(away)[:1]:
        allowed = f"the scene has {position(nodes[k], nodes)} there: rows in its order"
        raise InputError.one(path, f"row {k + 1}, place", position(told[k], nodes), allowed)


def _columns(path: Path) -> dict[str, Vector]:
    """The columns of VECTORS and PLACES in a CSV file, by the rules of `problems.input.tables`.

    Raises InputError.
    """
    table = Cells.of(path, LARGEST_MIB, ())
    rows = table.rows()
    heads = ([cell.lstrip("# ") for cell in cells] for _, cells in rows)
    header = next((cells for cells in heads if not {*VECTORS}.isdisjoint(cells)), [])
    names = [name for name in (*VECTORS, *PLACES) if name in header]
    if twice := [name for name in names if header.count(name) > 1]:
        raise InputError.one(path, "names", twice, "each heading once")
    at = [header.index(name) for name in names]
    mark, read, index = table.decimal_mark(at), [], []
    of_index = header.index("index") if "index" in header else 0
    for line, cells in rows:
        texts = [cells[k] if k < len(cells) else "" for k in at]
        read.append([number(text, mark)[0] for text in texts])
        if is_stray(header, cells) or not np.isfinite(read[-1]).all():
            allowed = (
                doubt(texts, mark) or f"every cell must be a finite number, one for each heading; {ALLOWED}"
            )
            raise InputError.one(path, f"line {line}", table.delimiter.join(cells), allowed)
        index.append(number(cells[of_index], mark)[0] if of_index < len(cells) else nan)
    ascending = sorted(index)
    if of_index not in at and index != ascending and (np.diff(ascending) == 1).all():
        allowed = "an index that ascends: sort the rows by it"
        raise InputError.one(path, f"column {of_index + 1}", header[of_index], allowed)
    return {name: np.array([row[k] for row in read]) for k, name in enumerate(names)}
