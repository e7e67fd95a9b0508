"""Does the search for fasteners earn its seconds? `python -m studies.placement DIR`

Three joints with two scatters of the gap each: the fewest fasteners by removal and exchange, beside uniform
patterns, farthest points, greedy adding, and random plans with as many contact problems as the search
solved. Ten small joints: beside the optimum of all plans. And the order of setting beside left to right and
from the centre outwards. Writes placement.md and its tables.
"""

from __future__ import annotations

import sys
import time
from bisect import bisect_left
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from harness.placement.candidates import ROWS, MovableFasteners, Place, Plan, grid, plan_of
from harness.placement.plan_search import Step
from harness.placement.search import Search, onto
from harness.placement.session import FastenerStudy, Outcome, PlanSession, Question
from problems.forms.assembly import Matrix
from problems.load_cases.random_gaps import random_gaps
from problems.scene_files import scene_of
from report.document.blocks import Section, Table, number, word
from report.document.numbers import whole
from report.writers.sections_writer import written

CASES, SHARE, LIMIT = 60, 0.95, 1.5  # the limit: times what all candidates leave
SCATTERS = {"smooth": (0.1, 200.0), "rough": (0.15, 70.0)}  # sd and correlation length, mm
SMALL_CASES, SMALL_JOINTS = 20, 10
WORKERS = 2
HOLES = ((1, 12), (2, 6), (3, 4))  # of the small joints, in turn


def joint(length: float, width: float, nodes: tuple[int, int], thick: tuple[float, float]) -> dict[str, Any]:
    upper = {"name": "upper", "thickness": thick[0], "north": {"length": 80.0, "elements": 3}}
    lower = {"name": "lower", "thickness": thick[1], "south": {"length": 250.0, "elements": 5}}
    parts = [upper | {"clamped": ["north"]}, lower | {"clamped": ["south"]}]
    return {"junction": {"length": length, "width": width, "nodes": list(nodes)}, "part": parts}


JOINTS = {
    "panel on frame": (joint(900.0, 150.0, (61, 9), (5.0, 6.0)), 400.0, (3, 16)),
    "doubler on skin": (joint(600.0, 120.0, (41, 7), (2.0, 4.0)), 100.0, (2, 16)),
    "wide lap": (joint(500.0, 300.0, (31, 15), (3.0, 3.0)), 200.0, (4, 10)),
}


class Counted:
    """Answers questions, and counts the contact problems solved for them."""

    def __init__(self, session: PlanSession) -> None:
        self.session, self.count = session, 0

    def __call__(self, asked: Sequence[Question]) -> list[list[Outcome]]:
        self.count += sum(len(question.plans) * len(question.cases) for question in asked)
        return [self.session.answer(question) for question in asked]


def opened(
    table: dict[str, Any], preload: float, sd: float, length: float, cases: int
) -> tuple[MovableFasteners, PlanSession]:
    gap = {"kind": "initial_gap", "mean": 0.4, "random": {"sd": sd, "correlation_length": length, "seed": 0}}
    fasteners = {"kind": "fasteners", "preload": preload, "pattern": {"columns": 5, "rows": 1}}
    movable = MovableFasteners.of(scene_of({"title": "", "joint": table, "effect": [gap, fasteners]}))
    gaps = random_gaps(movable.bare, cases, 0)
    return movable, PlanSession(FastenerStudy(movable.bare, gaps, "dual", movable))


def search_of(
    session: PlanSession, candidates: Plan, allowed: int, limit: float = 0.0
) -> tuple[Search, Counted]:
    ask, nodes = Counted(session), session.last.data.assembly.contact_nodes
    assert nodes is not None
    study = session.study
    return Search(ask, study.cases.count, allowed, limit, study.bare, nodes, candidates), ask


def searched(search: Search) -> Step:
    """As the command does."""
    return search.fewest(search.whole(search.candidates))[0]


def added(search: Search, candidates: Plan, limit: float) -> Step:
    """Greedy adding: each time the fastener with which φ is least."""
    step = search.whole(())
    while step.gap_mm > limit and len(step.plan) < len(candidates):
        plans = [tuple(sorted((*step.plan, place))) for place in candidates if place not in step.plan]
        values = search._values(step, plans)
        step = search.whole(min(zip(values, plans, strict=True))[1])
    return step


def distances(session: PlanSession, places: Plan) -> Matrix:
    """(k, k) ‖f_a − f_b‖ in the norm of K⁻¹, √(N·mm): how different what two fasteners do is. On the
    diagonal ‖f_a‖.
    """
    F = np.column_stack([session.last.column(place)[0] for place in places])
    G = F.T @ session.last.data.assembly.K.solve(F)
    square = np.diag(G)[:, None] + np.diag(G) - G - G.T + np.diag(np.diag(G))
    root: Matrix = np.sqrt(np.maximum(square, 0.0))
    return root


def farthest_plans(candidates: Plan, distances: Matrix) -> list[Plan]:
    """First the fastener that does most, then each time the one whose effect is least like all before it: the
    first 1, 2, … of them.
    """
    apart = distances - np.diag(np.diag(distances))
    order = [int(np.argmax(np.diag(distances)))]
    while len(order) < len(candidates):
        order.append(int(np.argmax(apart[:, order].min(axis=1))))
    return [tuple(sorted(candidates[k] for k in order[: count + 1])) for count in range(len(order))]


def bisected(plans: Sequence[Plan], search: Search) -> list[Step]:
    """The plans tried to find the first whose gap is enough, as if gaps shrank along them."""
    tried: list[Step] = []

    def enough(plan: Plan) -> bool:
        tried.append(search.whole(plan))
        return tried[-1].gap_mm <= search.limit_mm

    bisect_left(plans, True, key=enough)
    return tried


def uniform(search: Search) -> list[Step]:
    """The holes nearest to uniform patterns: of each number of rows by bisection."""
    holes = search.candidates
    return [
        step
        for rows in ROWS
        for sizes in [range(1, len(holes) // rows + 1)]
        for step in bisected([onto(plan_of(grid(search.bare, rows, k)), holes) for k in sizes], search)
    ]


def at_random(search: Search, ask: Counted, candidates: Plan, limit: float, budget: int) -> Step:
    """Random plans, each of one fastener less than the smallest so far that keeps the limit."""
    random, best = np.random.default_rng(0), search.whole(candidates)
    while ask.count < budget and len(best.plan) > 1:
        chosen = random.choice(len(candidates), len(best.plan) - 1, replace=False)
        step = search.whole(tuple(sorted(candidates[k] for k in chosen)))
        best = step if step.gap_mm <= limit else best
    return best


def compared(name: str, scatter: str) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Lines of the fewest fasteners by each method, and of the order of setting."""
    table, preload, (rows, columns) = JOINTS[name]
    movable, session = opened(table, preload, *SCATTERS[scatter], CASES)
    candidates, allowed = plan_of(grid(movable.bare, rows, columns)), int((1 - SHARE) * CASES + 1e-9)
    limit = LIMIT * search_of(session, candidates, allowed)[0].whole(candidates).gap_mm
    search, ask = search_of(session, candidates, allowed, limit)
    lines: list[dict[str, Any]] = []

    def line(method: str, started: float, count: int, steps: Sequence[Step]) -> None:
        kept = [step for step in steps if step.gap_mm <= limit]
        least = min((len(step.plan) for step in kept), default=None)
        solved, seconds = ask.count - count, time.perf_counter() - started
        lines.append(
            {"joint": name, "scatter": scatter, "limit_mm": limit, "candidates": len(candidates)}
            | {"method": method, "fasteners": least, "problems": solved, "seconds": seconds}
        )

    def timed(method: str, make: Any) -> list[Step]:
        started, count = time.perf_counter(), ask.count
        steps = make()
        line(method, started, count, steps)
        return list(steps)

    (best,) = timed("removal and exchange", lambda: [searched(search)])
    budget = ask.count
    timed("uniform patterns", lambda: uniform(search))
    far = farthest_plans(candidates, distances(session, candidates))
    timed("farthest points", lambda: bisected(far, search))
    timed("greedy adding", lambda: [added(search, candidates, limit)])
    start = ask.count
    timed("random plans", lambda: [at_random(search, ask, candidates, limit, start + budget)])
    return lines, [{"joint": name, "scatter": scatter} | each for each in orders(search, best)]


def orders(search: Search, best: Step) -> list[dict[str, Any]]:
    """The gap after each step, in its mean and at its largest, of three orders."""
    middle = np.mean(best.plan, axis=0)

    def prefixes(order: Sequence[Place]) -> list[Step]:
        return search.wholes([tuple(sorted(order[:k])) for k in range(len(order) + 1)])

    by_order = {
        "least needed last": [best, *search.removal(best, {})][::-1],
        "left to right": prefixes(best.plan),
        "centre outwards": prefixes(
            sorted(best.plan, key=lambda place: (float(np.hypot(*(place - middle))), place))
        ),
    }
    return [
        {"order": name, "mean_mm": float(np.mean(gaps)), "largest_mm": max(gaps), "before_mm": gaps[0]}
        for name, steps in by_order.items()
        for gaps in [[step.gap_mm for step in steps]]
    ]


def optimal(seed: int) -> dict[str, Any]:
    """A small joint of its own: the fewest found, beside the fewest of all plans."""
    random = np.random.default_rng(seed)
    length, width = float(random.integers(200, 500)), float(random.integers(60, 160))
    table = joint(length, width, (25, 7), (float(random.integers(2, 6)), float(random.integers(2, 6))))
    rows, columns = HOLES[seed % len(HOLES)]
    sd = float(random.uniform(0.05, 0.15))
    movable, session = opened(table, float(random.integers(50, 400)), sd, 80.0, SMALL_CASES)
    candidates = plan_of(grid(movable.bare, rows, columns))
    limit = float(random.uniform(1.2, 3.0)) * search_of(session, candidates, 1)[0].whole(candidates).gap_mm
    search, ask = search_of(session, candidates, 1, limit)
    best = searched(search)
    solved = ask.count
    optimum = len(best.plan)
    for count in range(len(best.plan)):
        if any(search.whole(plan).gap_mm <= limit for plan in combinations(candidates, count)):
            optimum = count
            break
    return {"joint": seed, "limit_mm": limit, "found": len(best.plan), "optimum": optimum, "problems": solved}


def main(directory: Path) -> None:
    directory.mkdir(parents=True, exist_ok=True)
    cases = [(name, scatter) for name in JOINTS for scatter in SCATTERS]
    with ProcessPoolExecutor(WORKERS) as pool:
        pairs = list(pool.map(compared, *zip(*cases, strict=True)))
        small = pd.DataFrame(pool.map(optimal, range(SMALL_JOINTS)))
    lines = pd.DataFrame([line for some, _ in pairs for line in some])
    order = pd.DataFrame([line for _, some in pairs for line in some])
    share = f"{100 * SHARE:g} % of {CASES} cases"
    tables = [
        Table(
            "fewest",
            f"*The fewest fasteners that keep the limit in {share}*, one thread.",
            lines,
            [
                *(word(name, name) for name in ("joint", "scatter", "method")),
                *(number(name, name, whole) for name in ("fasteners", "problems")),
                number("s", "seconds"),
            ],
            keys=3,
        ),
        Table(
            "optimum",
            "*Small joints with few candidates*, beside the fewest of all plans.",
            small,
            [number(name, name, whole) for name in ("joint", "found", "optimum", "problems")],
        ),
        Table(
            "orders",
            "*The largest gap after each fastener that is set, mm*: over the steps, and before the first.",
            order,
            [
                *(word(name, name) for name in ("joint", "scatter", "order")),
                *(number(name, f"{name}_mm") for name in ("mean", "largest", "before")),
            ],
            keys=3,
        ),
    ]
    print(written(directory / "placement.md", "Where fasteners go", [Section("Beside other ways", tables)]))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
