"""A scene as a quadratic program for another program to read, with its solution and the accuracy to reach.

    min ½zᵀPz + qᵀz   subject to   Gz ≤ h     primal: z = x, n displacements, mm; sparse: z = û, N unknowns
                                   z ≥ lb     dual: z = λ, m contact forces, N

P, q, G, h or lb; with the reference also x (mm), lam (the multipliers of Gz ≤ h, N), bound_mm, the proven
bound on max|x − x*|, and limit_mm, within which an answer has to be. As a folder of Matrix Market files, one
per array and with 17 digits, or as one .npz; about.json, or the texts in the .npz, say which problem it is.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from rich.console import Console

from harness.planning.form_choice import chosen_form
from harness.verification.judge import LIMIT_MM
from harness.verification.reference_problem import opened, reference_problem
from problems.errors import InputError
from problems.formats import text
from problems.forms.names import FORMS, Form
from problems.forms.problem import in_form
from problems.input import sparse_npz
from problems.model.scene import MatricesScene, Scene
from problems.scene import read_scene

from .atomic_output import atomic_output

FORMATS = ("mtx", "npz")
Arrays = dict[str, Any]


def export_form(
    source: str,
    form: Form,
    format: str | None,
    out: Path,
    console: Console,
    with_reference: bool = False,
    reference_limit_s: float | None = None,
) -> None:
    """Write a scene in a form, by default as .npz if `out` ends in that, else as Matrix Market files.

    Raises InputError.
    """
    format = format or ("npz" if out.suffix == ".npz" else "mtx")
    if format not in FORMATS:
        allowed = f"{' or '.join(FORMATS)} with --form; other formats hold K, A, f, g"
        raise InputError.one("--format", "format", format, allowed)
    scene = read_scene(source)
    own = [path for _, path in scene.files] if isinstance(scene, MatricesScene) else []
    with atomic_output(out, [Path(source), *own]) as new:
        arrays, about = _program(source, scene, form, with_reference, reference_limit_s)
        (_write_npz if format == "npz" else _write_mtx)(new, arrays, about)
    size = f"{len(arrays['q'])} unknowns, {about['m']} contacts"
    console.print(f"{scene.name}, {form} form, {size}: {out}")


def _program(
    source: str, scene: Scene, form: Form, with_reference: bool, limit_s: float | None
) -> tuple[Arrays, Arrays]:
    """Its arrays by name, and what it is of; refuses a dense one that this machine's memory cannot hold."""
    chosen_form(scene, FORMS, form)
    judged = reference_problem(source, limit_s=limit_s, form=form) if with_reference else opened(scene, form)
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
        known = judged.reference
        arrays |= {"x": known.x, "lam": known.lam, "bound_mm": np.array([known.bound_mm])}
        arrays["limit_mm"] = np.array([judged.limit_mm(LIMIT_MM)])
    about = {"scene": scene.name, "title": scene.title, "scene_key": scene.key, "form": form}
    return arrays, about | {"n": problem.assembly.n, "m": problem.assembly.m}


def _write_npz(path: Path, arrays: Arrays, about: Arrays) -> None:
    """Matrices of the sparse form as compressed columns, all others whole."""
    whole = about["form"] != "sparse"
    arrays = {name: M.toarray() if whole and sp.issparse(M) else M for name, M in arrays.items()}
    sparse_npz.write(path, {name: np.array(value) for name, value in about.items()} | arrays)


def _write_mtx(path: Path, arrays: Arrays, about: Arrays) -> None:
    path.mkdir()
    for name, M in arrays.items():
        matrix = M if sp.issparse(M) or M.ndim == 2 else M[:, None]
        text.write_one(path / f"{name}.mtx", matrix, "general")
    (path / "about.json").write_text(json.dumps(about, indent=1) + "\n", "utf-8")
