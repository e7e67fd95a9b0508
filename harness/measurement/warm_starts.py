"""The answers of a series that its next case may begin from."""

from __future__ import annotations

from collections import deque

import numpy as np

from solvers.base import Answer, Load, Near, Problem


class WarmStarts:
    """The last `most` answers, or all of them, each with what names its case."""

    def __init__(self, problem: Problem, most: int | None = None) -> None:
        self.problem = problem
        self.kept: deque[tuple[int | None, Near]] = deque(maxlen=most)

    def keep(self, load: Load, answer: Answer, case: int | None = None) -> None:
        """Nothing of an answer without forces."""
        if answer.lam is not None:
            lam = np.asarray(answer.lam, dtype=float)
            x = answer.x if self.problem.form == "primal" else None
            self.kept.append((case, Near(load, lam, self.problem.Q @ lam - load.p, x)))

    def nearest(self, load: Load) -> tuple[int | None, Near] | None:
        """The answer of the nearest overlap p, or None where there is none."""

        def distance(kept: tuple[int | None, Near]) -> float:
            return float(np.linalg.norm(kept[1].load.p - load.p))

        return min(self.kept, key=distance, default=None)
