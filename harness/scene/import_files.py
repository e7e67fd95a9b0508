"""Reads K, A, f, g from other programs' files and writes them as a scene's .npz."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from harness.planning.form_choice import chosen_form
from harness.results.atomic_output import atomic_output
from harness.terminal.console import console_of
from harness.verification.reference_problem import ReferenceProblem, open_problem
from problems import formats
from problems.errors import Fault, InputError
from problems.forms import FORMS
from problems.input.user_matrices import NAMES, checked
from problems.reporter import SILENT, Reporter
from problems.scene_files import read_scene

from .validate import digits_sentence, print_facts


def import_matrices(
    files: str | Path | Sequence[str | Path], out: str | Path, *, reporter: Reporter = SILENT
) -> Path:
    """Read K, A, f, g from other programs' files, check them, and write them as one .npz, which is a scene.

    Parameters
    ----------
    files : str, Path or sequence of these
        PATH, NAME=PATH for a file of one matrix, NAME=PATH:MATRIX for one of several. K is in N/mm, f in N,
        g in mm.
    out : str or Path
        The .npz to write.
    reporter : Reporter, optional
        With the console of a ConsoleReporter, sizes and digits are shown; silent by default.

    Returns
    -------
    Path
        The .npz, which `load_scene` reads.

    Raises
    ------
    InputError
        If a file is wrong, or K is not symmetric and positive definite.

    Examples
    --------
    >>> from rivetbench import export, import_matrices
    >>> op4 = export("gallery/installed-fasteners", "tips.op4", format="op4")
    >>> import_matrices(op4, "mine.npz").name
    'mine.npz'
    """
    out, console = Path(out), console_of(reporter)
    if out.suffix != ".npz":
        raise InputError.one("--out", "path", str(out), "must end in .npz, which makes it a scene")
    given = [files] if isinstance(files, str | Path) else files
    sources = [_source(str(file)) for file in given]
    with atomic_output(out, [path for _, path, _ in sources]) as new:
        data, origin, notes = _read_all(sources)
        checked(data, {name: str(path) for name, path in origin.items()}, sparse=True)
        formats.FORMATS["npz"].write(new, data | {name: sp.csr_array(data[name]) for name in "KA"})
        problem = _opened(new, origin)
    print_facts(str(out), problem.prepared.assembly, console)
    for note in notes:
        console.print(note, style="yellow")
    about = ("about ", " in balanced units") if problem.form == "sparse" else ("", "")
    condition = f"{problem.prepared.condition:.1e}".join(about)
    console.print(f"K is symmetric and positive definite, cond(K) = {condition}.")
    sentence, few = digits_sentence(problem, solved=False)
    console.print(f"{sentence}.", style="yellow" if few else None)
    return out


def _source(text: str) -> tuple[str, Path, str]:
    """The parts of [NAME=]PATH[:MATRIX]. A path may hold both signs, such as run=3/K.mtx and C:\\K.mtx."""
    name, _, path = text.partition("=")
    if name not in NAMES or Path(text).exists():
        name, path = "", text
    file, _, matrix = path.rpartition(":")
    if len(file) < 2 or Path(path).exists() or set(matrix) & set("/\\"):
        return name, Path(path), ""
    return name, Path(file), matrix


def _read_all(sources: list[tuple[str, Path, str]]) -> tuple[formats.Data, dict[str, Path], list[str]]:
    """K, A, f, g and perhaps nodes, their files, and sentences on what may be meant otherwise.

    A matrix named in the command overrides one of that name in another file.
    """
    data: formats.Data = {}
    origin: dict[str, Path] = {}
    faults: list[Fault] = []
    notes: list[str] = []
    rows = ""
    for named in (False, True):
        of_rank: dict[str, Path] = {}
        for name, path, matrix in (source for source in sources if bool(source[0]) == named):
            if name:
                read = {name: formats.read_stiffness(path, matrix, name)[:2]}
            else:
                read = formats.read_labelled(path, partial(_of_problem, faults, path, matrix))
            for key, (values, labels) in read.items():
                if key in of_rank:
                    allowed = f"is in {of_rank[key]} too; say {key}=FILE for the one that counts"
                    faults.append(Fault(str(path), "matrix", key, allowed))
                data[key] = formats.vector(values) if key in ("f", "g") else values
                if key == "K":
                    rows = _order(labels)
            of_rank |= dict.fromkeys(read, path)
        origin |= of_rank
    for name, matrix, axis in (("f", "K", 0), ("g", "A", 1)):
        if name not in data and matrix in data and formats.format_of(origin[matrix]).omits_zeros:
            data[name], origin[name] = np.zeros(data[matrix].shape[axis]), origin[matrix]
            notes.append(f"{name} is in none of the files: zero, as {origin[matrix]} leaves zeros out.")
    files = ", ".join(str(path) for _, path, _ in sources)
    faults += [Fault(files, name, None, "is in none of the files") for name in "KAfg" if name not in data]
    if faults:
        raise InputError(faults)
    if rows and not origin["A"] == origin["f"] == origin["K"]:
        notes.append(rows)
    return data, origin, notes


def _of_problem(faults: list[Fault], path: Path, matrix: str, names: Sequence[str]) -> list[str]:
    """Those names that a problem has, or `matrix` alone; the others are added to the faults."""
    allowed = "K, A, f, g or nodes; say K=FILE, or K=FILE:NAME where the matrix has another name"
    wanted = [matrix] if matrix else names
    wrong = [name for name in wanted if name not in NAMES or name not in names]
    faults += [Fault(str(path), "matrix", name, allowed) for name in wrong]
    return [name for name in wanted if name not in wrong]


def _order(labels: formats.Labels) -> str:
    """The order of the rows of a labelled K, unless it is plain: nodes 1 … n, each with the same dof."""
    if labels is None or labels.tolist() == [[k + 1, labels[0, 1]] for k in range(len(labels))]:
        return ""
    first, last = ("node {}, dof {}".format(*labels[k]) for k in (0, -1))
    return f"Rows of K ascend by node, then dof, from {first} to {last}: those of A and f must, too."


def _opened(path: Path, origin: dict[str, Path]) -> ReferenceProblem:
    """The problem in its cheaper form. Raises InputError, naming K's own file, if K is indefinite."""
    try:
        scene = read_scene(str(path))
        problem = open_problem(scene, chosen_form(scene, FORMS, None).form)
        problem.prepared.assembly.K.ensure_factored()
        return problem
    except InputError as error:
        raise InputError([replace(fault, where=str(origin["K"])) for fault in error.faults]) from error
