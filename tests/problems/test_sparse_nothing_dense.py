"""The sparse form, from the scene file to the certified reference, makes no matrix of order m or n."""

import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from joints import two_parts

from harness import load_scene, solve
from problems.forms.prepared import Prepared
from problems.model.joint_model import JointModel
from problems.stiffness.dense import DenseBlock

pytestmark = pytest.mark.slow

NODES = (400, 8)
SCENE = f"""
{two_parts(6000.0, 105.0, NODES, "south")}
[[effect]]
kind = "initial_gap"
mean = 0.3
random = {{ sd = 0.1, correlation_length = 200.0, seed = 7 }}
[[effect]]
kind = "pressure"
part = "a"
value = 0.02
[[effect]]
kind = "self_weight"
part = "b"
"""


def dense(*_: Any) -> None:
    raise AssertionError("a dense matrix was asked for")


def test_from_the_scene_to_the_verdict_nothing_dense_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is dense by its name fails; all arrays are smaller than two of order m, or one of order n."""
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))
    for owner, name, asked in ((DenseBlock, "U", property(dense)), (Prepared, "Q", property(dense))):
        monkeypatch.setattr(owner, name, asked)
    monkeypatch.setattr(JointModel, "dense", dense)  # condensation
    path, nodes = tmp_path / "strip.toml", NODES[0] * NODES[1]
    path.write_text(SCENE)
    for solver in (None, "newton"):
        tracemalloc.start()
        try:
            found = solve(load_scene(str(path)), solver)
            _, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert found.judgement.verdict == "within"
        assert (len(found.x), len(found.lam)) == (2 * nodes, nodes)
        assert found.error_bound_mm <= 1e-9
        assert 100 < (found.lam > 0).sum() < nodes
        assert peak < 2 * 8 * nodes**2
