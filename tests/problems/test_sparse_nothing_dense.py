"""The sparse road, from the scene file to the certified reference, makes no matrix of order m or n."""

import subprocess
import sys
from pathlib import Path

import pytest
from joints import two_parts

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
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


#: A scene of little memory, which loads the code, and the other; what is dense by its name fails.
RUN_API = """
import resource, sys
from harness import load_scene, solve
from problems.forms.prepared import Prepared
from problems.full_model.joint_model import JointModel
from problems.stiffness.dense import DenseBlock


def dense(*_):
    raise AssertionError("a dense matrix was asked for")


def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


DenseBlock.U = Prepared.Q = property(dense)
JointModel.dense = dense  # condensation
solve(load_scene(sys.argv[1]), form="sparse")
before = peak()
for solver in (None, "newton"):
    found = solve(load_scene(sys.argv[2]), solver)
    print(found.judgement.verdict, len(found.x), len(found.lam), found.error_bound_mm, peak() - before)
    assert 100 < (found.lam > 0).sum() < len(found.lam)
"""


def test_from_the_scene_to_the_verdict_nothing_dense_is_made(tmp_path: Path) -> None:
    """Beside what is there, a matrix of order n would exceed the limit by far, and two of order m, too."""
    scenes = [tmp_path / "small.toml", tmp_path / "strip.toml"]
    scenes[0].write_text(SCENE.replace(str(list(NODES)), "[20, 4]"))
    scenes[1].write_text(SCENE)
    done = subprocess.run(
        [sys.executable, "-c", RUN_API, *map(str, scenes)],
        cwd=ROOT,
        env={"RIVETBENCH_CACHE": str(tmp_path / "cache"), "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    nodes = NODES[0] * NODES[1]
    for line in done.stdout.splitlines():
        verdict, n, m, bound_mm, memory = line.split()
        assert (verdict, int(n), int(m)) == ("within", 2 * nodes, nodes)
        assert float(bound_mm) <= 1e-9
        assert int(memory) < 2 * 8 * nodes**2
