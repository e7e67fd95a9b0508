"""The sparse form: min ½ûᵀK̂û − f̂ᵀû, Bᵀû ≤ g over all N unknowns of the model, K̂ and B sparse.

Nothing is condensed: x is û at the junction, and λ is that of the other forms. Needs K̂ and B, no factor.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import scipy.sparse as sp

from .names import Form
from .prepared import Prepared
from .primal import Primal
from .sparse_prepared import SparsePrepared


class Sparse(Primal):
    """As the primal form, with sparse blocks of K. prepared : any; if its blocks are dense, a sparse copy."""

    form: ClassVar[Form] = "sparse"
    prepared: SparsePrepared

    def __init__(self, prepared: Prepared) -> None:
        if not isinstance(prepared, SparsePrepared):
            blocks = tuple(sp.csc_array(K) for K in prepared.assembly.blocks)
            prepared = SparsePrepared(replace(prepared.assembly, blocks=blocks))
        super().__init__(prepared)

    @property
    def model_s(self) -> float | None:
        return self.prepared.seconds.get("model")

    @property
    def yardstick(self) -> None:
        return None
