"""Reasons to doubt the figures of a report: mixed results, and other code."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any

import pandas as pd

from harness.results.provenance import provenance
from report.document.escape import plain
from report.document.numbers import counted, listed
from report.results.reader import Results

DIGITS = 10  # of a commit, in sentences
ANY = "any form"  # of an entry that names none


def warnings(results: Results) -> list[str]:
    """One sentence per fault, the gravest first."""
    rows = results.rows
    doubts = code_warnings(rows)
    machines = rows["machine"].replace("", "a machine not recorded")
    if machines.nunique() > 1:
        doubts.append(
            f"The rows come from {machines.nunique()} machines: {_with_rows(machines)}. "
            "They are reported one after the other; no table, mean or figure mixes them."
        )
    keys = rows[rows["scene_key"] != ""].groupby("scene")["scene_key"].nunique()
    if changed := [str(scene) for scene in keys.index[keys > 1]]:
        doubts.append(
            f"Rows of {listed(changed)} are of several problems of that name, as of a file that has changed: "
            "their times cannot be compared."
        )
    doubts += _unfinished(results)
    for solver, versions in _several(rows[~asked_for(rows)], "solver_version").items():
        doubts.append(f"{solver} was run in several versions: {listed(versions)}.")
    for versions in _several(rows.assign(solver=""), "rivetbench_version").values():
        doubts.append(f"The rows were written by several versions of rivetbench: {listed(versions)}.")
    other = rows[rows["threads"].notna() & (rows["threads"] != rows["threads_asked"])]
    if len(other):
        doubts.append(
            f"In {counted(len(other), 'row')} ({listed(sorted(other['solver'].unique()))}) the number of "
            "threads in effect was not the requested one, by which the tables name and group them."
        )
    return doubts


def asked_for(rows: pd.DataFrame) -> pd.Series[bool]:
    """Whether the version of a row is the one that its variant names."""
    pairs = zip(rows["variant"], rows["solver_version"], strict=True)
    return pd.Series([bool(v) and variant.endswith(v) for variant, v in pairs], rows.index, dtype=bool)


def code_warnings(rows: pd.DataFrame) -> list[str]:
    """One sentence per reason to doubt that the rows are of one code, and of the code that is running."""
    doubts: list[str] = []
    commits = rows["commit"]
    if commits.nunique() > 1:
        doubts.append(f"The tables mix rows measured with different code: {_with_rows(commits.map(_short))}.")
    elif (commits == "").any():
        doubts.append("No row records the commit it was measured with.")
    if changed := int((rows["clean"] == 0).sum()):
        which = f"{counted(changed, 'row')} {_was(changed)}"
        doubts.append(f"{which} measured with uncommitted changes to that commit.")
    if mixed := _several(rows, "solver_code"):
        doubts.append(f"The tables mix rows of different code of {listed([*mixed])}.")
    if other := int((~commits.isin(["", provenance()["commit"]])).sum()):
        which = "All rows were" if other == len(rows) else f"{other} of {len(rows)} rows {_was(other)}"
        doubts.append(f"{which} measured with other code than that which drew this report.")
    return doubts


def commits_text(rows: pd.DataFrame) -> str:
    """The commits in full, each with the state of the tree: '0123… (clean)'."""
    states = rows["clean"].map({1.0: " (clean)", 0.0: " (with uncommitted changes)"}).fillna("")
    words = rows["commit"].where(rows["commit"] != "", "not recorded") + states
    return listed([str(text) for text in words.unique()])


def _with_rows(names: pd.Series[str]) -> str:
    """'a (1 row) and b (2 rows)'."""
    counts = names.value_counts(sort=False)
    return listed([f"{name} ({counted(count, 'row')})" for name, count in counts.items()])


def _several(rows: pd.DataFrame, name: str) -> dict[str, list[str]]:
    """The values of a text by solver, where there are several."""
    values = rows[rows[name] != ""].groupby("solver")[name].agg(lambda texts: sorted(set(texts)))
    return {str(solver): texts for solver, texts in values.items() if len(texts) > 1}


def _was(number: int) -> str:
    return "was" if number == 1 else "were"


def _short(name: str) -> str:
    hexadecimal = len(name) == 40 and set(name) <= set("0123456789abcdef")
    return f"commit {name[:DIGITS]}" if hexadecimal else name or "a commit that is not recorded"


def _unfinished(results: Results) -> list[str]:
    """A sentence if measurements that the suite plans are missing.

    Scenes that the model refuses are not planned. With `times_best_form`, libraries do not count: their slow
    forms are left out on purpose.
    """
    rows, problems, suite = results.rows, results.problems, results.suite
    refused = set(problems.loc[problems["refused"].notna(), "scene"]) if "refused" in problems else set()
    libraries = set(rows.loc[rows["owner"] == "library", "solver"]) if suite.get("times_best_form") else set()
    names = dict(zip(rows["source"], rows["scene"], strict=True))
    planned = {
        (solver.get("name"), _label(solver), scene, form)
        for solver in suite.get("solver", [])
        if solver.get("name") not in libraries
        for source in suite.get("scenes", [])
        if (scene := names.get(source, source)) not in refused
        and any(
            fnmatchcase(plain(scene), plain(glob)) or glob == source for glob in solver.get("scenes", ["*"])
        )
        for form in solver.get("forms", [ANY])
    }
    whole = rows[rows["iteration_limit"].isna()]
    lines = list(zip(*(whole[name] for name in ("solver", "variant", "scene", "form")), strict=True))
    made = planned & {*lines, *((*line[:-1], ANY) for line in lines)}
    if made == planned:
        return []
    return [
        f"The run is not finished: {len(made)} of {len(planned)} combinations of scene, solver and form of "
        f"{suite.get('name', 'the suite')} are measured. Run it again with the same directory to continue."
    ]


def _label(solver: Mapping[str, Any]) -> str:
    """The variant and the versions of an entry of the suite, as rows have it."""
    versions = " ".join(solver.get("with", [])).removeprefix(f"{solver.get('name')}==")
    return f"{solver.get('variant', '')} {versions}".strip()
