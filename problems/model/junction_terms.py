"""Gaps at contacts, forces that press two parts together, and the sums of the effects in the junction."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from problems.forms.assembly import Matrix, Vector

from .effect import Effect, ForceEffect, GapEffect
from .interface import AnyJoint
from .joint import TOOL, Pair


def at_contacts(values: Callable[[Pair], Vector | float], pairs: Sequence[Pair], joint: AnyJoint) -> Vector:
    """A gap that is given pair by pair.

    Parameters
    ----------
    values : function
        The gap of a pair (a, b), mm: (c,) at its contacts, or a number for all of them.
    pairs : sequence
        The pairs that have this gap; it is 0 at the others.
    joint : AnyJoint

    Returns
    -------
    (m,) ndarray
        mm.
    """
    g = np.zeros(joint.size[1])
    for pair in pairs:
        g[joint.span(pair)] = values(pair)
    return g


def pressing_forces(
    acting: Callable[[Pair], Iterable[tuple[Matrix, Vector | float]]], pairs: Sequence[Pair], joint: AnyJoint
) -> Vector:
    """Forces that press the two parts of each pair together, along the normal of the first.

    Parameters
    ----------
    acting : function
        Gives for a pair some (points, force): at each of the points (k, 2), mm, acts this force, N, so that
        their sum is k · force, or one of (k,). A negative force presses the parts apart.
    pairs : sequence
        The pairs (a, b) that are pressed.
    joint : AnyJoint

    Returns
    -------
    (n,) ndarray
        N.
    """
    f = np.zeros(joint.size[0])
    for pair in pairs:
        presses = list(acting(pair))
        for part, sign in sides(pair):
            nodal = np.zeros(f[joint.unknowns(part)].shape)
            for points, newton in presses:
                W = joint.deflection(part, points, pair[0])
                nodal += W.T @ newton if np.ndim(newton) else newton * W.sum(axis=0)
            f[joint.unknowns(part)] += sign * nodal
    return f


def junction_load(effects: Iterable[Effect], joint: AnyJoint) -> tuple[Vector, Vector]:
    """f (n,) N, the forces in the junction, and g (m,) mm, the gaps, of some effects."""
    f, g = (np.zeros(size) for size in joint.size)
    for effect in effects:
        if isinstance(effect, ForceEffect):
            f += effect.force(joint)
        elif isinstance(effect, GapEffect):
            g += effect.gap(joint)
    return f, g


def sides(pair: Pair) -> list[tuple[str, float]]:
    """The parts of a pair, without a tool, and their signs in a column of A."""
    return [(part, sign) for part, sign in zip(pair, (1.0, -1.0), strict=True) if part != TOOL]
