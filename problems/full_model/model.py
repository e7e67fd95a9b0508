"""What the model of a scene gives to the forms of its quadratic program."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable

from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import Progress
from problems.model.effect import Effect


class Model(ABC):
    """K, A, f and g of a scene, as they are for the sparse form, or for the dense forms."""

    @abstractmethod
    def sparse(self) -> Prepared:
        """K̂ and B. Raises InputError; if K̂ is not positive definite, where factors are first needed."""

    @abstractmethod
    def dense(self, progress: Progress) -> Prepared:
        """K and A, memory-mapped from the cache or computed now. Raises InputError as `sparse` does."""

    @abstractmethod
    def load_case(self, sparse: bool, effects: Iterable[Effect] | None = None) -> LoadCase:
        """f, an entry per unknown of that K, and g. effects : those that count; by default all."""

    @property
    @abstractmethod
    def built(self) -> bool:
        """Whether every dense matrix is in the cache; computes nothing."""
