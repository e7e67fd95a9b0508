"""Static condensation of a part onto its junction nodes (superelement), line by line; the cache keeps it.

With kept unknowns j and the others i, S = K_jj − K_ji K_ii⁻¹ K_ij. The plate's grid lines couple
only to their neighbours, so a dense front travels from the far edge through the junction: it holds one
line and its coupling to the kept unknowns behind it. The line's other unknowns are eliminated by a
Cholesky factorisation, which updates S and the next line. All work is matrix–matrix.
"""

import inspect
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.linalg import lapack

from problems import storage
from problems.forms.assembly import Indices, Matrix, Vector
from problems.stiffness.block import NotPositiveDefinite, SparseBlock
from problems.stiffness.dense import mirrored, panels
from problems.storage import fingerprint

from .part import PartLoadEffect, PartModel

#: The folders whose code makes a part's stiffness.
CODE = ("problems/model", "problems/effects")


def condense(
    K: sp.csr_array,
    lines: Sequence[np.ndarray],
    keep: np.ndarray,
    progress: Callable[[float], None] = lambda fraction: None,
) -> Matrix:
    """Schur complement of a block-tridiagonal K on the kept unknowns.

    Parameters
    ----------
    K : (N, N) symmetric positive definite, coupling only within a line and to the next.
    lines : the unknowns of each line, in the order of elimination.
    keep : (N,) bool.
    progress : called with the fraction done.

    Returns
    -------
    (k, k) dense, symmetric to the last bit, in the order in which the kept unknowns stand in `lines`.

    Raises
    ------
    NotPositiveDefinite : a pivot block is not positive definite: some motion costs no energy.
    """
    size = int(keep.sum())
    S = np.zeros((size, size))
    kept = 0  # the lower triangle of S[:kept, :kept] is filled; later lines still update it
    C = K[lines[0]][:, lines[0]].toarray()  # the current line
    B = np.zeros((0, len(lines[0])))  # its coupling to the kept unknowns behind it
    for step, line in enumerate(lines):
        following = lines[step + 1] if step + 1 < len(lines) else line[:0]
        j, i = np.flatnonzero(keep[line]), np.flatnonzero(~keep[line])
        ahead = K[line][:, following].toarray()
        stop = kept + len(j)
        S[kept:stop, :kept] = B[:, j].T
        S[kept:stop, kept:stop] = C[np.ix_(j, j)]

        # W = L⁻¹ K_i·, for the kept unknowns and for the next line; then K_·· −= WᵀW
        L, info = lapack.dpotrf(C[np.ix_(i, i)], lower=1)
        if info:
            raise NotPositiveDefinite(int(line[i[info - 1]]))
        rows = np.vstack([B[:, i], C[np.ix_(i, j)].T, ahead[i].T]).T  # by columns, not copied
        W = lapack.dtrtrs(L, rows, lower=1, overwrite_b=1)[0]
        W_kept, W_ahead = W[:, :stop], W[:, stop:]
        for columns in panels(stop):
            S[columns.start : stop, columns] -= W_kept[:, columns.start :].T @ W_kept[:, columns]
        B = np.vstack([np.zeros((kept, len(following))), ahead[j]]) - W_kept.T @ W_ahead
        C = K[following][:, following].toarray() - W_ahead.T @ W_ahead
        kept = stop
        progress((step + 1) / len(lines))
    return mirrored(S)


def part_key(part: PartModel) -> str:
    """The hash of the code and data of a part's stiffness; its name does not count."""
    modules = (inspect.getmodule(type(effect)) for effect in part.effects)
    files = [Path(inspect.getfile(module)) for module in modules if module]
    code = fingerprint([*files, Path(__file__)], within=CODE)
    data = [effect.model_dump(mode="json", exclude={"part"}) for effect in part.effects]
    return storage.digest("part", part.geometry, data, code)


def condensed_stiffness(key: str, part: PartModel, progress: Callable[[float], None]) -> tuple[Matrix, float]:
    """The part's stiffness on the junction nodes, (node_count, node_count) N/mm, x running fastest.

    key : that of the part. Also returns the seconds of the computation.
    Raises NotPositiveDefinite if some motion of the part costs no energy.
    """

    def made() -> storage.Entry:
        start = time.perf_counter()
        return {"K": _condensed(part, progress)}, {"seconds": time.perf_counter() - start}

    arrays, facts = storage.load_or_make(key, made)
    return arrays["K"], facts["seconds"]


def _condensed(part: PartModel, progress: Callable[[float], None]) -> Matrix:
    lines = part.free_lines
    # Eliminate from the longer extension inwards, so that the front stays narrow for longest.
    northwards = part.junction.start - lines[0] >= lines[-1] - (part.junction.stop - 1)
    order = lines if northwards else lines[::-1]
    keep = np.zeros(part.plate.size, dtype=bool)
    keep[part.deflections] = True
    S = condense(part.stiffness(), [part.plate.line_dofs(k) for k in order], keep, progress)
    if not northwards:  # lines came in descending y
        nx = len(part.plate.x)
        ascending = np.arange(len(S)).reshape(-1, nx)[::-1].ravel()
        S = S[np.ix_(ascending, ascending)]
    return S.T  # by columns, and symmetric to the last bit


def condensed_load(
    effect: PartLoadEffect, part: PartModel, interior: Callable[[], tuple[Indices, SparseBlock]]
) -> Vector:
    """(node_count,) forces in N on the junction nodes: f_j − K_ji K_ii⁻¹ f_i, j the deflections there.

    A load on the whole part and its condensation push the junction nodes alike: the work of f_i on the
    motions that the junction imposes goes to f_j, and its work on the others does not move the junction.
    interior : i and K_ii, asked for if the load is not in the cache.
    """
    code = fingerprint([Path(inspect.getfile(type(effect))), Path(__file__)], within=CODE)
    key = storage.digest("load", part_key(part), effect.model_dump(mode="json", exclude={"part"}), code)

    def made() -> storage.Entry:
        f, j, (i, K_ii) = effect.load(part), part.deflections, interior()
        u = K_ii.solve(f[i])
        u += K_ii.solve(f[i] - K_ii.multiply(u))
        return {"force": f[j] - part.stiffness()[j][:, i] @ u}, {}

    return np.array(storage.load_or_make(key, made)[0]["force"])
