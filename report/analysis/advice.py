"""Which solver is the fastest of those in a directory, in sentences computed from the rows.

Another directory may hold faster ones. Which to use is said in one place, the index of the published results.
"""

from __future__ import annotations

import pandas as pd

from report.document.numbers import counted, listed, significant, span
from report.results.labels import in_order
from report.results.reader import Results

from .standings import TIE, geometric_mean, preferred, seconds_within, tie_of


def advice(results: Results) -> str:
    """A paragraph for each size; those of two and more sizes with the same method and no other, in one."""
    lone: dict[str, list[int]] = {}
    for n in results.sizes:
        methods = results.of_size(n)["method"].unique()
        if len(methods) == 1:
            lone.setdefault(str(methods[0]), []).append(n)
    several = {method: sizes for method, sizes in lone.items() if len(sizes) > 1}
    shared = {n for sizes in several.values() for n in sizes}
    words = [_of_size(results, n) for n in results.sizes if n not in shared]
    words += [_without_rival(results, method, sizes) for method, sizes in several.items()]
    return "\n".join(line for line in words if line)


def _without_rival(results: Results, method: str, sizes: list[int]) -> str:
    """How often the only method of some sizes is within the limit, and its least and most seconds."""
    cells = pd.concat([results.of_size(n) for n in sizes])
    scenes = cells["scene"].nunique()
    seconds = seconds_within(cells).min(axis=1).dropna()
    at = f"n = {listed([str(n) for n in sizes])}, {counted(scenes, 'scene')}"
    words = f"only **{method}** was run: within {results.limit} on {len(seconds)} of them"
    if len(seconds):
        words += f", {span(significant(seconds.min()), significant(seconds.max()))} s per load case"
    return " ".join([f"- **{at}:** {words}.", *_unanswered(cells)])


def _of_size(results: Results, n: int) -> str | None:
    """A paragraph for one size: the fastest of the lines within the limit on all its scenes."""
    cells = results.of_size(n)
    if cells.empty:
        return None
    seconds = seconds_within(cells)
    complete = seconds.dropna(axis=1)
    words = _best(results, cells, complete) if complete.columns.size else _none_complete(results, seconds)
    return f"- **{_range(cells)}:** {' '.join([*words, *_unanswered(cells)])}"


def _range(cells: pd.DataFrame) -> str:
    n, scenes = int(cells["n"].iloc[0]), cells["scene"].nunique()
    least, most = cells["active"].min(), cells["active"].max()
    if pd.isna(least):
        return f"n = {n}, {counted(scenes, 'scene')}"
    active = f"{least:.0f}" if least == most else f"{least:.0f} to {most:.0f}"
    return f"n = {n}, {counted(scenes, 'scene')}, {active} active contacts"


def _best(results: Results, cells: pd.DataFrame, complete: pd.DataFrame) -> list[str]:
    scenes = len(complete)
    means = preferred(complete.apply(geometric_mean), cells)["seconds"]
    best, time = str(means.index[0]), float(means.iloc[0])
    every = {1: "the one scene", 2: "both scenes"}.get(scenes, f"all {scenes} scenes")
    mean = "" if scenes == 1 else " (geometric mean)"
    once = cells.loc[cells["label"] == best, "once_s"].median()
    prepared = f", after {significant(once, 2)} s per assembly" if once >= 0.005 else ""
    words = [
        f"**{best}**: within {results.limit} on {every}, {significant(time)} s per load case{mean}{prepared}."
    ]
    ties = [str(each) for each in means.index[1:] if means[each] <= tie_of(cells, best, str(each)) * time]
    if ties:
        pairs = [f"{label} ({significant(means[label])} s)" for label in ties]
        words.append(f"As fast, to within {TIE - 1:.0%} or what its repeats differ by: {listed(pairs)}.")
    behind = [str(label) for label in means.index if str(label) not in (best, *ties)]
    if behind:
        words.append(
            f"Next is {behind[0]}, which takes {significant(means[behind[0]] / time, 2)} times as long."
        )
    elif not ties:
        words.append("No other solver is within the limit on every scene.")
    return words + _beaten(cells, [best, *ties])


def _beaten(cells: pd.DataFrame, best: list[str]) -> list[str]:
    """On which scenes another line is clearly faster than the fastest over all."""
    method = cells.loc[cells["label"].isin(best), "method"]
    rivals = cells["label"].isin(best) | ~cells["method"].isin(
        method
    )  # not the same method at other tolerances
    seconds = seconds_within(cells[rivals])
    active = cells.drop_duplicates("scene").set_index("scene")["active"]
    recommended = seconds[best].min(axis=1)
    fastest = seconds.idxmin(axis=1)
    faster = recommended > TIE * seconds.min(axis=1)
    words = []
    for label in in_order(cells[cells["label"].isin(fastest[faster])]):
        scenes = fastest.index[faster & (fastest == label)]
        times = (recommended[scenes] / seconds.loc[scenes, label]).max()
        at = listed([f"{active[scene]:.0f}" for scene in scenes])
        upto = "up to " if len(scenes) > 1 else ""
        words.append(f"At {at} active contacts, {label} is {upto}{significant(times, 2)} times as fast.")
    return words


def _none_complete(results: Results, seconds: pd.DataFrame) -> list[str]:
    counts = seconds.notna().sum()
    if not counts.size:
        return [f"no answer is within {results.limit}."]
    most = [str(label) for label in counts.index[counts == counts.max()]]
    verb = "is" if len(most) == 1 else "are each"
    return [
        f"no solver is within {results.limit} on every scene. "
        f"{listed(most)} {verb} within it on {counts.max()} of {len(seconds)}."
    ]


def _unanswered(cells: pd.DataFrame) -> list[str]:
    missed = cells[cells["verdict"] == "no_answer"]
    if missed.empty:
        return []
    return [f"{counted(len(missed), 'run')} of {len(cells)} gave no answer ({_reasons(missed['status'])})."]


def _reasons(statuses: pd.Series[str]) -> str:
    counts = statuses.value_counts()
    return ", ".join(f"{k} {str(status).replace('_', ' ')}" for status, k in counts.items())
