"""Writes a scene for other programs: K, A, f, g, or a quadratic program with the accuracy to reach.

    min ½zᵀPz + qᵀz   subject to   Gz ≤ h     primal: z = x, n displacements, mm; sparse: z = û, N unknowns
                                   z ≥ lb     dual: z = λ, m contact forces, N

The arrays are P, q, and G, h or lb; with the reference also x, lam (the multipliers of Gz ≤ h), unit_mm, the
length of one unit of each x, bound_mm, the proven bound on max|x − x*|·unit_mm, and limit_mm, the largest
error that an answer may have. Units are mm and N but on rungs in others. They are written as a folder of
Matrix Market files, one per array and with 17 digits, or as one .npz; about.json, or the texts in the .npz,
name the problem. MPS has P, q, G, h, lb. The programs of a suite are a test set of qpbenchmark, a Parquet
file.
"""

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import scipy.sparse as sp
from rich.console import Console

from harness.planning.form_choice import chosen_form
from harness.planning.suite import read_suite
from harness.results.atomic_output import EXPORTED, PROGRAM, atomic_output, refuse_unwritable
from harness.results.provenance import fingerprints
from harness.results.records import refuse_other_command, replace_text
from harness.terminal.console import console_of
from harness.verification.judge import LIMIT_MM
from harness.verification.reference_problem import measurable, open_problem
from problems import formats
from problems.errors import InputError
from problems.forms import FORMS, Form
from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.input import matrix_files
from problems.model.scene import Scene
from problems.reporter import SILENT, Reporter
from problems.scene_files import read_scene
from report.document.numbers import counted

from .solution import Source, load_scene

Arrays = dict[str, Any]
AT_ONCE = 2**20  # lines of a text
#: The columns of a test set, https://github.com/qpsolvers/qpbenchmark; matrices are dense, row by row.
TEST_SET = ("P", "q", "G", "h", "A", "b", "lb", "ub", "name")


def export(
    scene: Source,
    out: str | Path,
    *,
    format: str | None = None,
    form: Form | None = None,
    with_reference: bool = False,
    reference_limit_s: float | None = None,
    reporter: Reporter = SILENT,
) -> Path:
    """Write K, A, f, g of a scene in a file format, or its quadratic program in a form, or those of a suite.

    Parameters
    ----------
    scene : Scene, str, Path or dict
        The scene, its name, the path of its file, or its content; the name of a suite, where `out` is a
        .parquet.
    out : str or Path
        A file, or a folder for a format of several files; with a form .npz, .mps, .qps or a folder.
    format : str, optional
        Format of K, A, f, g: npz, mtx, op4, …; none if `form` is given.
    form : str, optional
        "primal", "dual" or "sparse": P, q, G, h (or lb) of min ½zᵀPz + qᵀz, Gz ≤ h, in N and mm.
    with_reference : bool, optional
        With a form: also x*, λ*, their error bound and the limit.
    reference_limit_s : float, optional
        Limit on the search for the reference, s.
    reporter : Reporter, optional
        With the console of a ConsoleReporter, what was written is shown; silent by default.

    Returns
    -------
    Path
        What was written.

    Raises
    ------
    InputError
        If the scene or a choice is wrong, or `out` has such files of something else.

    Examples
    --------
    >>> from rivetbench import export
    >>> export("gallery/installed-fasteners", "tips.npz", format="npz").exists()
    True
    """
    out = Path(out)
    if form is None and with_reference:
        raise InputError.one("--with-reference", "form", None, "needs --form: primal, dual or sparse")
    if reference_limit_s is not None and not with_reference:
        raise InputError.one("--reference-limit", "seconds", reference_limit_s, "needs --with-reference")
    if format not in ([None] if form else formats.FORMATS):
        allowed = f"one of {', '.join(formats.FORMATS)}; none with --form"
        if form:
            allowed = "none with --form: PATH.npz is one file, any other PATH a folder of .mtx"
        raise InputError.one("--format", "format", format, allowed)
    if with_reference and out.suffix in (".mps", ".qps", ".parquet"):
        raise InputError.one("--with-reference", "path", str(out), ".npz or a folder: it holds no answer")
    if form is not None and out.suffix == ".parquet":
        if not isinstance(scene, str | Path):
            allowed = "the name of a suite or its file: a .parquet has its scenes"
            raise InputError.one("SUITE", "name", load_scene(scene).name, allowed)
        return _write_test_set(str(scene), out, form, console_of(reporter))
    _refuse_suffix(out, formats.FORMATS[format or "npz"], form is not None)
    read = load_scene(scene)
    refuse_unwritable(out, read.sources)
    if form is not None and out.suffix not in WRITERS:
        refuse_other_command(out, PROGRAM, EXPORTED[1:])
    if format is not None:
        problem = open_problem(read, chosen_form(read, FORMS, None).form)
        data = matrices(problem.prepared, problem.load)
        with atomic_output(out, read.sources) as new:
            formats.FORMATS[format].write(new, data)
        content = f"n = {len(data['f'])}, m = {len(data['g'])}, {formats.FORMATS[format].description}"
    elif form is not None:
        arrays, about = _program(read, form, with_reference, reference_limit_s)
        with atomic_output(out, read.sources) as new:
            WRITERS.get(out.suffix, _write_mtx)(new, arrays, about)
        content = f"{form} form, {len(arrays['q'])} unknowns, {counted(about['m'], 'contact')}"
    last = f"stage {read.stages[-1].name}, " if read.stages else ""
    console_of(reporter).print(f"{out}: {read.name}, {last}{content}.")
    return out


def _refuse_suffix(out: Path, kind: formats.Format, program: bool) -> None:
    """Raise InputError for a folder named like a file, or a file named like one of another kind."""
    folder = out.suffix not in WRITERS if program else kind.is_folder
    if folder and out.suffix[1:2].isalpha():
        allowed = "no suffix: a folder is written" + f", or one file {', '.join(WRITERS)}" * program
        raise InputError.one("--out", "path", str(out), allowed)
    if not (folder or program) and out.suffix.lower() not in kind.suffixes:
        raise InputError.one("--out", "path", str(out), f"must end in {' or '.join(kind.suffixes)}")


def matrices(data: Prepared, load: LoadCase) -> formats.Data:
    """K, A, f, g of a problem, and its nodes if they are known."""
    K, A, nodes = data.assembly.K.matrix, data.assembly.A, data.assembly.nodes
    arrays = {"K": sp.csr_array(K), "A": sp.csc_array(A), "f": load.f, "g": load.g}
    return arrays if nodes is None else arrays | {"nodes": np.array(nodes)}


def _program(scene: Scene, form: Form, with_reference: bool, limit_s: float | None) -> tuple[Arrays, Arrays]:
    """The arrays of the quadratic program by name, and its facts. Raises InputError, also if a dense form
    does not fit into the memory of this machine.
    """
    chosen_form(scene, FORMS, form)
    judged = measurable(scene, limit_s=limit_s, form=form) if with_reference else open_problem(scene, form)
    problem = in_form(judged.prepared, form)
    (load,) = problem.loads([judged.load])
    blocks = problem.blocks
    P = blocks[0] if len(blocks) == 1 else sp.csc_array(sp.block_diag(blocks))
    arrays: Arrays = {"P": P, "q": problem.q(load)}
    if problem.G is None:
        arrays["lb"] = np.zeros(len(load.g))
    else:
        arrays |= {"G": problem.G, "h": problem.h(load)}
    if with_reference:
        reference, limit_mm = judged.reference, judged.limit_mm(LIMIT_MM)
        unit_mm = np.full(reference.x.shape, reference.unit_mm)
        arrays |= {"x": reference.x, "lam": reference.lam, "unit_mm": unit_mm}
        arrays |= {"bound_mm": np.array([reference.bound_mm]), "limit_mm": np.array([limit_mm])}
    about = {"scene": scene.name, "title": scene.title, "scene_key": scene.key, "form": form}
    return arrays, about | {"n": problem.assembly.n, "m": problem.assembly.m}


def _write_npz(path: Path, arrays: Arrays, about: Arrays) -> None:
    """Write the matrices of the sparse form as compressed columns, all others dense."""
    whole = about["form"] != "sparse"
    arrays = {name: M.toarray() if whole and sp.issparse(M) else M for name, M in arrays.items()}
    matrix_files.write(path, {name: np.array(value) for name, value in about.items()} | arrays)


def _write_mtx(path: Path, arrays: Arrays, about: Arrays) -> None:
    path.mkdir()
    for name, M in arrays.items():
        matrix = M if sp.issparse(M) or M.ndim == 2 else M[:, None]
        formats.matrix_text.write_one(path / f"{name}.mtx", matrix, "general")
    about = about | {"files": sorted([PROGRAM, *(f"{name}.mtx" for name in arrays)])}
    (path / PROGRAM).write_text(json.dumps(about, indent=1) + "\n", "utf-8")


def _write_mps(path: Path, arrays: Arrays, about: Arrays) -> None:
    """Write free MPS with QUADOBJ. Every column has its cost, also 0: readers take their order from these."""
    q, n = arrays["q"], len(arrays["q"])
    lb, h = arrays.get("lb", np.full(n, -np.inf)), arrays.get("h", np.zeros(0))
    P, G = sp.coo_array(sp.csc_array(sp.tril(arrays["P"]))), sp.coo_array(arrays.get("G", (0, n)))
    rows = np.array(["Obj", *(f"r{i}" for i in range(len(h)))], dtype=object)
    columns = np.array([f"c{j}" for j in range(n)], dtype=object)
    at_row, at_column = np.r_[np.zeros(n, dtype=int), 1 + G.row], np.r_[np.arange(n), G.col]
    order = np.argsort(at_column, kind="stable")

    def write(heading: str, *fields: Any) -> None:
        """Lines of fields; numbers with all of their digits."""
        file.write(f"{heading}\n")
        for start in range(0, len(fields[-1]), AT_ONCE):
            some = slice(start, start + AT_ONCE)
            table = {k: field if isinstance(field, str) else field[some] for k, field in enumerate(fields)}
            pd.DataFrame(table).to_csv(file, sep=" ", header=False, index=False)

    with path.open("w", encoding="ascii", newline="") as file:
        write("NAME\nROWS\n N Obj", "", "L", rows[1:])
        write("COLUMNS", "", columns[at_column][order], rows[at_row][order], np.r_[q, G.data][order])
        write("RHS", "", "RHS", rows[1:], h)
        write("BOUNDS", "", "FR", "BND", columns[np.isneginf(lb)])
        write("QUADOBJ", "", columns[P.col], columns[P.row], P.data)
        file.write("ENDATA\n")


WRITERS = {".npz": _write_npz, ".mps": _write_mps, ".qps": _write_mps}


def _write_test_set(suite: str, out: Path, form: Form, console: Console) -> Path:
    """Write the programs of the suite's scenes, one at a time, and beside them their SHA-256, as `sha256sum`
    does.
    """
    if not find_spec("pyarrow"):
        raise InputError.one("--out", "path", str(out), "needs pip install 'rivetbench[parquet]'")
    import pyarrow as pa
    import pyarrow.parquet as pq

    refuse_unwritable(out)
    scenes = [scene for scene in map(read_scene, read_suite(suite).scenes) if not scene.refused]
    names = [scene.name for scene in scenes]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError.one(suite, "scenes", twice, "names of their own: results are told apart by these")
    numbers = pa.list_(pa.float64())
    schema = pa.schema([(name, pa.string() if name == "name" else numbers) for name in TEST_SET])

    def line_of(scene: Scene) -> Any:
        """The program of a scene as a table of one line."""
        arrays, _ = _program(scene, form, False, None)
        columns = dict.fromkeys(TEST_SET, pa.nulls(1, numbers)) | {"name": pa.array([scene.name])}
        for name, M in arrays.items():
            values = np.ravel(M.toarray() if sp.issparse(M) else M).astype(float, copy=False)
            columns[name] = pa.ListArray.from_arrays([0, len(values)], pa.array(values))
        return pa.table(columns, schema=schema)

    with atomic_output(out) as new, pq.ParquetWriter(new, schema) as writer:
        for scene in scenes:
            writer.write_table(line_of(scene))
    digits = fingerprints([out])[out.name]
    replace_text(out.with_name(f"{out.name}.sha256"), f"{digits}  {out.name}\n")
    console.print(f"{out}: {counted(len(scenes), 'problem')}, {form} form, SHA-256 {digits}.")
    return out
