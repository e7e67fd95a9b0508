"""The sparse form: min ½ûᵀK̂û − f̂ᵀû, Bᵀû ≤ g over all N unknowns of the model, K̂ and B sparse.

Nothing is condensed: x is û at the junction, and λ is that of the other forms. Needs K̂ and B, no factor.
"""

from __future__ import annotations

from typing import ClassVar

from .names import Form
from .primal import Primal
from .sparse_prepared import SparsePrepared


class Sparse(Primal):
    """As the primal form, with sparse blocks of K."""

    form: ClassVar[Form] = "sparse"
    prepared: SparsePrepared

    @property
    def model_s(self) -> float | None:
        return self.prepared.seconds.get("model")

    @property
    def yardstick(self) -> None:
        return None
