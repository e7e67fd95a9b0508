"""A scene as files for other programs: K, A, f, g, or a quadratic program with the accuracy to reach.

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
from problems import formats
from problems.errors import InputError
from problems.forms.assembly import LoadCase
from problems.forms.names import FORMS, Form
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.input import matrix_files
from problems.model.scene import MatricesScene, Scene
from problems.scene import read_scene

from .atomic_output import atomic_output

Arrays = dict[str, Any]


def export(
    source: str,
    format: str | None,
    out: Path,
    console: Console,
    form: Form | None = None,
    with_reference: bool = False,
    reference_limit_s: float | None = None,
) -> None:
    """Write K, A, f, g of a scene in a format of problems.formats; with a form, its quadratic program, as
    .npz if `out` ends in that, else as a folder of Matrix Market files. Raises InputError.
    """
    if form is None and with_reference:
        raise InputError.one("--with-reference", "form", None, "needs --form: primal, dual or sparse")
    if form is None and format not in formats.FORMATS:
        allowed = f"one of {', '.join(formats.FORMATS)}; none with --form"
        raise InputError.one("--format", "format", format, allowed)
    if form is not None and format is not None:
        allowed = (
            "none with --form: it holds K, A, f, g; PATH.npz is one file, any other PATH a folder of .mtx"
        )
        raise InputError.one("--format", "format", format, allowed)
    scene = read_scene(source)
    own = [path for _, path in scene.files] if isinstance(scene, MatricesScene) else []
    with atomic_output(out, [Path(source), *own]) as new:
        if format is not None:
            problem = opened(scene)
            data = matrices(problem.prepared, problem.load)
            formats.FORMATS[format].write(new, data)
            said = f"n = {len(data['f'])}, m = {len(data['g'])}, {formats.FORMATS[format].description}"
        elif form is not None:
            arrays, about = _program(source, scene, form, with_reference, reference_limit_s)
            (_write_npz if out.suffix == ".npz" else _write_mtx)(new, arrays, about)
            said = f"{form} form, {len(arrays['q'])} unknowns, {about['m']} contacts"
    console.print(f"{out}: {scene.name}, {said}.")


def matrices(data: Prepared, load: LoadCase) -> formats.Data:
    """K, A, f, g of a problem, and its nodes if they are known."""
    assembly = data.assembly
    found = {"K": sp.csr_array(assembly.K.matrix), "A": sp.csc_array(assembly.A), "f": load.f, "g": load.g}
    return found | ({} if assembly.nodes is None else {"nodes": np.array(assembly.nodes)})


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
    matrix_files.write(path, {name: np.array(value) for name, value in about.items()} | arrays)


def _write_mtx(path: Path, arrays: Arrays, about: Arrays) -> None:
    path.mkdir()
    for name, M in arrays.items():
        matrix = M if sp.issparse(M) or M.ndim == 2 else M[:, None]
        formats.text.write_one(path / f"{name}.mtx", matrix, "general")
    (path / "about.json").write_text(json.dumps(about, indent=1) + "\n", "utf-8")
