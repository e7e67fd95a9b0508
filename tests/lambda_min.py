"""Proven lower bounds on λmin, as the referee asks for them."""

from typing import Any

import numpy as np

from harness.verification.balanced import smallest_eigenvalue
from problems.forms.assembly import Vector
from problems.stiffness.block import NotPositiveDefinite
from problems.stiffness.operator import Stiffness


def proven(K: Any, guess: float) -> float:
    """Of one matrix in its own units, from a guess."""
    return smallest_eigenvalue(Stiffness.of(K), np.ones(K.shape[0]), [guess])


def proven_in_units(K: Stiffness, D: Vector) -> float:
    """Of DKD, from half of an estimate that is no smaller; 0 for a K that is not positive definite."""
    try:
        guesses = [about / 2 for about in K.least_eigenvalues(D)]
    except NotPositiveDefinite:
        return 0.0
    return smallest_eigenvalue(K, D, guesses)
