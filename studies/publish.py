"""Measures the published suites with this commit: `python -m studies.publish [SUITE...]`.

Takes hours; Ctrl-C stops it, and the same command goes on. A suite is measured in results/publishing/COMMIT.
It takes its place in results/published when it is whole: the run ended well, and every row is of this commit,
without changes. What has such rows already is not measured again. A row that was measured beside a round of
ours (`beside` in suite.py), published or of an interrupted run of another commit, stays while its scene, its
solver and that one's version and code are the same. At the end, and alone with --index, the index is written
anew.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from PIL import Image

from harness.planning.plan import expand
from harness.planning.suite import read_suite
from harness.results import records, series_file
from harness.results.counted_rows import counting
from harness.results.provenance import ROOT, provenance
from harness.results.schema import OWNERS, ROUND, VERDICTS
from harness.results.schema import SERIES as SERIES_FILE
from harness.terminal import INTERRUPTED
from harness.verification.reference_problem import PROBLEMS
from report.analysis.standings import of_fastest
from report.document.numbers import counted, listed
from report.results.reader import read
from report.sections.series_throughput import compared
from report.sections.time_to_solution import against_ours, how_fast_table, ours_and_others
from solvers.registry import owner_of
from studies.paper.__main__ import write as write_study
from studies.smaller_results import drop_gaps, pack

PUBLISHED = ROOT / "results" / "published"
STAGED = ROOT / "results" / "publishing"
#: Made by the command `series`, not by a suite.
SERIES = {
    name: (scene, "--cases", cases, "--sd", "0.2", "--correlation-length", "150")
    for name, scene, cases in (
        ("gaps", "4386/1074", "1000"),
        ("gaps-6112", "6112/1500", "256"),
        ("gaps-11308", "11308/2800", "128"),
    )
}
#: In the order of measurement; the other suites are for a user's own runs and for the CI.
NAMES = (
    *("default", "speed", "libraries", "series", "stream", *SERIES, "methods", "scaling"),
    *("hard", "hard-full", "drawn", "hard-sparse", "outside", "paper", "accuracy"),
)
DIGITS, DAY = 12, 10  # characters of a commit and of a time, where they are shortened
#: The answers of a suite are kept, in one archive for the gate to judge anew, if they take at most this.
KEPT_KIB = 3800
#: The suites with logs: those of the rows that count, of solvers that are not ours.
WITH_LOGS = ("default", "speed")
COLOURS = 256
#: A longer time between two rows is not counted: the run was interrupted.
LONGEST_PAUSE_S = 1200.0

Rows = Sequence[Mapping[str, Any]]
IN_SERIES = "one of many load cases, ours with its proof"


def main(arguments: Sequence[str] | None = None) -> int:
    """Returns 0, 1 if a suite is not whole, or 130; exits with 2 on wrong usage or code that has changes."""
    parser = argparse.ArgumentParser("python -m studies.publish", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="SUITE", help=f"only these of: {', '.join(NAMES)}")
    parser.add_argument("--index", action="store_true", help="only write the index")
    chosen = parser.parse_args(arguments)
    if unknown := sorted(set(chosen.names) - set(NAMES)):
        parser.error(f"unknown: {', '.join(unknown)}")
    failed: list[str] = []
    if not chosen.index:
        code = provenance()
        if not code["clean"] or Path.cwd().resolve() != ROOT:
            parser.error(f"must run in {ROOT}, a clone whose code is as committed")
        try:
            failed = measure(
                [name for name in NAMES if not chosen.names or name in chosen.names], code["commit"]
            )
        except KeyboardInterrupt:
            return INTERRUPTED
    print(f"Index: {write_index(PUBLISHED)}")
    if failed:
        print(f"Not published: {', '.join(failed)}. Run the same command again.", file=sys.stderr)
    return 1 if failed else 0


def measure(names: Sequence[str], commit: str) -> list[str]:
    """Measure and publish what has no rows of this commit; returns the names that are not whole."""
    due = [name for name in names if not is_of(rows_of(PUBLISHED / name), commit)]
    for name in due:
        if name not in SERIES:
            read_suite(name)  # refuses solvers that are not installed, now rather than in hours
    failed = []
    for k, name in enumerate(due):
        last = minutes(rows_of(PUBLISHED / name))
        print(f"{k + 1} of {len(due)}: {name}" + (f", {last:.0f} minutes the last time" if last else ""))
        directory = STAGED / commit[:DIGITS] / name
        if not directory.exists():
            begin(name, directory)
        words = ["series", *SERIES[name]] if name in SERIES else ["run", name]
        code = ended([*words, "--out", str(directory)])
        if code == INTERRUPTED:
            raise KeyboardInterrupt
        if code or not is_of(rows_of(directory), commit):
            failed.append(name)
            continue
        if name == "paper":
            write_study(directory)
        publish(name, directory)
    return failed


def begin(name: str, directory: Path) -> None:
    """Put the newest rows in rounds, with their logs, into a directory, where `run` sets aside what has
    changed since. They are the published ones, or of an interrupted run, which began with the published ones.
    """
    source = max((PUBLISHED / name, *STAGED.glob(f"*/{name}")), key=_newest)
    rows = [dict(row) for row in rows_of(source) if in_rounds(row)]
    planned = {m.key for m in expand(read_suite(name))} if rows else set()
    if kept := [row for row in rows if row["key"].partition(ROUND)[0] in planned]:
        (directory / "logs").mkdir(parents=True)
        records.rewrite(directory / records.MEASUREMENTS, kept)
        for pattern in ("machine*.json", PROBLEMS, records.OUTDATED):
            for path in source.glob(pattern):
                shutil.copy(path, directory)
        for log in filter(None, (row.get("log") for row in kept)):
            if (source / log).is_file():
                shutil.copy(source / log, directory / log)


def _newest(directory: Path) -> str:
    """The time of its last row; "" without one."""
    return max((str(row.get("recorded_at")) for row in rows_of(directory)), default="")


def in_rounds(row: Mapping[str, Any]) -> bool:
    """Whether it belongs to a round of ours, or was measured beside one."""
    return bool(row.get("round") or row.get("beside_round"))


def ended(command: Sequence[str]) -> int:
    """The exit code of a command of the harness, which a Ctrl-C ends before this process."""
    with subprocess.Popen([sys.executable, "-m", "harness", *command], cwd=ROOT) as child:
        try:
            return child.wait()
        except KeyboardInterrupt:  # the child has it, too
            return child.wait()


def rows_of(directory: Path) -> Rows:
    """The rows of a suite or a series; none if there is no such directory."""
    return list(series_file.rows(directory)) or records.read(directory / records.MEASUREMENTS)


def is_of(rows: Rows, commit: str) -> bool:
    """Whether there are rows, all without changes of the code, and of that commit if not in rounds."""
    of = {row.get("commit") for row in rows if not in_rounds(row)}
    return of == {commit} and all(row.get("clean") is True for row in rows)


def minutes(rows: Rows) -> float | None:
    """How long the measurement took, by the times of the rows; None if they have none."""
    at = [(datetime.fromisoformat(str(row["recorded_at"])), row) for row in rows if row.get("recorded_at")]
    steps = [
        ((after - before).total_seconds(), row.get("solve_s") or row.get("time_limit_s") or 0.0)
        for (before, _), (after, row) in pairwise(sorted(at, key=itemgetter(0)))
    ]
    return sum(s for s, longest in steps if s <= LONGEST_PAUSE_S + longest) / 60 if steps else None


def publish(name: str, directory: Path) -> None:
    """Let a whole directory take the place of what is published under that name; both on one disk."""
    for unwanted in _unwanted(directory):
        shutil.rmtree(unwanted) if unwanted.is_dir() else unwanted.unlink()
    if (directory / SERIES_FILE).exists():
        drop_gaps(directory)
    pack(directory)
    for picture in directory.rglob("*.png"):
        slim(picture)
    target, old = PUBLISHED / name, directory.with_name(f"{name}.old")
    PUBLISHED.mkdir(parents=True, exist_ok=True)
    if target.exists():
        shutil.rmtree(old, ignore_errors=True)  # of an earlier attempt
        target.rename(old)
    directory.rename(target)
    shutil.rmtree(old, ignore_errors=True)


def slim(picture: Path) -> None:
    """Write it in 256 colours that cover all of its own, also the rare ones of a map: a third of the size."""
    with Image.open(picture) as image:
        small = image.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    small.save(picture, optimize=True)


def _unwanted(directory: Path) -> Iterator[Path]:
    """What is not published: locks, the scenes' arrays, answers that are large, and most logs."""
    yield from directory.glob("**/*.lock")
    yield from directory.glob("scenes")
    rows = counting([*map(dict, rows_of(directory))]) if directory.name in WITH_LOGS else []
    logs = {directory / str(row.get("log")) for row in rows if owner_of(row["solver"]) != OWNERS[0]}
    yield from (log for log in directory.glob("logs/*") if log not in logs)
    if sum(path.stat().st_size for path in directory.glob("answers/*")) > KEPT_KIB * 2**10:
        yield directory / "answers"


def write_index(folder: Path) -> Path:
    """Write FOLDER/index.md, a table of the suites in it; returns its path."""
    published = {name: rows for name in NAMES if (rows := rows_of(folder / name))}
    lines = []
    for name, rows in published.items():
        taken, verdicts = minutes(rows), Counter(row["verdict"] for row in rows)
        days = sorted({str(row["recorded_at"])[:DAY] for row in rows if row.get("recorded_at")})
        title, study = _title(folder / name), f"{name}/study/study.md"
        if (folder / study).is_file():
            title = f"[{title}]({study})"
        line: dict[str, Any] = {"suite": f"[{name}]({name})", "what": title}
        line |= {"measured": " to ".join(dict.fromkeys([*days[:1], *days[-1:]]))}
        line |= {"minutes": "–" if taken is None else f"{taken:.0f}", "commit": _commits(rows)}
        lines.append(line | {"rows": len(rows)} | {verdict: verdicts[verdict] for verdict in VERDICTS})
    machines = _machines([row for rows in published.values() for row in rows])
    text = (
        f"# Published results\n\nMeasured on {counted(len(machines), 'machine')}: {'; '.join(machines)}. "
        "Each row names its machine; a series (`gaps…`) has it in `series.sqlite`, and no day. "
        "`python -m harness report DIRECTORY` draws the report of a suite from its rows.\n\n"
    )
    table = pd.DataFrame(lines).rename(columns=lambda name: name.replace("_", " "))
    path = folder / "index.md"
    path.write_text(text + table.to_markdown(index=False) + "\n" + _how_fast(folder), "utf-8")
    return path


def _how_fast(folder: Path) -> str:
    """The table that README and the documents quote: of `speed`, and of series with proofs."""
    tables = [ours_and_others(read(folder / "speed"))] if rows_of(folder / "speed") else []
    machines = filter(None, (_machines(rows_of(folder / name)) for name in ("speed", "series")))
    where = "; many load cases on ".join(dict.fromkeys(map(listed, machines)))
    if rows_of(folder / "series"):
        rows = read(folder / "series").rows
        proven = {SERIES[name][0]: _seconds(folder / name) for name in SERIES if rows_of(folder / name)}
        tables.append(in_series(rows[rows["threads_asked"] == rows["threads_asked"].max()], proven))
    table = pd.concat([pd.DataFrame(), *tables])
    if table.empty:
        return ""
    return f"\n## How fast is it?\n\n{how_fast_table(table).markdown}\n\nMeasured on {where}.\n"


def in_series(rows: pd.DataFrame, proven: Mapping[str, pd.Series[float]]) -> pd.DataFrame:
    """Lines as `ours_and_others` makes them, for one of many load cases: the seconds of a later one if the
    solver has an update or a warm start, else of the first.

    rows : of suite `series`. proven : by scene, the seconds of each case of ours, the proof of its error
    included; `seconds_most` is the slowest case. Libraries and textbook methods prove nothing.
    """
    lines = []
    for scene, seconds in proven.items():
        of_scene = compared(rows[(rows["scene"] == scene) & rows["case"].notna()])
        measured = [owner for owner in OWNERS[1:] if owner in {*of_scene["owner"]}]
        fastest = dict.fromkeys(OWNERS[1:], np.nan) | {
            owner: of_fastest(owner, of_scene, "later_s", "cold_s").fillna(np.inf).min() for owner in measured
        }
        line = {"question": IN_SERIES, "n": of_scene["n"].min()}
        lines.append(line | against_ours(pd.DataFrame([{"ours": seconds.mean()} | fastest])))
        lines[-1] |= {"seconds_most": seconds.max()}
    return pd.DataFrame(lines)


def _seconds(series: Path) -> pd.Series[float]:
    """The seconds of each case, the proof of its error included."""
    return pd.DataFrame(rows_of(series)).reindex(columns=["setup_s", "solve_s", "form_s"]).sum(axis=1)


def _machines(rows: Rows) -> list[str]:
    return sorted({str(row["machine"]) for row in rows if row.get("machine")})


def _title(directory: Path) -> str:
    suite = directory / "suite.toml"
    if not suite.is_file():
        return "Many load cases of random gaps"
    return str(tomllib.loads(suite.read_text("utf-8")).get("title", ""))


def _commits(rows: Rows) -> str:
    """The commits of some rows, shortened; changes, and changes not known, are named."""
    words = {True: "", False: ", with changes", None: ", changes not known"}
    known = {(str(row.get("commit") or "not recorded")[:DIGITS], row.get("clean")) for row in rows}
    return "; ".join(sorted(commit + words[clean] for commit, clean in known))


if __name__ == "__main__":
    sys.exit(main())
