"""K, A, f, g from the files of other programs as a scene's .npz."""

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
from problems.forms.names import FORMS
from problems.input.user_matrices import NAMES, checked
from problems.scene import read_scene

from .atomic_output import atomic_output
from .validate import digits_sentence, print_facts


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
        problem = _opened(new, origin)
    print_facts(str(out), problem.prepared.assembly, console)
    about = ("about ", " in balanced units") if problem.form == "sparse" else ("", "")
    condition = f"{problem.prepared.condition:.1e}".join(about)
    console.print(f"K is symmetric and positive definite, cond(K) = {condition}.")
    sentence, few = digits_sentence(problem)
    console.print(f"{sentence}.", style="yellow" if few else None)


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


def _opened(path: Path, origin: dict[str, Path]) -> ReferenceProblem:
    """The problem in its cheaper form. Raises InputError, naming K's own file, if K is indefinite."""
    try:
        scene = read_scene(str(path))
        problem = opened(scene, chosen_form(scene, FORMS, None).form)
        _ = problem.prepared.assembly.K.factors
        return problem
    except InputError as error:
        raise InputError([replace(fault, where=str(origin["K"])) for fault in error.faults]) from error
