"""Initial gap between the parts before riveting: constant, or a random field around its mean."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.input.bounded_types import Finite, Positive, Seed
from problems.model.effect import ContactEffect, Effect, GapEffect
from problems.model.interface import AnyJoint
from problems.model.joint import Faults, Pair, Table
from problems.model.junction_terms import at_contacts

#: How far L² may be from a correlation matrix, as a share of its largest eigenvalue; see `square_root`.
SHIFT = 1e-10


class RandomField(Table):
    """Gaussian field: standard deviation and correlation length in mm, and the seed."""

    sd: Annotated[Positive, "mm"]
    correlation_length: Annotated[Positive, "mm"]
    seed: Seed


class InitialGap(ContactEffect, GapEffect):
    """g += mean + sd · Ly Z Lx in mm, Z standard normal, at every contact.

    The covariance sd² exp(−r² / 2ℓ²) is separable, so that the field needs only the symmetric square roots
    Lx and Ly of two correlation matrices; the field meets the covariance to some 1e-10 of its largest
    eigenvalue. The field is drawn on the grid of the contacts; contacts off a grid interpolate one of six
    lines or more per correlation length by cubic splines. A negative gap is an overclosure. Each contact pair
    has a random field of its own.
    """

    mean: Annotated[Finite, "mm"]
    random: RandomField | None = None

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if self.random and self.random.correlation_length < joint.shortest:
            length = self.random.correlation_length
            yield "random.correlation_length", length, f"at least {joint.shortest:.3g} mm on this junction"

    def unusual(self, joint: AnyJoint) -> Faults:
        if self.mean < 0:
            yield "mean", self.mean, "0 mm or more: the parts would overlap"

    def gap(self, joint: AnyJoint) -> Vector:
        drawn = self.on_grid(joint)
        return at_contacts(
            lambda pair: joint.from_grid(pair, drawn[pair]) if drawn else self.mean, self.pairs(joint), joint
        )

    def on_grid(self, joint: AnyJoint) -> dict[Pair, Matrix]:
        """The random gap, mean + sd · Ly Z Lx, mm, of each pair on the joint's grid; {} if none is random."""
        if self.random is None:
            return {}
        rng = np.random.default_rng(self.random.seed)
        length = self.random.correlation_length
        Lx, Ly = (square_root(grid.tobytes(), length) for grid in joint.grid(length))
        return {
            pair: self.mean + self.random.sd * (Ly @ rng.standard_normal((len(Ly), len(Lx))) @ Lx)
            for pair in self.pairs(joint)
        }


@lru_cache(maxsize=8)  # a series draws field after field on one grid
def square_root(grid_bytes: bytes, correlation_length: float) -> Matrix:
    """Symmetric square root of C = exp(−(x_i − x_j)² / 2ℓ²): unique, so that no sign depends on the machine.

    The square root √w of an eigenvalue w ≈ 0 would amplify its rounding: gaps would differ by some 1e-8
    between processors or numbers of threads. w / √(w + s) differs by rounding / √s only, and its square is w
    to within s = SHIFT · max w.
    """
    grid = np.frombuffer(grid_bytes)
    C = np.exp(-0.5 * ((grid[:, None] - grid) / correlation_length) ** 2)
    w, V = np.linalg.eigh(C)
    w = np.clip(w, 0.0, None)
    root: Matrix = (V * (w / np.sqrt(w + SHIFT * w[-1]))) @ V.T
    root.flags.writeable = False
    return root
