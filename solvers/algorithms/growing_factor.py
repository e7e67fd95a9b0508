"""A Cholesky factor that grows and shrinks, and a border of it for many changes at once.

For an active set C, G_CC = RᵀR. An entering constraint k and a leaving one, the j-th of C, are columns of a
border with W_k = G_Ck and W_j = e_j. Stored for each are D = R⁻ᵀW, V = R⁻¹D and its row of S = G_EE − DᵀD,
without the first term for leaving ones. With E the columns currently in use, raising u_k by one while the
active slacks stay zero changes

    u_E by −r_E,  r_E = S_EE⁻¹ S_Ek,    u_C by −r_C,  r_C = V_k − V_E r_E,    s by S_k − S_E r_E:

products with a few columns instead of two solves with R.
"""

import numpy as np
import scipy.linalg as sla
from scipy.linalg import blas, lapack

from problems.forms.assembly import Indices, Matrix, Vector

BLOCK = 128  # rows per block in the solves
ROTATION_BLOCK = 32  # rows rotated at once in a deletion


class GrowingFactor:
    """R upper triangular with RᵀR = G_CC for the ordered set C.

    Solves and deletions work on blocks of rows: outside the small diagonal blocks, all work is in-place
    matrix–vector and matrix–matrix products. Copies of the diagonal blocks are kept because the triangular
    solve needs them contiguous.
    """

    def __init__(self, capacity: int) -> None:
        self._R = np.zeros((capacity, capacity), order="F")
        self._diagonal: list[Matrix] = []
        self.size = 0

    @property
    def R(self) -> Matrix:
        """(size, size) view."""
        return self._R[: self.size, : self.size]

    def extend(self, D: Matrix, T: Matrix) -> None:
        """C ← C ∪ E, with D = R⁻ᵀ G_CE and T upper triangular, TᵀT = G_EE − DᵀD."""
        q, self.size = self.size, self.size + len(T)
        self._R[:q, q : self.size] = D
        self._R[q : self.size, q : self.size] = T
        self._copy_diagonal_blocks(q)

    def delete(self, j: int) -> None:
        """C ← C without its j-th member: the remainder of its row is rotated into the rows below."""
        R, q = self._R, self.size - 1
        v = R[j, j + 1 : q + 1].copy()
        for a in range(j, q, BLOCK):  # move the columns to the left, the rows below j up
            b = min(a + BLOCK, q)
            R[:j, a:b] = R[:j, a + 1 : b + 1]
            R[j:b, a:b] = R[j + 1 : b + 1, a + 1 : b + 1]
        for a in range(j, q, ROTATION_BLOCK):
            b = min(a + ROTATION_BLOCK, q)
            # [R_bb; v_b] = W [R_bb'; 0], and Wᵀ acts on the rest of these rows and of v.
            W, corner = sla.qr(np.vstack([R[a:b, a:b], v[a - j : b - j]]), check_finite=False)
            rest = W.T @ np.vstack([R[a:b, b:q], v[b - j :]])
            R[a:b, a:b], R[a:b, b:q], v[b - j :] = corner[:-1], rest[:-1], rest[-1]
        self.size = q
        self._copy_diagonal_blocks(j)

    def _copy_diagonal_blocks(self, j: int) -> None:
        """Copy the diagonal blocks, starting with that of row j."""
        del self._diagonal[j // BLOCK :]
        for a in range(j // BLOCK * BLOCK, self.size, BLOCK):
            e = min(a + BLOCK, self.size)
            self._diagonal.append(np.asfortranarray(self._R[a:e, a:e]))

    def solve_transposed(self, b: Vector) -> Vector:
        """R⁻ᵀ b, for one or several right-hand sides."""
        R, z = self._R, b.copy()
        for k, block in enumerate(self._diagonal):
            a, e = k * BLOCK, k * BLOCK + len(block)
            z[a:e] -= R[:a, a:e].T @ z[:a]
            z[a:e] = _triangular_solve(block, z[a:e], 1)
        return z

    def solve(self, b: Vector) -> Vector:
        """R⁻¹ b."""
        R, z = self._R, b.copy()
        for k, block in reversed(list(enumerate(self._diagonal))):
            a, e = k * BLOCK, k * BLOCK + len(block)
            z[a:e] = _triangular_solve(block, z[a:e], 0)
            z[:a] -= R[:a, a:e] @ z[a:e]
        return z


class Border:
    """Changes of C. candidates : the constraints that may enter, the first columns. V is row-major."""

    def __init__(self, G: Matrix, C: Indices, factor: GrowingFactor, candidates: Indices) -> None:
        self.C, self.factor = C, factor
        self.candidates = candidates
        self.D = factor.solve_transposed(G[np.ix_(C, candidates)])
        self.V = np.ascontiguousarray(factor.solve(self.D).T)
        self.S = G[np.ix_(candidates, candidates)] - self.D.T @ self.D
        self.removed: list[int] = []  # positions in C; their columns follow those of the candidates
        self.added: list[int] = []  # columns of the active candidates

    @property
    def active(self) -> Indices:
        """The set C, including the removed constraints, then the added candidates."""
        return np.append(self.C, self.candidates[self.added])

    def direction(self, column: int) -> tuple[Vector, Vector]:
        """(r, ds) for the candidate in `column`: r for `active`, ds for the candidates.

        Raises LinAlgError if the active constraints are linearly dependent.
        """
        n = len(self.candidates)
        r_C, r_E, ds = self.V[column].copy(), np.empty(0), self.S[:n, column]
        E = self.added + list(range(n, len(self.S)))
        if E:
            _, _, r_E, info = lapack.dgesv(self.S[np.ix_(E, E)], self.S[E, column])
            if info:
                raise np.linalg.LinAlgError("the active constraints are linearly dependent")
            r_C -= r_E @ self.V[E]
            ds = ds - self.S[:n, E] @ r_E
        r_C[self.removed] = 0.0
        return np.append(r_C, r_E[: len(self.added)]), ds

    def drop(self, place: int) -> None:
        """Remove the constraint at this position of `active`."""
        if place >= len(self.C):
            del self.added[place - len(self.C)]
            return
        unit = (np.arange(len(self.C)) == place).astype(float)
        v = self.factor.solve(self.factor.solve_transposed(unit))
        row = -np.append(self.V[:, place], v[place])
        self.S = np.block([[self.S, row[:-1, None]], [row]])
        self.V = np.vstack([self.V, v])
        self.removed.append(place)


def _triangular_solve(block: Matrix, b: Vector, transposed: int) -> Vector:
    if b.ndim == 1:
        return blas.dtrsv(block, b, trans=transposed)
    return blas.dtrsm(1.0, block, b, trans_a=transposed)
