"""The data of a riveting problem: an assembly, and load cases on it. Units: mm and N."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import scipy.sparse as sp

from problems.stiffness import Indices, Matrix, Vector
from problems.stiffness import Mask as Mask
from problems.stiffness.operator import Stiffness

from .dependence import is_dependent


@dataclass(frozen=True)
class Assembly:
    """Stiffness and contacts of the joined parts, shared by many load cases.

    Parameters
    ----------
    K : Stiffness (n, n), N/mm
        Symmetric positive definite, a diagonal block for each part.
    A : csc_array (n, m)
        Contact normals: column j has +1 and −1 for two parts, a single 1 for a part against a rigid tool.
    nodes : array (n, 2), mm, optional
        Coordinates of the unknowns.
    parts : tuple of str
        A name for each block of K.
    notes : tuple of str
        Sentences on what reading has rounded or symmetrised of a user's numbers.
    junction : array of int, optional
        The unknowns that are displacements of the junction, in mm; by default all are. A model without
        condensation also has inner displacements, slopes and twists.
    places : array (m, 2), mm, optional
        Coordinates of the contacts; by default those of their first unknowns.
    """

    K: Stiffness
    A: sp.csc_array
    nodes: Matrix | None = None
    parts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    junction: Indices | None = None
    places: Matrix | None = None

    @property
    def n(self) -> int:
        """The number of unknowns."""
        return int(self.A.shape[0])

    @property
    def m(self) -> int:
        """The number of contacts."""
        return int(self.A.shape[1])

    @cached_property
    def dependent(self) -> bool:
        """Whether contacts depend on one another: Q is singular then, and λ one of many."""
        return is_dependent(self.A, self.K.units)

    @property
    def junction_size(self) -> int:
        """The number of displacements of the junction."""
        return self.n if self.junction is None else len(self.junction)

    def at_junction(self, rows: Any) -> Any:
        """The rows that belong to the junction, of an array (n,) or (n, k), dense or sparse; None of None."""
        return rows if rows is None or self.junction is None else rows[self.junction]

    def from_junction(self, rows: Matrix) -> Matrix:
        """(n, k) the rows of the junction's displacements (·, k) among all unknowns; the others are zero."""
        everywhere = np.zeros((self.n, rows.shape[1]))
        everywhere[slice(None) if self.junction is None else self.junction] = rows
        return everywhere

    @property
    def contact_nodes(self) -> Matrix | None:
        """(m, 2) coordinates of the contacts, mm, if they are known."""
        if self.places is not None or self.nodes is None:
            return self.places
        return self.nodes[self.A.indices[self.A.indptr[:-1]]]


@dataclass(frozen=True)
class LoadCase:
    """One load case on an assembly, as a scene or a user gives it.

    Parameters
    ----------
    f : array (n,), N
        Nodal forces, an entry per unknown of K.
    g : array (m,), mm
        Initial gaps at the contacts; negative where the parts overlap.
    energy : float, N·mm
        The energy that a unit of the objective stands for: 1 in mm and N.
    length : float, mm
        The length that a unit of the gaps stands for: 1 in mm and N. The tolerance is divided by it.

    Examples
    --------
    >>> import numpy as np
    >>> LoadCase(f=np.array([10.0, 0.0]), g=np.array([0.3])).energy
    1.0
    """

    f: Vector
    g: Vector
    energy: float = field(default=1.0, kw_only=True)
    length: float = field(default=1.0, kw_only=True)


@dataclass(frozen=True)
class DualLoadCase(LoadCase):
    """A load case of the dual form, min ½λᵀQλ − pᵀλ, λ ≥ 0; `Prepared.with_p` makes it.

    Parameters
    ----------
    f : array (n,), N
        Nodal forces.
    g : array (m,), mm
        Initial gaps.
    p : array (m,), mm
        AᵀK⁻¹f − g, the overlap of the parts if contact is ignored.
    energy, length : float, N·mm and mm
        As in a LoadCase.
    """

    p: Vector

    def __sub__(self, other: Self) -> Self:
        """The change from the other load case to this one."""
        return replace(self, f=self.f - other.f, g=self.g - other.g, p=self.p - other.p)


def stacked(cases: Sequence[LoadCase]) -> LoadCase:
    """Load cases as the columns of one: f (n, k), or (n, 1) if all share it, and g (m, k)."""
    first = cases[0].f
    shared = all(case.f is first or np.array_equal(case.f, first) for case in cases)
    f = first[:, None] if shared else np.column_stack([case.f for case in cases])
    return LoadCase(f, np.column_stack([case.g for case in cases]))
