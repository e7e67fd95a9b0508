"""K = LLᵀ by CHOLMOD, in dense blocks, after an ordering with little fill: the extra `cholmod`.

CVXOPT brings CHOLMOD along (Chen, Davis, Hager and Rajamanickam, ACM Trans. Math. Softw. 35:22, 2008).
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from cvxopt import cholmod, matrix, spmatrix

from . import Matrix, balanced_units, gamma
from .block import scaled


class Cholmod:
    """K (N, N). A pivot ≤ lost · k_ii counts as zero: K is singular.

    Raises LinAlgError if K is not positive definite.
    """

    nonzeros: int | None = None  # CVXOPT does not tell how many float64 L holds

    def __init__(self, K: sp.csc_array, lost: float) -> None:
        self.D = balanced_units(K.diagonal())
        lower = sp.tril(scaled(K, self.D, self.D), format="coo")
        places = (matrix(index.astype(np.int64)) for index in (lower.row, lower.col))
        triangle = spmatrix(matrix(lower.data), *places, K.shape)
        self.L = cholmod.symbolic(triangle)
        try:
            cholmod.numeric(triangle, self.L)
        except ArithmeticError as error:
            raise np.linalg.LinAlgError("a pivot is not positive") from error
        # The diagonal of DKD is about 1, whatever the order of its unknowns.
        if not (_array(cholmod.diag(self.L)) ** 2 > lost).all():
            raise np.linalg.LinAlgError("a pivot is only rounding")

    def solve(self, b: Matrix) -> Matrix:
        """K⁻¹b, b (N,) or (N, k)."""
        x = matrix((self.D * np.asarray(b, dtype=float).T).T)
        cholmod.solve(self.L, x)
        return (self.D * np.array(x).reshape(b.shape).T).T

    def backward_error(self) -> float:
        """A bound on ‖E‖₂, up to its rounding, of an E with K + E positive definite.

        With B = DKD after a permutation, the computed factor satisfies |B − LLᵀ| ≤ γ_{c+1} |L||L|ᵀ, entry by
        entry and whatever the order of the sums; none has more terms than c, the number of entries in the
        longest row of L (Higham 2002, theorem 10.3; γ_{2(c+2)} is used, for multiplications by the reciprocal
        of a pivot). ‖|L||L|ᵀ‖₂ ≤ ‖|L||L|ᵀ‖_∞, by products with a vector of ones, and E = D⁻¹(LLᵀ − B)D⁻¹.
        """
        starts, rows, values = map(_array, cholmod.getfactor(self.L).CCS)
        L = sp.csc_array((abs(values), rows, starts))
        norm = float((L @ (L.T @ np.ones(L.shape[0]))).max())
        return float(gamma(2 * (int(np.bincount(rows).max()) + 2))) * norm / float(self.D.min()) ** 2


def _array(values: Any) -> Any:
    return np.asarray(values).ravel()
