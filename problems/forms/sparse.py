"""The sparse form: min ½ûᵀK̂û − f̂ᵀû, Bᵀû ≤ g over all N unknowns of the model, K̂ and B sparse.

Nothing is condensed: x is û at the junction, and λ is that of the other forms. Needs K̂ and B, no factor.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from .names import Form
from .prepared import Prepared
from .primal import Primal


class Sparse(Primal):
    """As the primal form, with sparse blocks of K. prepared : any; if its blocks are dense, a sparse copy."""

    form: ClassVar[Form] = "sparse"

    def __init__(self, prepared: Prepared) -> None:
        given = prepared.assembly
        K = given.K.as_sparse(given.nodes)
        super().__init__(prepared if K is given.K else Prepared(replace(given, K=K)))

    @property
    def model_s(self) -> float | None:
        return self.prepared.stages.seconds.get("model")

    @property
    def yardstick(self) -> None:
        return None
