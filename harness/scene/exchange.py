"""Exchange of matrices: any scene as files for other programs, and their files as a scene's .npz."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from rich.console import Console

from harness.planning.form_choice import chosen_form
from harness.verification.reference_problem import ReferenceProblem, opened
from problems import formats
from problems.errors import Fault, InputError
from problems.forms.assembly import LoadCase
from problems.forms.names import FORMS
from problems.forms.prepared import Prepared
from problems.input.user_matrices import NAMES, checked
from problems.model.scene import MatricesScene
from problems.scene import read_scene

from .atomic_output import atomic_output
from .few_digits import digits_sentence


def places(sources: list[str], out: Path, format: str) -> list[tuple[str, Path]]:
    """Each scene with the path to write it to: `out` itself, or one per scene inside it. Raises InputError if
    two would have the same.
    """
    if len(sources) == 1:
        return [(sources[0], out)]
    suffix = formats.FORMATS[format].suffix if format in formats.FORMATS else ""
    found: dict[Path, str] = {}
    for source in sources:
        path = out / (read_scene(source).name.replace("/", "_") + suffix)
        if path in found:
            raise InputError.one("SCENE", "name", source, f"{found[path]} would be written to {path} as well")
        found[path] = source
    return [(source, path) for path, source in found.items()]


def export(source: str, format: str, out: Path, console: Console) -> None:
    """Write K, A, f, g of a scene in a format of problems.formats. Raises InputError."""
    if format not in formats.FORMATS:
        raise InputError.one("--format", "format", format, f"one of {', '.join(formats.FORMATS)}")
    scene = read_scene(source)
    own = [path for _, path in scene.files] if isinstance(scene, MatricesScene) else []
    with atomic_output(out, [Path(source), *own]) as new:
        problem = opened(scene)
        formats.FORMATS[format].write(new, matrices(problem.prepared, problem.load))
    size = f"n = {problem.prepared.assembly.n}, m = {problem.prepared.assembly.m}"
    console.print(f"{size}: {out}, {formats.FORMATS[format].description}.")


def matrices(data: Prepared, load: LoadCase) -> formats.Data:
    """K, A, f, g of a problem, and its nodes if they are known."""
    assembly = data.assembly
    found = {"K": sp.csr_array(assembly.K.matrix), "A": sp.csc_array(assembly.A), "f": load.f, "g": load.g}
    return found | ({} if assembly.nodes is None else {"nodes": np.array(assembly.nodes)})


def import_(files: list[str], out: Path, console: Console) -> None:
    """Read K, A, f, g from files, check them, and write them as one .npz, which is a scene.

    files : paths, or NAME=PATH if the matrix has another name in its file; their order does not matter.
    Raises InputError, with what is at `out` unchanged.
    """
    if out.suffix != ".npz":
        raise InputError.one("--out", "path", str(out), "must end in .npz, which makes it a scene")
    given = [(name, Path(path)) for name, _, path in (file.rpartition("=") for file in files)]
    with atomic_output(out, [path for _, path in given]) as new:
        data, origin = _read_all(given)
        checked(data, {name: str(path) for name, path in origin.items()}, sparse=True)
        formats.FORMATS["npz"].write(new, data | {name: sp.csr_array(data[name]) for name in "KA"})
        used = _refuse_unusable(new, origin)
    _print_facts(out, used, console)


def _read_all(given: list[tuple[str, Path]]) -> tuple[formats.Data, dict[str, Path]]:
    """K, A, f, g and perhaps nodes, and the file that each comes from; what is named overrides the rest."""
    data: formats.Data = {}
    origin: dict[str, Path] = {}
    faults: list[Fault] = []
    for named in (False, True):
        of_rank: dict[str, Path] = {}
        for name, path in given:
            if bool(name) != named:
                continue
            found = formats.read(path)
            if name:
                matrix = _named(found, name, path)
                found = {name: formats.vector(matrix) if name in ("f", "g") else matrix}
            for key in found:
                if key not in NAMES:
                    allowed = "K, A, f, g or nodes; say K=FILE where the file has another name"
                    faults.append(Fault(str(path), "matrix", key, allowed))
                elif key in of_rank:
                    allowed = f"is in {of_rank[key]} too; say {key}=FILE for the one that counts"
                    faults.append(Fault(str(path), "matrix", key, allowed))
            data |= found
            of_rank |= dict.fromkeys(found, path)
        origin |= of_rank
    for name, matrix, axis in (("f", "K", 0), ("g", "A", 1)):
        if name not in data and matrix in data and formats.format_of(origin[matrix]).omits_zeros:
            data[name], origin[name] = np.zeros(data[matrix].shape[axis]), origin[matrix]
    files = ", ".join(str(path) for _, path in given)
    faults += [Fault(files, name, None, "is in none of the files") for name in "KAfg" if name not in data]
    if faults:
        raise InputError(faults)
    return data, origin


def _named(found: formats.Data, name: str, path: Path) -> object:
    """The matrix meant by NAME=PATH: the one of this name, or the only one in the file."""
    if name not in found and len(found) != 1:
        raise InputError.one(path, "matrices", list(found), f"a matrix {name}, or one matrix alone")
    return found.get(name, next(iter(found.values())))


def _refuse_unusable(path: Path, origin: dict[str, Path]) -> ReferenceProblem:
    """The problem in its cheaper form. Raises InputError, naming K's own file, if K is indefinite."""
    try:
        scene = read_scene(str(path))
        problem = opened(scene, chosen_form(scene, FORMS, None).form)
        _ = problem.prepared.assembly.K.factors
        return problem
    except InputError as error:
        raise InputError([replace(fault, where=str(origin["K"])) for fault in error.faults]) from error


def _print_facts(out: Path, problem: ReferenceProblem, console: Console) -> None:
    """Print size, definiteness, condition and digits of what was read."""
    assembly = problem.prepared.assembly
    blocks = " + ".join(str(K.shape[0]) for K in assembly.K.matrices)
    console.print(f"{out}: n = {assembly.n} ({blocks}), m = {assembly.m}.")
    about = ("about ", " in balanced units") if problem.form == "sparse" else ("", "")
    condition = f"{problem.prepared.condition:.1e}".join(about)
    console.print(f"K is symmetric and positive definite, cond(K) = {condition}.")
    for note in assembly.notes:
        console.print(f"{note}.", style="yellow")
    sentence, few = digits_sentence(problem)
    console.print(f"{sentence}.", style="yellow" if few else None)
