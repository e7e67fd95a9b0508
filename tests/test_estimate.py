"""The estimates of a scene's size, memory and time, before anything is built."""

from __future__ import annotations

import pytest

from harness.planning.estimate import estimated_sparse
from problems.build import prepared
from problems.forms.sparse_factor import half_bandwidth
from problems.forms.sparse_prepared import SparsePrepared
from problems.model.scene import JointScene
from problems.scene import read_scene

GALLERY = ("three-part-stack", "installed-fasteners", "sheet-over-former", "plate-on-frame", "padded-panel")


@pytest.mark.parametrize("name", GALLERY)
def test_the_sparse_forms_unknowns_bands_and_factors_are_known_before_they_are_made(name: str) -> None:
    scene = read_scene(f"gallery/{name}")
    assert isinstance(scene, JointScene)
    estimate = estimated_sparse(scene, 1e9)
    data = prepared(scene, form="sparse")
    assert isinstance(data, SparsePrepared)
    assert (estimate.n, estimate.m) == (data.assembly.asked, data.assembly.m)
    assert estimate.unknowns == data.assembly.n
    assert estimate.half_bandwidth == max(map(half_bandwidth, data.assembly.blocks))
    stored = 8 * sum(factor.numbers for factor in data.sparse_factors)
    assert estimate.stored_mib == pytest.approx(stored / 2**20)


def test_the_time_of_arithmetic_follows_the_machine() -> None:
    scene = read_scene("4386/0107")
    assert isinstance(scene, JointScene)
    fast, slow = estimated_sparse(scene, 1e10), estimated_sparse(scene, 1e9)
    assert slow.answer_s == pytest.approx(10 * fast.answer_s)
    assert fast.build_s < slow.build_s < 10 * fast.build_s
