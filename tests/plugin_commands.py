"""A plug-in that misbehaves as a test says, and a command on it that is interrupted."""

from pathlib import Path

import psutil
from forked_processes import forked_command
from suite_runs import is_alive, wait_for

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
MORE_MEMORY = "held = bytearray(2**30); held[::4096] = bytes(2**18); time.sleep(60)"
#: A limit that it exceeds; a fork of the tests does so, too.
LESS_MEMORY = ("--memory-limit", 700)


def write(folder: Path, at_import: str = "", in_solve: str = "pass") -> Path:
    path = folder / "mine.py"
    path.write_text(PLUGIN.format(at_import, in_solve))
    return path


def interrupt(words: list[object], begun: Path, sent: int) -> None:
    """Once the command has made the file `begun`, the signal ends it and all that it started, with words."""
    going = forked_command(*words)
    wait_for(begun.exists)
    started = psutil.Process(going.pid).children(recursive=True)
    going.send(sent)
    code, said = going.ended()
    assert code == 130
    assert "Interrupted" in said
    assert "Traceback" not in said
    assert started
    wait_for(lambda: not any(map(is_alive, started)))
