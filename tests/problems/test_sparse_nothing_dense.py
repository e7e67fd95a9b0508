"""The sparse road, from the scene file to the certified reference, makes no matrix of order m or n."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
NODES = (400, 8)
SCENE = f"""
[joint]
junction = {{ length = 6000.0, width = 105.0, nodes = {list(NODES)} }}
[[joint.part]]
name = "a"
thickness = 3.0
north = {{ length = 60.0, elements = 2 }}
clamped = ["north"]
[[joint.part]]
name = "b"
thickness = 4.0
south = {{ length = 60.0, elements = 2 }}
clamped = ["south"]
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
RUN = """
import resource, sys
from problems.build import load_case, prepared
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.stiffness.dense import DenseBlock
from problems.scene import read_scene
from harness.verification.judge import judge
from harness.verification.reference import best_of_candidates
from solvers.registry import make_solver


def dense(self):
    raise AssertionError("a dense matrix was asked for")


def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


DenseBlock.U = Prepared.Q = property(dense)
for path in sys.argv[1:]:
    before = peak()
    scene = read_scene(path)
    data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
    solver = make_solver("newton", {})
    state = solver.prepare(solver.convert(in_form(data, "sparse")))
    answer = solver.solve(solver.setup(state, load, 1e-10), load, 1e-10)
    solving = peak() - before
    known = best_of_candidates(data, load, given=[answer.lam])
    verdict = judge(data, load, known, answer.x, answer.lam, 1e-7).verdict
    proving = peak() - before
condensation = any(name == "problems.full_model.condense" for name in sys.modules)
size = data.assembly.asked, data.assembly.m
print(answer.status, verdict, *size, known.active.sum(), condensation, solving, proving)
"""


def test_from_the_scene_to_the_verdict_nothing_dense_is_made(tmp_path: Path) -> None:
    """Beside what is there, a matrix of order m would exceed either limit, and one of order n by far."""
    scenes = [tmp_path / "small.toml", tmp_path / "strip.toml"]
    scenes[0].write_text(SCENE.replace(str(list(NODES)), "[20, 4]"))
    scenes[1].write_text(SCENE)
    done = subprocess.run(
        [sys.executable, "-c", RUN, *map(str, scenes)],
        cwd=ROOT,
        env={"RIVETBENCH_CACHE": str(tmp_path / "cache"), "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    status, verdict, n, m, active, condensation, solving, proving = done.stdout.split()
    assert (status, verdict, condensation) == ("solved", "within", "False")
    nodes = NODES[0] * NODES[1]
    assert (int(n), int(m)) == (2 * nodes, nodes)
    assert 100 < int(active) < nodes
    of_order_m = 8 * nodes**2
    assert int(solving) < of_order_m
    assert int(proving) < 2 * of_order_m


#: The same for the Python interface, which chooses the form by itself.
RUN_API = """
import resource, sys
from harness import load_scene, solve
from problems.forms.prepared import Prepared
from problems.stiffness.dense import DenseBlock


def dense(self):
    raise AssertionError("a dense matrix was asked for")


def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


DenseBlock.U = Prepared.Q = property(dense)
solve(load_scene(sys.argv[1]), form="sparse")
before = peak()
for solver in (None, "newton"):
    found = solve(load_scene(sys.argv[2]), solver)
    print(found.judgement.verdict, len(found.x), len(found.lam), found.error_bound_mm, peak() - before)
"""


def test_solving_from_python_makes_nothing_dense(tmp_path: Path) -> None:
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
