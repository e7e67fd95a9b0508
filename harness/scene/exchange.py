"""Exchange of matrices: any scene as files for other programs, and their files as a scene's .npz."""

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

from .few_digits import digits_sentence


def export(source: str, format: str, out: Path, console: Console) -> None:
    """Write K, A, f, g of a scene in a format of problems.formats. Raises InputError."""
    if format not in formats.names():
        raise InputError.one("--format", "format", format, f"one of {', '.join(formats.names())}")
    scene = read_scene(source)
    data = prepared(scene)
    load = load_case(scene)
    out.parent.mkdir(parents=True, exist_ok=True)
    formats.write(format, out, matrices(data, load))
    console.print(f"n = {data.assembly.n}, m = {data.assembly.m}: {out}, {formats.description(format)}.")


def matrices(data: Prepared, load: LoadCase) -> formats.Data:
    """K, A, f, g of a problem, and its nodes if they are known."""
    assembly = data.assembly
    K = sp.block_diag(assembly.blocks, format="csr")
    found = {"K": sp.csr_array(K), "A": sp.csc_array(assembly.A), "f": load.f, "g": load.g}
    return found | ({} if assembly.nodes is None else {"nodes": np.array(assembly.nodes)})


def import_(files: list[str], out: Path, console: Console) -> None:
    """Read K, A, f, g from files, check them, and write them as one .npz, which is a scene.

    files : paths, or NAME=PATH if the matrix has another name in its file. Raises InputError.
    """
    data: formats.Data = {}
    for file in files:
        name, _, path = file.rpartition("=")
        found = formats.read(Path(path))
        if name:
            found = {name: _named(found, name, path)}
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
    _print_facts(out, console)


def _named(found: formats.Data, name: str, path: str) -> object:
    """The matrix meant by NAME=PATH: the one of this name, or the only one in the file."""
    if name not in found and len(found) != 1:
        raise InputError.one(path, "matrices", list(found), f"a matrix {name}, or one matrix alone")
    return found.get(name, next(iter(found.values())))


def _print_facts(out: Path, console: Console) -> None:
    """Print size, definiteness, condition and digits of what was read."""
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
    sentence, few = digits_sentence(data, known.x, known.lam)
    console.print(f"{sentence}.", style="yellow" if few else None)
