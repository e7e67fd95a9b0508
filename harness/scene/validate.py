"""Checks a scene without solving it: what will be built, its size, memory and expected time."""

from __future__ import annotations

import inspect
import time

import numpy as np
import scipy.linalg as sla
from rich.console import Console
from rich.table import Table

from harness.planning.estimate import (
    Estimate,
    SparseEstimate,
    estimated,
    estimated_sparse,
    refuse_what_cannot_fit,
)
from harness.planning.road import cheaper
from harness.results.machine import physical_memory_mib
from problems.build import model_of, prepared
from problems.forms.names import FORMS
from problems.model.effect import TieEffect
from problems.model.part import PartLoadEffect
from problems.model.scene import JointScene, Scene
from problems.scene import read_scene

from .few_digits import digits_of

SAMPLE_SIZE = 700  # unknowns of the Cholesky factorisation that measures the machine's speed


def validate(source: str, console: Console) -> None:
    """Read and check a scene, print what it is made of and an estimate. Raises InputError."""
    scene = read_scene(source)
    if not isinstance(scene, JointScene):
        _matrices(scene, console)
        return
    flops_per_s, physical = speed(), physical_memory_mib()
    dense, sparse = estimated(scene, flops_per_s), estimated_sparse(scene, flops_per_s)
    dense_fits, sparse_fits = dense.peak_mib <= physical, sparse.peak_mib <= physical
    refuse_what_cannot_fit(scene, source, "dual" if dense_fits else "sparse")
    console.print(f"{scene.name}: {scene.title}. Fine.")
    console.print(_contents(scene))
    console.print(f"n = {dense.n} unknowns, m = {dense.m} contacts; this machine has {physical} MiB.")
    if dense_fits:
        console.print(_dense(dense, model_of(scene).built))
    else:
        console.print(
            f"No dense form can hold it: the process would take up to {dense.peak_mib:.0f} MiB. The sparse "
            f"form can (--form sparse)."
        )
    if sparse_fits:
        console.print(_sparse(sparse))
    if dense.m == 0:
        console.print("No contact: a linear solve, without a quadratic program.")
    if any(scene.effects_of(TieEffect)):
        console.print("Springs join parts into larger blocks of K.")
    beyond = [effect.kind for effect in scene.effects_of(PartLoadEffect)]
    if beyond:
        console.print(f"Loads beyond the junction are condensed once: {', '.join(beyond)}.")


def _dense(estimate: Estimate, cached: bool) -> str:
    build = "is in the cache" if cached else f"has to be built, about {_time(estimate.build_s)}"
    return (
        f"Dense forms: the assembly {build}; K, its factors and Q take {estimate.stored_mib:.0f} MiB in the "
        f"cache, the process up to {estimate.peak_mib:.0f} MiB; an answer with its bound takes about "
        f"{_time(estimate.answer_s)} more."
    )


def _sparse(estimate: SparseEstimate) -> str:
    return (
        f"Sparse form: {estimate.unknowns} unknowns, half-bandwidth {estimate.half_bandwidth}; the model and "
        f"its factors take about {_time(estimate.build_s)}, the factors {estimate.stored_mib:.0f} MiB, the "
        f"process up to {estimate.peak_mib:.0f} MiB; an answer with its bound takes about "
        f"{_time(estimate.answer_s)} more."
    )


def _matrices(scene: Scene, console: Console) -> None:
    """Print the sizes and digits of given matrices. Raises InputError if K is not positive definite."""
    road = cheaper(scene, FORMS)
    data = prepared(scene, form=road.form)
    _ = data.assembly.K.factors
    assembly = data.assembly
    blocks = ", ".join(str(K.shape[0]) for K in assembly.K.matrices)
    if road.form == "sparse":
        console.print(f"Sparse form by default: {road.why}.")
    console.print(f"{scene.name}: matrices, n = {assembly.n}, m = {assembly.m}, blocks of {blocks}.")
    for note in assembly.notes:
        console.print(f"{note}.", style="yellow")
    digits = digits_of(assembly)
    console.print(f"K is symmetric and positive definite, its entries seem to have {digits} digits. Fine.")


def speed() -> float:
    """Operations per second of a small Cholesky factorisation on this machine."""
    A = np.eye(SAMPLE_SIZE) * 2 + 1.0 / SAMPLE_SIZE
    best = np.inf
    for _ in range(3):
        start = time.perf_counter()
        sla.cholesky(A, check_finite=False)
        best = min(best, time.perf_counter() - start)
    return SAMPLE_SIZE**3 / 3 / best


def _contents(scene: JointScene) -> Table:
    joint = scene.joint
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
