"""The data of a riveting problem: what load cases share, and each load case's own. Units: mm and N."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Assembly:
    """Stiffness and contacts of the joined parts, shared by many load cases.

    Parameters
    ----------
    blocks : K_1 … K_p, each (n_i, n_i), N/mm, symmetric positive definite, dense or sparse.
        K = blockdiag(K_1, …, K_p), n = Σ n_i.
    A : (n, m) sparse. Column j is the normal of contact j: +1 and −1 for two parts,
        a single 1 for a part against a rigid tool.
    nodes : (n, 2) coordinates of the unknowns in mm, or None if they are unknown.
    parts : a name for each block.
    notes : sentences on what reading has rounded or symmetrised of a user's numbers.
    junction : the unknowns that are asked for, displacements in mm; None if all are. The others, of a model
        without condensation, are inner displacements, slopes and twists.
    """

    blocks: tuple[Matrix, ...]
    A: sp.csc_array
    nodes: Matrix | None = None
    parts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    junction: NDArray[np.intp] | None = None

    @property
    def n(self) -> int:
        return int(self.A.shape[0])

    @property
    def m(self) -> int:
        return int(self.A.shape[1])

    @property
    def asked(self) -> int:
        """The number of displacements that are asked for."""
        return self.n if self.junction is None else len(self.junction)

    def at_junction(self, x: Matrix) -> Matrix:
        """Of (n,) or (n, k), the rows that are asked for."""
        return x if self.junction is None else x[self.junction]

    @property
    def asked_contacts(self) -> sp.csc_array:
        """A at the displacements that are asked for, (asked, m)."""
        return self.A if self.junction is None else sp.csc_array(self.A[self.junction])

    @property
    def asked_nodes(self) -> Matrix | None:
        """The coordinates of the displacements that are asked for, (asked, 2) mm."""
        return None if self.nodes is None else self.at_junction(self.nodes)

    @property
    def slices(self) -> list[slice]:
        """The unknowns of each block."""
        ends = np.cumsum([0, *(K.shape[0] for K in self.blocks)])
        return [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]

    @property
    def contact_nodes(self) -> Matrix | None:
        """(m, 2) coordinates of the contacts in mm: those of the first unknown of each."""
        if self.nodes is None:
            return None
        return self.nodes[self.A.indices[self.A.indptr[:-1]]]

    @property
    def stored(self) -> list[NDArray[Any]]:
        """The arrays that hold K's blocks."""
        found: list[NDArray[Any]] = []
        for K in self.blocks:
            sparse: Any = K
            found += [sparse.data, sparse.indices, sparse.indptr] if sp.issparse(K) else [K]
        return found

    @property
    def sparse_blocks(self) -> tuple[sp.csc_array, ...]:
        """K's blocks as sparse matrices; not copied if they are."""
        return tuple(sp.csc_array(K) for K in self.blocks)

    def multiply_K(self, x: Matrix) -> Matrix:
        """K x, block by block."""
        return np.concatenate([K @ x[s] for K, s in zip(self.blocks, self.slices, strict=True)])

    def diagonal_K(self) -> Vector:
        """The diagonal of K, (n,) N/mm."""
        return np.concatenate([K.diagonal() for K in self.blocks])

    def norm_K(self) -> float:
        """‖K‖_∞ = max_i Σ_j |K_ij|, N/mm, but for rounding."""
        return max(float(abs(K).sum(axis=1).max()) for K in self.blocks)


@dataclass(frozen=True)
class LoadCase:
    """One load case.

    f : (n,) nodal forces, N. g : (m,) initial gaps, mm.
    p : (m,) AᵀK⁻¹f − g, mm, the overlap of the parts if contact is ignored; formed by the dual form only.
    """

    f: Vector
    g: Vector
    p: Vector = field(default_factory=lambda: np.zeros(0))
