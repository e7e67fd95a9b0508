"""Matrices in and out: any scene as files of other programs, and their files as a scene's .npz."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp
from rich.console import Console

from harness.verification.reference import reference
from problems import formats
from problems.build import load_case, prepared
from problems.errors import Fault, InputError
from problems.forms.alteration import ALTERED
from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.input.user_matrices import read_matrices
from problems.scene import read_scene

from .few_digits import said_of_digits


def export(source: str, form: str, out: Path, console: Console) -> None:
    """Write K, A, f, g of a scene in a format of problems.formats. Raises InputError."""
    if form not in formats.WRITERS:
        raise InputError.one("--format", "format", form, f"one of {', '.join(formats.WRITERS)}")
    scene = read_scene(source)
    data = prepared(scene)
    load = load_case(scene)
    out.parent.mkdir(parents=True, exist_ok=True)
    formats.write(form, out, matrices(data, load))
    console.print(f"n = {data.assembly.n}, m = {data.assembly.m}: {out}, {formats.WRITERS[form]}.")


def matrices(data: Prepared, load: LoadCase) -> formats.Data:
    """K, A, f, g of a problem, and its nodes where they are known."""
    assembly = data.assembly
    K = sp.block_diag(assembly.blocks, format="csr")
    found = {"K": sp.csr_array(K), "A": sp.csc_array(assembly.A), "f": load.f, "g": load.g}
    return found | ({} if assembly.nodes is None else {"nodes": np.array(assembly.nodes)})


def import_(files: list[str], out: Path, console: Console) -> None:
    """Read K, A, f, g from files, check them, and write them as one .npz that a scene can be.

    files : paths, or NAME=PATH where the file of one matrix is not named by it. Raises InputError.
    """
    data: formats.Data = {}
    for file in files:
        name, _, path = file.rpartition("=")
        found = formats.read(Path(path))
        if name:
            found = {name: _meant(found, name, path)}
        if strange := [key for key in found if key not in formats.NAMES]:
            allowed = "K, A, f, g or nodes; say K=FILE where the file has another name"
            raise InputError([Fault(path, "matrix", key, allowed) for key in strange])
        data |= found
    if missing := [name for name in "KAfg" if name not in data]:
        raise InputError([Fault(", ".join(files), name, None, "is in none of the files") for name in missing])
    sparse = {name: sp.csr_array(data[name]) for name in "KA"}
    work = out.with_name(f".{out.stem}.tmp.npz")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        formats.write("npz", work, data | sparse)
        read_matrices({"problem": work})  # shapes, numbers, symmetry
        work.replace(out)
    finally:
        work.unlink(missing_ok=True)
    _checked(out, console)


def _meant(found: formats.Data, name: str, path: str) -> object:
    """The matrix that NAME=PATH asks for: the one of this name, or the only one that the file has."""
    if name not in found and len(found) != 1:
        raise InputError.one(path, "matrices", list(found), f"a matrix {name}, or one matrix alone")
    return found.get(name, next(iter(found.values())))


def _checked(out: Path, console: Console) -> None:
    """Definiteness, condition and digits of what was read, on the console."""
    scene = read_scene(str(out))
    try:
        data = prepared(scene)
        _ = data.Q
    except InputError:
        out.unlink()
        raise
    load = load_case(scene)
    blocks = " + ".join(str(len(K)) for K in data.assembly.blocks)
    console.print(f"{out}: n = {data.assembly.n} ({blocks}), m = {data.assembly.m}.")
    console.print(f"K is symmetric and positive definite, cond(K) = {data.facts['cond_K']:.2e}.")
    if data.assembly.altered:
        console.print(f"{ALTERED}.", style="yellow")
    known = reference(data, load)
    said, few = said_of_digits(data, known.x, known.lam)
    console.print(f"{said}.", style="yellow" if few else None)
