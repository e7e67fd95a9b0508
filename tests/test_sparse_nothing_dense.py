"""The sparse road, from the scene file to the certified reference, makes no matrix of order m or n."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
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
#: Everything of n or m squared fails, and so does what condensation would import.
RUN = """
import sys, tracemalloc
import numpy as np
from problems.build import load_case, prepared
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.forms.sparse_prepared import SparsePrepared
from problems.scene import read_scene
from harness.verification.judge import judge
from harness.verification.reference import refined_active_set
from solvers.registry import make_solver


def dense(self):
    raise AssertionError("a dense matrix was asked for")


for kind in (Prepared, SparsePrepared):
    kind.factors = kind.Q = property(dense)
tracemalloc.start()
scene = read_scene(sys.argv[1])
data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
solver = make_solver("newton", {})
state = solver.prepare(solver.convert(in_form(data, "sparse")))
answer = solver.solve(solver.setup(state, load, 1e-10), load, 1e-10)
peaks = [tracemalloc.get_traced_memory()[1]]
known = refined_active_set(data, load, start=answer.lam > 0)
verdict = judge(data, load, known, answer.x, answer.lam, 1e-7).verdict
peaks.append(tracemalloc.get_traced_memory()[1])
condensation = any(name.startswith("problems.condensation") for name in sys.modules)
print(answer.status, verdict, data.assembly.asked, data.assembly.m, known.active.sum(), condensation, *peaks)
"""


def test_from_the_scene_to_the_verdict_nothing_dense_is_made(tmp_path: Path) -> None:
    scene = tmp_path / "strip.toml"
    scene.write_text(SCENE)
    done = subprocess.run(
        [sys.executable, "-c", RUN, str(scene)],
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
    assert int(solving) < 8 * nodes**2  # one matrix of order m; of order n, four times as much
    assert int(proving) < 2 * 8 * nodes**2
