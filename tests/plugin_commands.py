"""A plug-in that misbehaves as a test says, and commands on it in processes of their own."""

import os
import subprocess
import sys
from pathlib import Path

from suite_runs import all_end, heed_interrupts, wait_for

ROOT = Path(__file__).parents[1]

#: A plug-in: {0} runs when it is imported, {1} in solve, which has `lam`, the right answer.
PLUGIN = """
import atexit, os, sys, threading, time
import numpy as np
import scipy.linalg as sla
from scipy.optimize import nnls
from solvers.base import Answer, Solver
{0}

class Mine(Solver):
    forms = ("dual",)

    def solve(self, problem, load, tolerance):
        L = sla.cholesky(problem.Q, lower=True)
        lam, _ = nnls(L.T, sla.solve_triangular(L, load.p, lower=True))
        {1}
        return Answer("solved", lam, iterations=1)
"""

THREAD = "threading.Thread(target=time.sleep, args=(60,)).start()"


def write(folder: Path, at_import: str = "", in_solve: str = "pass") -> Path:
    path = folder / "mine.py"
    path.write_text(PLUGIN.format(at_import, in_solve))
    return path


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "harness", *map(str, arguments)]


def environment(folder: Path) -> dict[str, str]:
    """The cache of this test alone: it marks its processes."""
    return {**os.environ, "RIVETBENCH_CACHE": str(folder / "cache")}


def interrupt(arguments: list[str], folder: Path, begun: Path, sent: int) -> None:
    """Once the command has made the file `begun`, the signal ends it and all that it started, with words."""
    going = subprocess.Popen(
        arguments,
        cwd=ROOT,
        env=environment(folder),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_interrupts,
    )
    wait_for(begun.exists)
    going.send_signal(sent)
    _, said = going.communicate(timeout=30)  # it would sleep for 60 s
    assert going.returncode == 130
    assert "Interrupted" in said
    assert "Traceback" not in said
    assert all_end(folder / "cache")
