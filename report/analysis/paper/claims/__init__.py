"""The paper's claims, each with the rule by which the rows decide it, in the order of the paper."""

from __future__ import annotations

from . import comparison, complexity, contacts, linear_systems, starting_points
from .verdict import Claim

CLAIMS: list[Claim] = [
    *linear_systems.CLAIMS,
    *starting_points.CLAIMS,
    *complexity.CLAIMS,
    *contacts.CLAIMS,
    *comparison.CLAIMS,
]
