"""Checks a scene without solving it: what will be built, its size, memory and expected time."""

from __future__ import annotations

import inspect
import time
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla
from rich.console import Console
from rich.table import Table

from harness.measurement.machine import physical_memory_mib
from problems.build import cache_key, factor
from problems.errors import InputError
from problems.input.user_matrices import read_matrices
from problems.model.effect import PartLoadEffect, TieEffect
from problems.model.joint import Joint, Part
from problems.scene import Scene, read_scene
from problems.storage import cache

from .few_digits import digits_of

TRIAL = 700  # unknowns of the Cholesky factorisation that the machine's speed is taken from
MIB = 2**20


@dataclass(frozen=True)
class Estimate:
    """n unknowns, m contacts; MiB of the stored matrices and at the peak; seconds to build and to answer."""

    n: int
    m: int
    stored_mib: float
    peak_mib: float
    build_s: float
    answer_s: float


def validate(source: str, console: Console) -> None:
    """Read and check a scene, print what it is made of and an estimate. Raises InputError."""
    scene = read_scene(source)
    if scene.joint is None:
        _matrices(scene, console)
        return
    joint = scene.joint
    refuse_what_cannot_fit(scene, source)
    console.print(f"{scene.name}: {scene.title}. Fine.")
    console.print(_contents(scene, joint))
    estimate = estimated(scene, joint, speed())
    cached = cache.load(cache_key(scene)) is not None
    console.print(
        f"n = {estimate.n} unknowns, m = {estimate.m} contacts; K, its factors and Q take "
        f"{estimate.stored_mib:.0f} MiB in the cache, the process up to {estimate.peak_mib:.0f} MiB of "
        f"{physical_memory_mib()}."
    )
    build = "stands in the cache" if cached else f"has to be built, about {_time(estimate.build_s)}"
    console.print(
        f"The assembly {build}; an answer with its bound takes about {_time(estimate.answer_s)} more."
    )
    if estimate.m == 0:
        console.print("No contact: a linear solve, without a quadratic program.")
    ties = [effect for effect in scene.effects if isinstance(effect, TieEffect)]
    if ties:
        console.print("Springs join parts into larger blocks: their factors and Q are computed anew.")
    beyond = [effect.kind for effect in scene.effects if isinstance(effect, PartLoadEffect)]
    if beyond:
        console.print(f"Loads beyond the junction are condensed once: {', '.join(beyond)}.")


def _matrices(scene: Scene, console: Console) -> None:
    """Say what given matrices are. Raises InputError where K is not positive definite."""
    assembly = scene.made.assembly if scene.made else read_matrices(dict(scene.matrices))[0]
    for K, name in zip(assembly.blocks, assembly.parts, strict=True):
        factor(K, name, scene)
    blocks = ", ".join(str(len(K)) for K in assembly.blocks)
    console.print(f"{scene.name}: matrices, n = {assembly.n}, m = {assembly.m}, blocks of {blocks}.")
    digits = digits_of(assembly)
    console.print(f"K is symmetric and positive definite, its entries seem to have {digits} digits. Fine.")


def refuse_what_cannot_fit(scene: Scene, source: str) -> None:
    """Raise InputError where a scene's matrices need more memory than this machine has."""
    if scene.joint is None:
        return
    need, physical = estimated(scene, scene.joint, 1.0).peak_mib, physical_memory_mib()
    if need > physical:
        nodes = list(scene.joint.junction.nodes)
        allowed = f"fewer nodes: {need:.0f} MiB are needed, this machine has {physical}"
        raise InputError.one(source, "junction.nodes", nodes, allowed)


def estimated(scene: Scene, joint: Joint, flops_per_s: float) -> Estimate:
    """From counts of operations; the numbers of the largest terms, so good to a factor of two or three."""
    n, m = joint.size
    size = joint.node_count
    tied = any(isinstance(effect, TieEffect) for effect in scene.effects)
    blocks = [n] if tied else [size] * len(joint.part)
    entries = 2 * sum(block**2 for block in blocks) + m**2
    condensing = sum(_condensing(joint, part) for part in joint.part)
    # Cholesky b³/3 and inverse 2b³/3 of each block, Lanczos and its products some hundred b².
    preparing = sum(block**3 + 200 * block**2 for block in blocks)
    # Some dozen factorisations of half of Q, residuals in slices of K, and the proof of λmin.
    answering = 12 * (m / 2) ** 3 / 3 + sum(12 * 6 * block**2 + 2 * block**3 / 3 for block in blocks)
    peak = 8 * (entries + max(block**2 for block in blocks) + m**2) / MIB + 150
    return Estimate(
        n, m, 8 * entries / MIB, peak, (condensing + preparing) / flops_per_s, answering / flops_per_s
    )


def _condensing(joint: Joint, part: Part) -> float:
    """Operations of the elimination line by line: a line of 4 nx unknowns against the nodes behind it."""
    nx, ny = joint.junction.nodes
    beyond = sum(side.elements for side in (part.south, part.north) if side)
    line, total = 4 * nx, 0.0
    for row in range(beyond + ny):
        kept = nx * max(0, min(row - beyond + 1, ny))
        total += line**3 / 3 + line**2 * (kept + line) + line * (kept + line) ** 2
    return total


def speed() -> float:
    """Operations a second of this machine's Cholesky factorisation, from a small one."""
    A = np.eye(TRIAL) * 2 + 1.0 / TRIAL
    best = np.inf
    for _ in range(3):
        start = time.perf_counter()
        sla.cholesky(A, check_finite=False)
        best = min(best, time.perf_counter() - start)
    return TRIAL**3 / 3 / best


def _contents(scene: Scene, joint: Joint) -> Table:
    nx, ny = joint.junction.nodes
    table = Table("what", "how many", title="What will be built")
    for part in joint.part:
        plate = joint.plate(part)
        table.add_row(f"part {part.name}", f"{plate.size} unknowns, condensed onto {joint.node_count}")
    for first, second in joint.pairs:
        table.add_row(f"contact {first} – {second}", f"{joint.node_count} node pairs, {nx} × {ny}")
    for effect in scene.effects:
        table.add_row(f"effect {effect.kind}", (inspect.getdoc(effect) or "").partition("\n")[0])
    return table


def _time(seconds: float) -> str:
    if seconds < 1:
        return "a second"
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"
