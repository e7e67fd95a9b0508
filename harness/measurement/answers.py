"""A solver's answer: whether it is valid, its figures for the row, and its file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import get_args

import numpy as np

from harness.results.records import Row
from problems.forms.assembly import Vector
from problems.forms.problem import Problem
from solvers.base import Answer, Status


class Refused(Exception):
    """The answer is invalid; the text says why."""


def validated(answer: Answer, problem: Problem) -> Answer:
    """The answer. Raises Refused if it is not one: type, status, shapes or values are wrong."""
    if not isinstance(answer, Answer):
        raise Refused(f"solve returned {type(answer).__name__}, not solvers.base.Answer")
    if answer.status not in get_args(Status):
        raise Refused(f"status {answer.status!r}; allowed: {', '.join(get_args(Status))}")
    needed = problem.needs[-1]  # x in a form that gives it: forces may be missing there
    if answer.status == "solved" and getattr(answer, needed) is None:
        raise Refused(f"says solved, and gives no {needed}")
    assembly = problem.assembly
    for name, value, size in (("lam", answer.lam, assembly.m), ("x", answer.x, assembly.n)):
        if value is None:
            continue
        if np.shape(value) != (size,):
            raise Refused(f"{name} has shape {np.shape(value)}; wanted ({size},)")
        if not np.isfinite(np.asarray(value, dtype=float)).all():
            raise Refused(f"{name} has NaN or infinity")
    return answer


def figures(answer: Answer) -> Row:
    """What the solver reports, for the row."""
    return {
        "iterations": answer.iterations,
        "inner_iterations": answer.inner_iterations,
        "solver_reported_s": answer.reported_s,
        "details": answer.details,
    }


def save(path: Path, x: Vector, lam: Vector | None, m: int) -> None:
    """x (n,) in mm and lam (m,) in N, NaN if the solver gives none; written atomically."""
    new = path.with_name(path.name + ".new")
    with new.open("wb") as file:
        np.savez(file, x=x, lam=np.full(m, np.nan) if lam is None else lam)
        file.flush()
        os.fsync(file.fileno())
    new.replace(path)
