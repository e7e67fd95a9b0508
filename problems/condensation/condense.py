"""Static condensation onto the junction nodes (superelement), line by line.

With kept unknowns j and the others i, S = K_jj − K_ji K_ii⁻¹ K_ij. The plate's grid lines couple
only to their neighbours, so a dense front travels from the far edge through the junction: it holds one
line and its coupling to the kept unknowns behind it. The line's other unknowns are eliminated by a
Cholesky factorisation, which updates S and the next line. All work is matrix–matrix.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
from scipy.linalg import lapack

from problems.forms.assembly import Matrix
from problems.stiffness.block import NotPositiveDefinite


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
    (k, k) dense, its rows in the order in which the kept unknowns stand in `lines`.

    Raises
    ------
    NotPositiveDefinite : a pivot block is not positive definite: some motion costs no energy.
    """
    size = int(keep.sum())
    S = np.zeros((size, size))
    kept = 0  # S[:kept, :kept] is filled; later lines still update it
    C = K[lines[0]][:, lines[0]].toarray()  # the current line
    B = np.zeros((0, len(lines[0])))  # its coupling to the kept unknowns behind it
    for step, line in enumerate(lines):
        following = lines[step + 1] if step + 1 < len(lines) else line[:0]
        j, i = np.flatnonzero(keep[line]), np.flatnonzero(~keep[line])
        ahead = K[line][:, following].toarray()
        stop = kept + len(j)
        S[:kept, kept:stop] = B[:, j]
        S[kept:stop, :kept] = B[:, j].T
        S[kept:stop, kept:stop] = C[np.ix_(j, j)]

        # W = L⁻¹ K_i·, for the kept unknowns and for the next line; then K_·· −= WᵀW
        L, info = lapack.dpotrf(C[np.ix_(i, i)], lower=1)
        if info:
            raise NotPositiveDefinite(int(line[i[info - 1]]))
        rows = np.hstack([B[:, i].T, C[np.ix_(i, j)], ahead[i]])
        W = sla.solve_triangular(L, rows, lower=True, check_finite=False)
        W_kept, W_ahead = W[:, :stop], W[:, stop:]
        S[:stop, :stop] -= W_kept.T @ W_kept
        B = np.vstack([np.zeros((kept, len(following))), ahead[j]]) - W_kept.T @ W_ahead
        C = K[following][:, following].toarray() - W_ahead.T @ W_ahead
        kept = stop
        progress((step + 1) / len(lines))
    return S
