"""Compares runs, measurement by measurement: what became worse?"""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from harness.results.atomic_output import refuse_unwritable
from harness.results.comparison import Incomparable, Side, measurement, read_side, refuse_incomparable
from harness.results.records import MEASUREMENTS, refuse_other_command
from problems.errors import InputError, read_all
from report.analysis.comparison import compared
from report.document.escape import quoted
from report.results.rows import frame
from report.writers.comparison_report import Comparison, write

MAX_SLOWDOWN = 1.3
PAGE = "comparison.csv"  # a folder with it has a comparison of runs
OUTPUTS = ("better.csv", "comparison.md", "index.html", "solvers.csv", "worse.csv")


def compare(
    old: str | Path,
    new: str | Path | Sequence[str | Path],
    *,
    max_digits_lost: float = 1.0,
    max_slowdown: float | None = None,
    key: str | None = None,
    out: str | Path | None = None,
) -> list[Comparison]:
    """Compare runs with an older one, measurement by measurement.

    Parameters
    ----------
    old : str or Path
        A directory that `run` wrote.
    new : str, Path or sequence of these
        Those to compare with it.
    max_digits_lost : float, optional
        Digits of the error that may be lost.
    max_slowdown : float, optional
        Ratio of times that is allowed; by default 1.3 between runs of one machine.
    key : str, optional
        Only the row with this key.
    out : str or Path, optional
        Directory for comparison.md, comparison.csv and index.html.

    Returns
    -------
    list of Comparison
        One for each of `new`: a table of measurements, what became worse first, and a summary.

    Raises
    ------
    InputError
        If a directory has no rows, or `out` has such files of something else.
    Incomparable
        If the runs are of other problems or limits, or `max_slowdown` is given and the machines differ.

    Notes
    -----
    Digits lost are log10(max(after, floor) / max(before, floor)), where `floor` is the error bound of the
    reference, or a millionth of the limit if that is larger.

    Examples
    --------
    >>> from rivetbench import Overrides, compare, run
    >>> change = Overrides(scenes=("gallery/heavy-sheet-on-tool",), solvers=("gi",), forms=("dual",))
    >>> outcome = run("gate", "results/gi", change)
    >>> [comparison.worse for comparison in compare("results/gi", "results/gi")]
    [False]
    """
    names = [str(new)] if isinstance(new, str | Path) else list(map(str, new))
    limits = ("--max-digits-lost", max_digits_lost, 0), ("--max-slowdown", max_slowdown, 1)
    for option, most, least in limits:
        if most is not None and not most >= least:
            raise InputError.one(option, "limit", most, f"{least} or larger")
    if out is not None:
        refuse_unwritable(Path(out), [Path(name) / MEASUREMENTS for name in (str(old), *names)])
        refuse_other_command(Path(out), PAGE, OUTPUTS)
    base, *sides = read_all(lambda name: read_side(name, key), [str(old), *names])
    comparisons = [_compared(base, side, max_digits_lost, max_slowdown) for side in sides]
    if out is not None:
        write(Path(out), comparisons)
    return comparisons


def _compared(old: Side, new: Side, max_digits_lost: float, max_slowdown: float | None) -> Comparison:
    refuse_incomparable(old, new)
    timed = len(old.machines | new.machines) == 1
    untimed = "" if timed else "Times are not compared: they are of different machines."
    if not timed and max_slowdown is not None:
        allowed = f"times of one machine: {'; '.join(sorted(old.machines | new.machines))}"
        raise Incomparable.one(new.name, "--max-slowdown", max_slowdown, allowed)
    old_rows, new_rows = (
        frame(quoted([row | {"measurement": measurement(row)} for row in side.rows])) for side in (old, new)
    )
    table = compared(old_rows, new_rows, timed, max_digits_lost, max_slowdown or MAX_SLOWDOWN)
    names = quoted(old.name), quoted(new.name)
    both = pd.concat([rows.assign(side=side) for rows, side in zip((old_rows, new_rows), names, strict=True)])
    return Comparison(*names, table, untimed, both)
