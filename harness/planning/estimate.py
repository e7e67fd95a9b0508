"""What a scene will need, before anything is built: memory, and time by counts of operations.

The dense forms keep K and its factors, Σ 2 b² entries for blocks of b unknowns, and Q, m² entries. The
sparse form keeps the band factors of K̂, Σ N (b + 1) entries for blocks of N unknowns and half-bandwidth b,
made in N b² operations.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import log2
from typing import TYPE_CHECKING

from harness.results.machine import physical_memory_mib
from problems.errors import Fault, InputError
from problems.forms.names import Form, road_of
from problems.model.effect import TieEffect
from problems.model.joint import Joint, Part
from problems.model.scene import JointScene, MadeScene, Scene
from problems.scene import read_scene

if TYPE_CHECKING:
    from .plan import Measurement  # which imports the solvers

MIB = 2**20

# Of the sparse form, measured at n = 4386 and 11308.
MODEL_S = 1e-5  # to assemble K̂, per unknown: not arithmetic, but memory and Python
MODEL_BYTES = 1500  # while it is assembled, per unknown
BAND_SLOWER = 2.5  # a band Cholesky factorisation than a dense one, per operation
# Where the band is wide, a fill-reducing order: 31/4 n² log₂ n entries on an n × n grid (George 1973), with 4
# unknowns per node, L and U, and their indices. Per unknown and log₂ of the nodes:
GENERAL = 31 / 4 / 2 * 4 * 2 * 1.5
FACTORS = 2  # at a time: to solve with, and to prove λmin
PROOFS = 3  # factorisations in that proof, and of the coarser model
SOLUTIONS = 400  # K̂⁻¹v, of an answer with its bound
SOLUTIONS_OF_CASE = 25  # the same of each load case of a series, which shares them with others


@dataclass(frozen=True)
class Estimate:
    """n unknowns, m contacts; MiB of the stored matrices and at the peak; seconds to build and to answer."""

    n: int
    m: int
    stored_mib: float
    peak_mib: float
    build_s: float
    answer_s: float


@dataclass(frozen=True)
class SparseEstimate(Estimate):
    """The same in the sparse form: unknowns of the finite-element model, the largest half-bandwidth of K̂;
    seconds of each load case of a series.
    """

    unknowns: int
    half_bandwidth: int
    case_s: float


def stored_mib(scene: Scene, form: Form = "dual") -> float:
    """MiB of K, its factors and Q, or of the factors of K̂; 0 if that takes reading the matrices."""
    match scene:
        case JointScene() if form == "sparse":
            return estimated_sparse(scene, 1.0).stored_mib
        case _ if form == "sparse":
            return 0.0
        case JointScene():
            return 8 * _entries(_blocks(scene), scene.joint.size[1]) / MIB
        case MadeScene():
            return 8 * _entries(list(scene.block_sizes), scene.expected_size[1]) / MIB
    return 0.0


def refuse_limits_too_low(plan: Iterable[Measurement]) -> None:
    """Raise InputError where a memory limit is above what this machine has, or below the matrices alone."""
    faults, physical = [], physical_memory_mib()
    limits = {(m.source, road_of(m.form), m.memory_limit_mib) for m in plan}
    for limit in sorted({limit for *_, limit in limits if limit > physical}):
        faults.append(Fault("--memory-limit", "memory_limit_mib", limit, f"this machine has {physical} MiB"))
    for source, road, limit in sorted(limits):
        scene = read_scene(source)
        need = stored_mib(scene, "sparse" if road == "sparse" else "dual")
        if need > limit:
            allowed = f"the matrices of scene {source} alone take {need:.0f} MiB"
            if road != "sparse" and (sparse := stored_mib(scene, "sparse")) and sparse <= limit:
                allowed += f" in the dense forms, {sparse:.0f} MiB in the sparse form (--form sparse)"
            faults.append(Fault("--memory-limit", "memory_limit_mib", limit, allowed))
    if faults:
        raise InputError(faults)


def refuse_what_cannot_fit(scene: Scene, source: str, form: Form = "dual") -> None:
    """Raise InputError where a form's matrices of a scene need more memory than this machine has.

    The message offers the sparse form where no dense one fits and that does.
    """
    if not isinstance(scene, JointScene):
        return
    need, sparse = estimated(scene, 1.0).peak_mib, estimated_sparse(scene, 1.0).peak_mib
    physical = physical_memory_mib()
    if (sparse if form == "sparse" else need) > physical:
        nodes = list(scene.joint.junction.nodes)
        if sparse > physical:
            allowed = f"fewer nodes: {min(need, sparse):.0f} MiB are needed, this machine has {physical}"
        else:
            allowed = (
                f"fewer nodes, or the sparse form (--form sparse), which takes about {sparse:.0f} MiB: "
                f"a dense form needs {need:.0f}, this machine has {physical}"
            )
        raise InputError.one(source, "junction.nodes", nodes, allowed)


def estimated(scene: JointScene, flops_per_s: float) -> Estimate:
    """From counts of operations; the numbers of the largest terms, so good to a factor of two or three."""
    joint, blocks = scene.joint, _blocks(scene)
    n, m = joint.size
    entries = _entries(blocks, m)
    condensing = sum(_condensing(joint, part) for part in joint.part)
    # Cholesky b³/3 and inverse 2b³/3 of each block, Lanczos and its products some hundred b².
    preparing = sum(block**3 + 200 * block**2 for block in blocks)
    # Some dozen factorisations of half of Q, residuals in slices of K, and the proof of λmin.
    answering = 12 * (m / 2) ** 3 / 3 + sum(12 * 6 * block**2 + 2 * block**3 / 3 for block in blocks)
    peak = 8 * (entries + max(block**2 for block in blocks) + m**2) / MIB + 150
    return Estimate(
        n, m, 8 * entries / MIB, peak, (condensing + preparing) / flops_per_s, answering / flops_per_s
    )


def estimated_sparse(scene: JointScene, flops_per_s: float) -> SparseEstimate:
    """From the numbering of the uncondensed model and counts of operations; good to a factor of three."""
    n, m = scene.joint.size
    widths = _bands(scene)
    bands = [(size, min(width, GENERAL * log2(size / 4))) for size, width in widths]
    unknowns = sum(size for size, _ in bands)
    entries = sum(size * (width + 1) for size, width in bands)
    factoring = BAND_SLOWER * sum(size * (width + 1) ** 2 for size, width in bands) / flops_per_s
    peak = 150 + (MODEL_BYTES * unknowns + 8 * FACTORS * entries) / MIB
    solution = BAND_SLOWER * 4 * entries / flops_per_s
    return SparseEstimate(
        n,
        m,
        8 * entries / MIB,
        peak,
        MODEL_S * unknowns + factoring,
        SOLUTIONS * solution + PROOFS * factoring,
        unknowns,
        max(width for _, width in widths),
        SOLUTIONS_OF_CASE * solution,
    )


def _bands(scene: JointScene) -> list[tuple[int, int]]:
    """(unknowns, half-bandwidth) of K̂'s blocks; springs between parts are taken to make one of all.

    An element joins a node, with 4 unknowns, to the next on the next line: 4 (nodes per line + 1) + 3.
    """
    joint = scene.joint
    nx, ny = joint.junction.nodes
    # The grid lines y = const of each part that are not built in.
    lines = [
        ny + sum(side.elements for side in (part.south, part.north) if side) - len(set(part.clamped))
        for part in joint.part
    ]
    blocks = [lines] if any(scene.effects_of(TieEffect)) else [[count] for count in lines]
    return [(4 * nx * sum(block), 4 * min(sum(block), nx * len(block)) + 7) for block in blocks]


def _condensing(joint: Joint, part: Part) -> float:
    """Operations of the elimination line by line: a line of 4 nx unknowns against the nodes behind it."""
    nx, ny = joint.junction.nodes
    beyond = sum(side.elements for side in (part.south, part.north) if side)
    line, total = 4 * nx, 0.0
    for row in range(beyond + ny):
        kept = nx * max(0, min(row - beyond + 1, ny))
        total += line**3 / 3 + line**2 * (kept + line) + line * (kept + line) ** 2
    return total


def _blocks(scene: JointScene) -> list[int]:
    """The sizes of K's blocks; springs between parts are taken to make one of all."""
    joint = scene.joint
    return [joint.size[0]] if any(scene.effects_of(TieEffect)) else [joint.node_count] * len(joint.part)


def _entries(blocks: list[int], m: int) -> int:
    return 2 * sum(block**2 for block in blocks) + m**2
