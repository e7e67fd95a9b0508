"""Finds the value of a scene's key beyond which too few joints keep a gap.

Each value v of an even grid is a series of the same N load cases: case k depends on the seed and k alone. In
k(v) of them the gap is proven to be within the limit, in all but k'(v) ≥ k(v) it is proven to be larger. If
one end of the range keeps it in a share s of the cases and the other does not, bisection finds neighbours v,
v' of the grid with k(v) ≥ sN > k(v').

Two more bisections bound the value. One takes for sN the least k whose confidence interval begins at s or
above, the other the least k' whose interval reaches s. If the share is monotone in v, the value lies between
their results with 95 % confidence.

Fresh cases, those of the next seed, tell the share at v: if their interval is below s, v moves half-way to
the end where the share is surely kept, and so on. If the interval reaches s only with the cases that may keep
the limit or not, it cannot be judged. Rows of a table chose v themselves.
"""

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from math import ceil, inf, nan
from pathlib import Path
from typing import Any

import numpy as np

from harness.measurement.scheduler import shared, threads_per_worker
from harness.results import records, series_file
from harness.results.atomic_output import refuse_changed, refuse_inputs
from harness.results.provenance import fingerprints
from harness.results.records import TOLERANCE
from harness.scene.allowed_gap import CONFIDENCE, SHARE, refuse_unusable, share_in_words, share_interval
from harness.scene.solution import Source, load_scene
from harness.series.load_case_source import DEFAULT, GapCases
from harness.series.session import SeriesOptions
from harness.solving.call_lock import keeps_threads
from harness.terminal.console import console_of
from problems.errors import InputError
from problems.forms.assembly import Vector
from problems.load_cases.sweep import keys_of
from problems.model.scene import JointScene
from problems.reporter import SILENT, Reporter
from report.document.numbers import out_of

from .load_case_series import run_series

RESOLUTION = 0.01  # of the range, by default
UNJUDGED = "Whether it is kept cannot be judged"
OUTPUTS = ("report.md", "shares.csv", "shares.png")
UNCHECKED = SeriesOptions(check=0)


@dataclass(frozen=True)
class Tolerance:
    """The outcome of `tolerance`.

    Parameters
    ----------
    value : float, optional
        The largest or least value that keeps the share, also by fresh cases; None if both ends of the range
        do, or neither.
    interval : tuple of (float, float)
        Where it is with 95 % confidence; infinite where that is beyond the range.
    passed : bool, optional
        Whether a value, or the whole range, keeps the share, and fresh cases do not contradict it; None if
        cases of which that is not known decide it.
    sentences : tuple of str
        The outcome in words.
    """

    value: float | None
    interval: tuple[float, ...]
    passed: bool | None
    sentences: tuple[str, ...]


@keeps_threads
def tolerance(
    scene: Source,
    out: str | Path,
    find: str,
    allow_gap_mm: float,
    share: float | None = None,
    resolution: float | None = None,
    cases: GapCases = DEFAULT,
    options: SeriesOptions = UNCHECKED,
    scheduler: str | None = None,
    reporter: Reporter = SILENT,
) -> Tolerance:
    """Find the largest, or the least, value of a key that keeps a gap in a share of the joints.

    Parameters
    ----------
    scene : Scene, str, Path or dict
        The scene, its name, the path of its file, or the content of its file.
    out : str or Path
        Directory with a series of each value: the same call continues what was interrupted.
    find : str
        KEY=LOW:HIGH, a number of an effect, which may change K, and the range of its values. The largest is
        found if LOW keeps the share, the least if HIGH does.
    allow_gap_mm : float
        The largest gap allowed, mm.
    share : float, optional
        Share of the joints that must keep it, above 0, at most 1; by default 0.95.
    resolution : float, optional
        Distance of neighbouring values, as a share of the range; by default 0.01.
    cases : GapCases, optional
        The load cases, the same for every value; by default 100 with random gaps.
    options : SeriesOptions, optional
        Solver, accuracy and limits.
    scheduler : str, optional
        Dask workers: local:N, or the address of a scheduler; by default this process.
    reporter : Reporter, optional
        Is told each share; silent by default.

    Returns
    -------
    Tolerance
        The value with its interval, and what fresh cases say of it.

    Raises
    ------
    InputError
        If an input is wrong, the key changes no gap, or `out` has series of another key or of other cases.

    Examples
    --------
    >>> from rivetbench import GapCases, tolerance
    >>> find, few = "initial_gap.random.sd=0.01:0.4", GapCases(count=10)
    >>> most = tolerance("examples/small-joint.toml", "results/sd", find, 0.05, resolution=0.25, cases=few)
    >>> most.interval[0] <= most.value < most.interval[1]
    True
    """
    read, directory = load_scene(scene), Path(out)
    share, resolution = SHARE if share is None else share, RESOLUTION if resolution is None else resolution
    keys = keys_of(read, stiffness=True) if isinstance(read, JointScene) else {}
    name, ends = (part.strip() for part in find.partition("=")[::2])
    try:
        low, high = map(float, ends.split(":"))
    except ValueError:
        low = high = inf
    if name not in keys or not -inf < low < high < inf:
        allowed = f"KEY=LOW:HIGH, LOW < HIGH, with KEY one of {', '.join(keys) or 'none in this scene'}"
        raise InputError.one("--find", "key, range", find, allowed)
    if not (0 < share <= 1 and 1e-6 <= resolution <= 1 and not cases.contributors):
        allowed = "a share above 0, at most 1, a resolution from 1e-6 to 1, no --contributors"
        raise InputError.one("--find", "share, resolution", (share, resolution), allowed)
    refuse_unusable(allow_gap_mm)
    inputs = [*read.sources, *(Path(file) for file in (*cases.files, options.plugin) if file)]
    refuse_inputs([directory / name for name in (TOLERANCE, *OUTPUTS)], inputs)
    key, grid = keys[name], np.linspace(low, high, ceil(1 / resolution - 1e-9) + 1)
    values = [*dict.fromkeys(float(f"{value:.10g}") for value in grid)]
    assert isinstance(read, JointScene)  # which alone has keys
    files = [Path(file) for file in cases.files]
    as_given = fingerprints(files)
    for tried in (*values[:2], values[-1]):
        if wrong := key.faults(read, tried, f"--find {name}"):
            raise InputError(wrong)

    def gaps(value: float, seed: int | None = None) -> tuple[Vector, Vector]:
        """Bounds on the largest gap in each case at a value, below and above, (N,) mm; NaN without an answer.

        seed : of fresh cases.
        """
        assert isinstance(read, JointScene)
        if wrong := key.faults(read, value, f"--find {name}"):
            raise InputError(wrong)
        refuse_changed(files, as_given)  # the same cases at each value
        effects, folder = list(read.effects), directory / (f"{value:.10g}" + "-fresh" * (seed is not None))
        effects[key.effect] = key.changed(effects[key.effect], value, read.joint)
        drawn = cases if seed is None else replace(cases, seed=seed)
        how: Any = {"scheduler": address, "report": seed is not None}
        how["reporter"] = reporter if value == values[0] else SILENT
        how["allow_gap_mm"] = None if seed is None else allow_gap_mm
        run_series(replace(read, effects=tuple(effects)), folder, drawn, options, **how)
        count, rows = (series_file.read_facts(folder) or {})["cases"], [*series_file.rows(folder)]
        if len(rows) < count:
            raise InputError.one(folder, "cases", len(rows), f"{count}: run the same command again")
        both = [(row.get("max_gap_mm"), row.get("gap_error_mm")) for row in rows]
        gap = np.array([nan if gap is None else gap for gap, _ in both])
        e = np.array([inf if e is None else e for _, e in both])
        return gap - e, gap + e

    bounds, shares = cache(gaps), list[dict[str, float]]()

    @cache
    def kept(value: float, seed: int | None = None) -> tuple[int, int]:
        """In how many cases a value keeps the limit, and in how many it may, unknown ones included."""
        least, largest = bounds(value, seed)
        count, total = int((largest <= allow_gap_mm).sum()), len(largest)
        missing, most = int(np.isnan(largest).sum()), total - int((least > allow_gap_mm).sum())
        low, high = share_interval(count, total, most - count)
        figures = {"value": value, "cases": total, "kept": count, "share": count / total}
        shares.append(figures | {"low": low, "high": high, "fresh": seed is not None, "no_answer": missing})
        which = "cases" if seed is None else "fresh cases"
        without = f", {missing} without an answer" if missing else ""
        within = f"within {allow_gap_mm:g} mm in {count} of {total} {which}{without}"
        reporter.say(f"{name} = {value:.10g}: {within}")
        return count, most

    options = replace(options, threads=options.threads or threads_per_worker(scheduler))
    lock = records.locked(directory, TOLERANCE, outputs=OUTPUTS)
    with lock, shared(scheduler, console_of(reporter)) as address:
        if not (path := directory / TOLERANCE).exists():
            records.replace_object(path, {"find": find})  # of an interrupted search, too
        earlier = str(records.read_object(path).get("find")).partition("=")[0].strip()
        records.refuse_other(path, {"key": earlier}, {"key": name})
        first, last = (bounds(value, None)[1] for value in (values[0], values[-1]))
        if np.array_equal(first, last, equal_nan=True) and np.isfinite(first).any():
            raise InputError.one("--find", "key", name, "one that changes gaps, and no option in its place")
        outcome, count = searched(kept, values, share, len(first)), len(first)
        limit = f"{allow_gap_mm:g} mm in {100 * share:g} % of the joints"
        said = [outcome.sentences[0].format(key=name, limit=limit)]
        value, rising = outcome.value, kept(values[0])[0] < kept(values[-1])[0]
        while value is not None and not cases.gaps:
            fresh, possible = kept(value, (cases.seed or 0) + 1)
            unknown = possible - fresh
            words = share_in_words(fresh, count, unknown)
            said.append(f"At {value:.10g} it is kept in {fresh} of {count} fresh cases, proven: {words}.")
            keeps, may = (share_interval(fresh, count, some)[1] >= share for some in (0, unknown))
            outcome = replace(outcome, value=value, passed=keeps or (None if may else False))
            if may and not keeps:
                said.append(f"{UNJUDGED}: of {out_of(unknown, count, 'fresh case')} it is not known.")
            safe = min(max(outcome.interval[rising], values[0]), values[-1])
            if may or value == safe:
                break
            value = values[(values.index(value) + values.index(safe) + rising) // 2]
        if missing := sum(int(one["no_answer"]) for one in shares):
            without = out_of(missing, count * len(shares), "case")
            said.insert(1, f"Without an answer, and not counted as kept: {without} over all values.")
        outcome = replace(outcome, sentences=tuple(said))
        asked = {"find": find, "allowed_mm": allow_gap_mm, "share": share, "cases": count}
        records.replace_object(path, asked | asdict(outcome))
        from report.writers.tolerance_report import write  # slow to import: not before the first row

        write(directory, f"{name} in {read.name}", share, said, shares)
    return outcome


def searched(
    kept: Callable[[float], tuple[int, int]], values: Sequence[float], share: float, count: int
) -> Tolerance:
    """The outcome by bisection. kept : in how many of the `count` cases a value keeps the limit, and may."""
    last, least = len(values) - 1, ceil(share * count - 1e-9)
    ends, most = zip(kept(values[0]), kept(values[-1]), strict=True)
    rising = ends[0] < least
    if rising == (ends[1] < least):
        unjudged = rising and max(most) >= least
        which = f"Neither end {'surely ' * unjudged}keeps" if rising else "Both ends keep"
        counts = f"{ends[0]} of {count} cases at {values[0]:.10g}, {ends[1]} at {values[-1]:.10g}"
        said = f"{which} {{limit}}, by {{key}}: {counts}."
        if unjudged:
            unknown = f"of {most[0] - ends[0]} and {most[1] - ends[1]} cases it is not known"
            return Tolerance(None, (), None, (f"{said} {UNJUDGED}: {unknown}.",))
        return Tolerance(None, (), not rising, (f"{said} Name another range.",))
    sure, possible = (
        bisect_left(range(count + 1), True, key=lambda k: share_interval(k, count)[end] >= share)
        for end in (0, 1)
    )

    def edge(least: int, end: int = 0) -> tuple[int, int]:
        """Neighbours: the first keeps the limit in `least` cases, or may for end = 1; the second does not, or
        is off the grid.
        """
        inside, outside = (last + 1, -1) if rising else (-1, last + 1)
        while abs(outside - inside) > 1:
            middle = (inside + outside) // 2
            inside, outside = (middle, outside) if kept(values[middle])[end] >= least else (inside, middle)
        return inside, outside

    value = values[edge(least)[0]]
    low, high = sorted((edge(sure)[0], edge(possible, 1)[1]))
    interval = values[low] if low >= 0 else -inf, values[high] if high <= last else inf
    words = f"{interval[0]:.10g}" if low >= 0 else f"below {values[0]:.10g}"
    words += f" to {interval[1]:.10g}" if high <= last else f" to above {values[-1]:.10g}"
    said = (
        f"The {'least' if rising else 'largest'} {{key}} that keeps {{limit}} is {value:.10g} "
        f"({100 * CONFIDENCE:g} % interval {words}), by {count} cases, the same at each value."
    )
    return Tolerance(value, interval, True, (said,))
