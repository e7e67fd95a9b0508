"""Springs between condensed parts: K + T diag(k) Tᵀ. The parts that springs join become one block."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Matrix, Vector
from problems.stiffness.operator import Stiffness


def with_springs(
    K: Stiffness, names: tuple[str, ...], T: sp.csc_array, k: Vector
) -> tuple[list[Matrix], tuple[str, ...]]:
    """The blocks and names of K + T diag(k) Tᵀ.

    T : (n, r), one column per spring, its direction. k : (r,) stiffnesses, N/mm.
    A block extends from the first to the last part that a spring joins.
    """
    starts = np.array([rows.start for rows in K.slices])
    ends = np.array([rows.stop for rows in K.slices])
    block_of = np.searchsorted(ends, T.indices, side="right")
    joined = np.zeros(len(ends), dtype=bool)  # with the block before
    for column in range(T.shape[1]):
        touched = block_of[T.indptr[column] : T.indptr[column + 1]]
        joined[touched.min() + 1 : touched.max() + 1] = True
    added = sp.csr_array(T @ sp.diags_array(k) @ T.T)
    merged, merged_names = [], []
    for group in np.split(np.arange(len(ends)), np.flatnonzero(~joined)[1:]):
        first, last = starts[group[0]], ends[group[-1]]
        whole = added[first:last, first:last].toarray(order="F")
        for i in group:
            inside = slice(starts[i] - first, ends[i] - first)
            whole[inside, inside] += K.blocks[i].matrix
        merged.append(whole)
        merged_names.append(" + ".join(names[i] for i in group))
    return merged, tuple(merged_names)
