"""A first contact set by path-following: springs at the contacts, ever stiffer.

Block pivoting moves the edge of a contact region by about a row of contacts per set, as λ_C of a set that is
too large is negative near its edge alone. With springs of a stiffness ρ, xᵨ minimises

    ½xᵀKx − fᵀx + ½ρ ‖max(0, Aᵀx − g)‖²,

and the edge moves as far as the springs give way, however fine the mesh. One step of Newton's method per ρ,

    C = {Aᵀx > g},        (K + ρ A_C A_Cᵀ) x = f + ρ A_C g_C,

from the stiffness of the body, 1/λmax(Q), to that of an unknown of K, beyond which the set hardly changes
(Hintermüller and Kunisch, SIAM J. Optim. 17:159–187, 2006).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness.sparse import sparse_block

from .augmented_sets import stiffest_contact
from .bordered_factor import Set

GROWTH = 4.0  # of ρ per step; twice as much leaves the edge behind, and pivoting then needs more sets


def approached_set(prepared: Prepared, load: LoadCase) -> Set:
    """(m,) the contacts that overlap with springs as stiff as K. load : with p."""
    assembly = prepared.assembly
    overlap = np.maximum(load.p, 0.0)
    if not overlap.any():
        return overlap > 0
    K = assembly.K.matrix
    rho = float(overlap @ overlap / (overlap @ (prepared.compliance @ overlap)))
    stiffest = stiffest_contact(assembly)
    C = load.p > 0
    while rho < stiffest and C.any():
        A_C = assembly.A[:, np.flatnonzero(C)]
        factor = sparse_block(sp.csc_array(K + rho * (A_C @ A_C.T)), assembly.nodes)
        C = assembly.A.T @ factor.solve(load.f + rho * (A_C @ load.g[C])) > load.g
        rho *= GROWTH
    return C
