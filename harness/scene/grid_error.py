"""How far the gaps of an answer may move on a finer grid: estimated from the same joint on other grids.

The proven bound of an answer is of the solver. What the grid leaves out is not known, but shows when the
joint is solved on another grid. Of a coarser one, with the lines r times as far apart,

    e_h ≈ max |y_h − y_rh| / (r − 1)

at its contacts: a rough figure, as of an error that falls like h. Of a finer one, with half the distance h,

    e_h ≈ 4/3 max |y_h − y_h/2|,

as of an error that falls like h²; the order observed on three grids is said beside it. On ten scenes, beside
grids of 3 to 6 times as many lines, the latter was within a factor of two on nine, the former on four; the
tenth is a sheet over a former, whose contact ends at one node or the next. The initial gap is the one of the
answer, interpolated. All grids are solved in the sparse form.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from harness.scene.solution import Solution
from harness.solving.session import candidates
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.model.effect import GapEffect
from problems.model.joint import Extension, Joint, Part
from problems.model.scene import JointScene


@dataclass(frozen=True)
class GridError:
    """error_mm : of the gaps, estimated. order : observed if there are three grids, else None."""

    error_mm: float
    grids: int
    order: float | None = None


def estimated(found: Solution, refine: bool = False) -> GridError | None:
    """Of an answer; None for own matrices and superelements, whose grid is not known, without contacts or a
    coarser grid, and where another grid has no answer.

    r is that of the side of the junction where it is smaller, but above 1. refine : solve on a finer grid
    too, with four times the unknowns.
    """
    scene = found.problem.scene
    joint = scene.joint if isinstance(scene, JointScene) else None
    if not isinstance(joint, Joint) or not len(found.gap):
        return None
    coarse = regridded(joint, 0.5)
    pairs = zip(joint.junction.nodes, coarse.junction.nodes, strict=True)
    ratios = [(fine - 1) / (few - 1) for fine, few in pairs if few < fine]
    if not ratios:
        return None
    try:
        moved = _moved(found, coarse)
        halved = _moved(found, regridded(joint, 2.0)) if refine else None
    except InputError:  # the answer stands without
        return None
    if halved is None:
        return GridError(moved / (min(ratios) - 1), 2)
    return GridError(halved * 4 / 3, 3, float(np.log2(moved / halved)) if moved and halved else None)


def recorded(found: GridError | None) -> dict[str, Any]:
    """What solution.json holds of it, with a sentence."""
    if found is None:
        return {"said": "What the grid leaves out is not known here"}
    said = f"The grid leaves out about {found.error_mm:.1g} mm of a gap, "
    if found.grids == 2:
        said += "a rough figure from two grids (--refine: three)"
    else:
        order = "" if found.order is None else f", of observed order {found.order:.1f}"
        said += f"estimated from three grids{order}"
    return asdict(found) | {"said": said}


def regridded(joint: Joint, factor: float) -> Joint:
    """The joint with `factor` times as many elements along each side, at least one, rounded up."""

    def elements(count: int) -> int:
        return max(int(np.ceil(count * factor)), 1)

    def extensions(part: Part) -> dict[str, Extension | None]:
        own = {"south": part.south, "north": part.north}
        return {k: e and e.model_copy(update={"elements": elements(e.elements)}) for k, e in own.items()}

    nx, ny = (elements(count - 1) + 1 for count in joint.junction.nodes)
    parts = [part.model_copy(update=extensions(part)) for part in joint.part]
    junction = joint.junction.model_copy(update={"nodes": (nx, ny)})
    return joint.model_copy(update={"junction": junction, "part": tuple(parts)})


def _moved(found: Solution, joint: Joint) -> float:
    """max |y_h − y| over the contacts of the coarser of the two grids, y the gaps on another one, mm.

    Raises InputError if that has no answer.
    """
    scene: Any = found.problem.scene
    here, other = scene.joint, JointScene(scene.name, scene.title, joint, scene.effects)
    g = _at(here, found.problem.load.g, joint.nodes)
    rest = [effect for effect in scene.effects if not isinstance(effect, GapEffect)]
    data = prepared(other, form="sparse")
    load = LoadCase(load_case(other, "sparse", rest).f, g)
    _, lam = next(candidates(data, load), ("", None))
    if lam is None:
        raise InputError.one(other.name, "grid", list(joint.junction.nodes), "one with an answer")
    A = data.assembly.A
    gap = g - A.T @ data.assembly.K.solve(load.f - A @ lam)
    nodes = min(here.nodes, joint.nodes, key=len)
    return float(abs(_at(here, found.gap, nodes) - _at(joint, gap, nodes)).max())


def _at(joint: Joint, values: Vector, places: Matrix) -> Vector:
    """Values at the contacts, interpolated to the same places of each pair."""
    of_pairs = values.reshape(len(joint.pairs), joint.node_count)
    return np.asarray(joint.weights(places) @ of_pairs.T).T.ravel()
