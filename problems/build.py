"""From a scene to matrices: data preparation once an assembly, from the cache where it stands there."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
from scipy.linalg import lapack
from scipy.sparse.linalg import LinearOperator, eigsh

from problems.condensation import condense
from problems.condensation.condense import NotPositiveDefinite
from problems.fem import hermite, plate
from problems.forms import assembly
from problems.forms.assembly import Assembly, LoadCase, Matrix, Prepared, Vector
from problems.input import user_matrices as matrices
from problems.input.user_matrices import read_matrices
from problems.model import joint
from problems.model.effect import ForceEffect, GapEffect
from problems.model.joint import Joint, Part
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from .errors import InputError
from .scene import Scene

Progress = Callable[[str, float], None]
LARGEST_CONDITION = 1e14  # beyond it a displacement has no digit that can be vouched for


def prepared(scene: Scene, progress: Progress = lambda text, fraction: None) -> Prepared:
    """K, A, the Cholesky factors of K and Q of a scene: memory-mapped from the cache, or built.

    Raises InputError where K is not positive definite or worse conditioned than 1e14.
    """
    key = cache_key(scene)
    found = cache.load(key)
    if found is None:
        with cache.lock(key):
            found = cache.load(key)
            if found is None:
                cache.store(key, *_build(scene, progress))
                found = cache.load(key)
    assert found is not None
    return _open(*found)


def load_case(scene: Scene, prepared: Prepared) -> LoadCase:
    """f and g of a scene: the sum of its effects' terms."""
    if scene.made:
        return scene.made.load
    if scene.joint is None:
        return read_matrices(dict(scene.matrices))[1]
    f, g = np.zeros(prepared.assembly.n), np.zeros(prepared.assembly.m)
    for effect in scene.effects:
        if isinstance(effect, ForceEffect):
            f += effect.force(scene.joint)
        elif isinstance(effect, GapEffect):
            g += effect.gap(scene.joint)
    return LoadCase(f, g)


def cache_key(scene: Scene) -> str:
    """The hash of what made the matrices: the scene's data and the code that builds from it."""
    effects = [inspect.getmodule(type(effect)) for effect in scene.stiffness_effects]
    modules = [assembly, condense, hermite, joint, matrices, plate, inspect.getmodule(prepared), *effects]
    return cache.digest(scene.assembly_key, fingerprint(Path(inspect.getfile(m)) for m in modules if m))


def _build(scene: Scene, progress: Progress) -> tuple[dict[str, Matrix], dict[str, Any]]:
    seconds: dict[str, float] = {}
    start = time.perf_counter()

    def lap(step: str) -> None:
        nonlocal start
        seconds[step] = time.perf_counter() - start
        start = time.perf_counter()

    if scene.made:
        made = scene.made.assembly
    elif scene.joint is None:
        made = read_matrices(dict(scene.matrices))[0]
    else:
        made = _assemble(scene, scene.joint, progress)
    lap("condensation")
    progress("Cholesky factors of K", 0.0)
    factors = tuple(factor(K, name, scene) for K, name in zip(made.blocks, made.parts, strict=True))
    lap("cholesky")
    progress("condition number", 0.0)
    spectrum = [extreme_eigenvalues(K, U) for K, U in zip(made.blocks, factors, strict=True)]
    lambda_min, lambda_max = min(s[0] for s in spectrum), max(s[1] for s in spectrum)
    if lambda_max > LARGEST_CONDITION * lambda_min:
        raise indefinite(scene, "cond(K)", lambda_max / lambda_min if lambda_min > 0 else np.inf)
    lap("condition")
    progress("Q = AᵀK⁻¹A", 0.0)
    Q = schur(made, factors)
    if scene.joint is None and made.m:
        _check_independent(Q, scene)
    lap("Q")

    arrays = {"A_data": made.A.data, "A_indices": made.A.indices, "A_indptr": made.A.indptr, "Q": Q}
    if made.nodes is not None:
        arrays["nodes"] = made.nodes
    for k, (K, U) in enumerate(zip(made.blocks, factors, strict=True)):
        arrays |= {f"K{k}": K, f"U{k}": U}
    facts = {
        "n": made.n,
        "m": made.m,
        "parts": made.parts,
        "cond_K": lambda_max / lambda_min,
        "lambda_min": lambda_min,
        "lambda_max": lambda_max,
        "cond_blocks": [s[1] / s[0] for s in spectrum],
        "seconds": seconds,
    }
    return arrays, facts


def _open(arrays: dict[str, Matrix], facts: dict[str, Any]) -> Prepared:
    shape = (facts["n"], facts["m"])
    A = sp.csc_array((arrays["A_data"], arrays["A_indices"], arrays["A_indptr"]), shape=shape)
    parts = tuple(facts["parts"])
    K, U = ([arrays[f"{letter}{k}"] for k in range(len(parts))] for letter in "KU")
    return Prepared(Assembly(tuple(K), A, arrays.get("nodes"), parts), tuple(U), arrays["Q"], facts)


def _assemble(scene: Scene, joint: Joint, progress: Progress) -> Assembly:
    blocks = []
    for part in joint.part:
        try:
            blocks.append(_condensed(scene, joint, part, progress))
        except NotPositiveDefinite as error:
            raise indefinite(scene, f"part.{part.name}", str(error)) from error
    nodes = np.tile(joint.nodes, (len(joint.part), 1))
    return Assembly(tuple(blocks), joint.contact_matrix(), nodes, tuple(part.name for part in joint.part))


def _condensed(scene: Scene, joint: Joint, part: Part, progress: Progress) -> Matrix:
    """The part's stiffness on the deflections of the junction nodes, x running fastest."""
    model = joint.plate(part)
    K = model.stiffness()
    for effect in scene.stiffness_effects:
        if effect.part == part.name:
            K = K + effect.stiffness(model)
    free = [k for k in range(len(model.y)) if not _is_clamped(k, model.y, part)]
    # Eliminate from the longer extension inwards, so that the front stays narrow for longest.
    inside = [k for k in free if -1e-9 <= model.y[k] <= joint.junction.width * (1 + 1e-12)]
    northwards = inside[0] - free[0] >= free[-1] - inside[-1]
    order = free if northwards else free[::-1]
    keep = np.zeros(model.size, dtype=bool)
    for k in inside:
        keep[model.deflection_dofs(k)] = True
    lines = [model.line_dofs(k) for k in order]
    text = f"condensing {part.name}"
    S = condense.condense(sp.csr_array(K), lines, keep, lambda done: progress(text, done))
    if not northwards:  # lines came in descending y
        nx = len(model.x)
        ascending = np.arange(len(S)).reshape(-1, nx)[::-1].ravel()
        S = S[np.ix_(ascending, ascending)]
    return np.asfortranarray((S + S.T) / 2)


def _is_clamped(line: int, y: Matrix, part: Part) -> bool:
    return (line == 0 and "south" in part.clamped) or (line == len(y) - 1 and "north" in part.clamped)


def factor(K: Matrix, part: str, scene: Scene) -> Matrix:
    """U with K = UᵀU. Raises InputError where K is not positive definite."""
    try:
        return sla.cholesky(K, check_finite=False)
    except np.linalg.LinAlgError as error:
        raise indefinite(scene, f"K of {part}", str(error)) from error


def _check_independent(Q: Matrix, scene: Scene) -> None:
    """A's columns must be independent: a pivot of Q over its diagonal entry is what sets one apart."""
    U, info = lapack.dpotrf(Q)
    independence = np.diag(U) ** 2 / np.diag(Q)
    if info != 0 or independence.min() < len(Q) * np.finfo(float).eps:
        column = info - 1 if info else int(independence.argmin())
        own = dict(scene.matrices)
        where = own.get("problem") or own.get("A") or f"scene {scene.name}"
        allowed = "must not depend on the columns before it"
        raise InputError.one(where, f"A[:, {column}]", "dependent", allowed)


def indefinite(scene: Scene, key: str, value: object) -> InputError:
    """What is said of a scene whose K is not positive definite."""
    allowed = "K must be positive definite: is a part held against every rigid motion?"
    own = dict(scene.matrices)
    return InputError.one(own.get("problem") or own.get("K") or f"scene {scene.name}", key, value, allowed)


def extreme_eigenvalues(K: Matrix, U: Matrix) -> tuple[float, float]:
    """λmin and λmax of K by Lanczos on K⁻¹ and K (dense where K is tiny)."""
    n = len(K)
    if n < 50:
        values = np.linalg.eigvalsh(K)
        return float(values[0]), float(values[-1])

    def solve(b: Vector) -> Vector:
        return sla.cho_solve((U, False), b, check_finite=False)

    v0 = np.random.default_rng(0).standard_normal(n)
    inverse = LinearOperator((n, n), matvec=solve, dtype=float)
    largest, smallest_inverse = (
        eigsh(op, 1, which="LA", v0=v0, tol=1e-6, return_eigenvectors=False)[0] for op in (K, inverse)
    )
    return float(1 / smallest_inverse), float(largest)


def schur(made: Assembly, factors: tuple[Matrix, ...]) -> Matrix:
    """Q = Σ A_iᵀ K_i⁻¹ A_i with K_i⁻¹ from its Cholesky factor."""
    Q = np.zeros((made.m, made.m))
    if made.m == 0:
        return Q
    for U, rows in zip(factors, made.slices, strict=True):
        inverse, info = lapack.dpotri(U)
        if info != 0:
            raise np.linalg.LinAlgError(f"dpotri returned {info}")
        inverse = np.triu(inverse) + np.triu(inverse, 1).T
        A = made.A[rows]
        Q += A.T @ (A.T @ inverse).T
    return np.asfortranarray((Q + Q.T) / 2)
