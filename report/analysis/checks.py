"""What a reader must know before trusting the figures: mixed and damaged results."""

from __future__ import annotations

from fnmatch import fnmatchcase
from itertools import product
from typing import Any

from report.document.numbers import counted, listed
from report.results.reader import Results

from .code import code_warnings
from .versions import asked_for


def warnings(results: Results) -> list[str]:
    """One sentence per fault, the gravest first."""
    checks = (_machines, _unfinished, _versions, _threads)
    found = [sentence for check in checks for sentence in check(results)]
    return [*code_warnings(results.rows), *found, *results.warnings]


def _machines(results: Results) -> list[str]:
    counts = results.rows["machine"].value_counts(sort=False)
    if len(counts) < 2:
        return []
    names = [f"{name or 'a machine not recorded'} ({counted(k, 'row')})" for name, k in counts.items()]
    return [
        f"The rows come from {len(names)} machines: {listed(names)}. "
        "They are reported one after the other; no table, mean or figure mixes them."
    ]


def _unfinished(results: Results) -> list[str]:
    suite = results.suite | {"scenes": _scenes_to_measure(results)}
    made, planned = len(results.rows), planned_measurements(suite)
    if made >= planned:
        return []
    return [
        f"The run is not finished: {made} of {planned} measurements of {suite.get('name', 'the suite')} "
        "are done. Run it again with the same directory to continue."
    ]


def _scenes_to_measure(results: Results) -> list[str]:
    """The suite's scenes without those that the model rejects, as it should."""
    problems = results.problems
    refused = set(problems.loc[problems["refused"].notna(), "scene"]) if "refused" in problems else set()
    return [scene for scene in results.suite.get("scenes", []) if scene not in refused]


def planned_measurements(suite: dict[str, Any]) -> int:
    """How many rows the expanded suite file plans at least; what two entries plan counts once."""
    planned = set()
    for solver in suite.get("solver", []):
        patterns = solver.get("scenes", ["*"])
        scenes = [s for s in suite.get("scenes", []) if any(fnmatchcase(s, glob) for glob in patterns)]
        tolerances = solver.get("tolerances", suite.get("tolerances", [None]))
        tolerances = [tolerances] if tolerances == "auto" else tolerances
        what = [(solver.get("name"), solver.get("variant", ""), *solver.get("with", []))]
        rounds = solver.get("repeats", suite.get("repeats", 1))
        repeats = range(1 if rounds == "auto" else rounds)
        threads = solver.get("threads", suite.get("threads", [None]))
        cases = range(solver.get("cases", suite.get("series", {}).get("cases", 1)))
        forms = solver.get("forms", [None])
        planned |= {*product(what, scenes, forms, tolerances, threads, repeats, cases)}
    return len(planned)


def _versions(results: Results) -> list[str]:
    rows = results.rows[(results.rows["solver_version"] != "") & ~asked_for(results.rows)]
    found = []
    for solver, versions in rows.groupby("solver")["solver_version"].unique().items():
        if len(versions) > 1:
            found.append(f"{solver} was run in several versions: {listed(sorted(versions))}.")
    own = sorted(set(results.rows["rivetbench_version"]) - {""})
    if len(own) > 1:
        found.append(f"The rows were written by several versions of rivetbench: {listed(own)}.")
    return found


def _threads(results: Results) -> list[str]:
    rows = results.rows.dropna(subset=["threads", "threads_asked"])
    other = rows[rows["threads"] != rows["threads_asked"]]
    if other.empty:
        return []
    solvers = listed(sorted(other["solver"].unique()))
    return [
        f"In {counted(len(other), 'row')} ({solvers}) the number of threads in effect was not the "
        "requested one; the tables give the one in effect."
    ]
