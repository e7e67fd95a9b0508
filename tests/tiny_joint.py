"""A tiny joint as own matrices, and plugins that solve it exactly or misbehave."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from harness.planning.suite import Suite, read_suite

EXACT = """
import numpy as np
import scipy.linalg as sla
from scipy.optimize import nnls
from solvers.base import Answer, Solver


class Exact(Solver):
    forms = ("dual",)

    def solve(self, problem, load, tolerance):
        L = sla.cholesky(problem.Q, lower=True)
        lam, _ = nnls(L.T, sla.solve_triangular(L, load.p, lower=True))
        return Answer("solved", lam, iterations=1)
"""

FAULTY = '''
import ctypes
import os
import signal
import subprocess
import sys
import time
import numpy as np
from solvers.base import Answer, Solver

EATS = "import time; held = bytearray(400 * 2**20); held[::4096] = bytes(len(held[::4096])); time.sleep(60)"
SLEEPS = f"{sys.executable} -c 'import time; time.sleep(61)' > /dev/null & echo $!"
NONSENSE = bytes([10]).join([b"nonsense", b"[1]", bytes(range(256)), b""])
FORKS = """
if os.fork() == 0:
    for _ in range(4000):  # some ten seconds
        if os.fork():
            os._exit(0)
        os.setsid()
        time.sleep(0.002)
    os._exit(0)
time.sleep(60)
"""
WRITES = """
for fd in range(1, 64):
    try:
        os.write(fd, NONSENSE)
    except OSError:
        pass
answer = Answer("iteration_limit", None)
"""
FAULTS = {
    "hang": "while True: pass",
    "sleep": "time.sleep(60)",
    "signal": "os.kill(os.getpid(), signal.SIGSEGV)",
    "stop_itself": "os.kill(os.getpid(), signal.SIGSTOP)",
    "leave": "os._exit(7)",
    "system_exit": "sys.exit('enough')",
    "raises": "raise ValueError('no step')",
    "recurse": "exec(FAULTS['recurse'])",
    "eat": "held = []\\nwhile True: held.append(np.ones(2**20)); time.sleep(0.002)",
    "out_of_memory": "raise MemoryError('as numpy does')",
    "children_eat": "subprocess.Popen([sys.executable, '-c', EATS], start_new_session=True); time.sleep(60)",
    "orphan": "subprocess.run(SLEEPS, shell=True, stdout=subprocess.PIPE, start_new_session=True)",
    "fork_and_go_on": "os.fork()",
    "fork_on_and_on": FORKS,
    "chatter": "for _ in range(300): os.write(1, b'o' * 2**20); os.write(2, b'e' * 2**16)",
    "close_everything": "os.closerange(0, 1024)",
    "write_everywhere": WRITES,
    "big_details": "answer = Answer('solved', answer.lam, details={'trace': 'x' * 2**22})",
    "nan": "answer.lam.fill(np.nan)",
    "says": "print('one'); ctypes.CDLL(None).puts(b'two'); os.kill(os.getpid(), signal.SIGKILL)",
    "names_a_file": "print(sys.modules['solvers.base'].__file__, file=sys.stderr, flush=True)",
    "gives_up": "answer = Answer('iteration_limit', None, iterations=5)",
}


class Faulty(Solver):
    forms = ("dual",)

    def __init__(self, fault="gives_up", only=0):
        """only : which of its solves has the fault; 0: all."""
        self.fault, self.only, self.count = fault, only, 0

    def solve(self, problem, load, tolerance):
        self.count += 1
        here = {"answer": Answer("solved", np.zeros(problem.assembly.m))}
        if self.only in (0, self.count):
            exec(FAULTS[self.fault], globals(), here)
        return here["answer"]
'''


def write_problem(path: Path, shift: float = 0.0) -> Path:
    """Two parts of ten nodes each, ten contacts, three or so of them closed."""
    rng = np.random.default_rng(3)
    K = np.zeros((20, 20))
    for part in (slice(0, 10), slice(10, 20)):
        B = rng.standard_normal((10, 10))
        K[part, part] = B @ B.T + 10 * np.eye(10)
    A = np.vstack([np.eye(10), -np.eye(10)])
    np.savez(path, K=K, A=A, f=3 * rng.standard_normal(20) + shift, g=0.05 + 0.1 * rng.random(10))
    return path


def write_suite(folder: Path, text: str = "", **keys: Any) -> Path:
    """suite.toml with the tiny scene and the exact solver in `folder`; `text` takes the solvers' place."""
    folder.mkdir(exist_ok=True)
    write_problem(folder / "tiny.npz")
    (folder / "exact.py").write_text(EXACT)
    data = {"scenes": ["tiny.npz"], "threads": [1], "time_limit_s": 20, "plugin": "exact.py"} | keys
    lines = [f"{key} = {json.dumps(value)}" for key, value in data.items()]
    path = folder / "small.toml"
    path.write_text("\n".join([*lines, text or '[[solver]]\nname = "exact"\nforms = ["dual"]\n']))
    return path


def suite(folder: Path, text: str = "", **keys: Any) -> Suite:
    """The suite of `write_suite`, read."""
    return read_suite(str(write_suite(folder, text, **keys)))
