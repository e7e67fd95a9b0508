"""Writes the index of the published results: their code, the headline figures, the rows of each suite."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from harness.results.published import SERIES, names, rows_of, seconds
from report.document.blocks import Block, Column, Section, Table, Text, number, word
from report.document.numbers import listed, significant, tidy_power, whole
from report.results.reader import Results, read

from .headlines import (
    THREADS,
    accuracy_cost,
    fastest,
    gaps_sentence,
    ladder_score,
    methods_advice,
    ratio_sentence,
    road_sentence,
    series_rates,
)
from .pages import rendered

Rows = Mapping[str, Sequence[Mapping[str, Any]]]
DAY = 10  # characters of a time
SHORT = 12  # digits of a commit, in a table


def write_index(folder: Path) -> Path:
    """Write FOLDER/index.md from the rows of the directories in it; returns its path."""
    found = {name: rows_of(folder / name) for name in names() if (folder / name).is_dir()}
    results = {name: read(folder / name) for name in found if name not in SERIES}
    path = folder / "index.md"
    sections = [
        Section("Headlines", _headlines(folder, results)),
        Section("Suites", [_reports(found, results)]),
    ]
    title = f"Published results: {listed(commits(found))}"
    text = rendered("sections.md.j2", title=title, sections=[_about(found, results), *sections], csv=False)
    path.write_text(text, "utf-8")
    return path


def commits(found: Rows) -> list[str]:
    """The commits of the rows, each in full; what is not known of one is said."""
    states = {(row.get("commit"), row.get("clean")) for rows in found.values() for row in rows}
    words = {True: "", False: ", with changes", None: ", changes not known"}
    return sorted(f"commit {name}{words[clean]}" if name else "commit not recorded" for name, clean in states)


def _about(found: Rows, results: Mapping[str, Results]) -> Section:
    machines = sorted({str(name) for each in results.values() for name in each.rows["machine"].unique()})
    words = f"Measured {_days([row for rows in found.values() for row in rows])} on {listed(machines)}. "
    words += "Every figure below is computed from the rows. `python -m harness publish` measures them anew."
    return Section("What this is", [Text(words)])


def _days(rows: Sequence[Mapping[str, Any]]) -> str:
    days = sorted({str(row["recorded_at"])[:DAY] for row in rows if row.get("recorded_at")})
    return "" if not days else days[0] if len(days) == 1 else f"{days[0]} to {days[-1]}"


def _headlines(folder: Path, results: Mapping[str, Results]) -> list[Block]:
    blocks: list[Block] = []
    if "speed" in results:
        blocks += [
            Text(f"{ratio_sentence(results['speed'])} (the medians over the load cases)."),
            _fastest(results),
        ]
    if "uncondensed" in results:
        blocks.append(Text(f"{road_sentence(results['uncondensed'])}."))
    if "accuracy" in results:
        blocks.append(_accuracy(results["accuracy"]))
    if "series" in results:
        blocks.append(_series(results["series"]))
    if "methods" in results:
        blocks.append(Text(f"`methods`: {methods_advice(results['methods'])}"))
    blocks += [
        Text(f"`{name}`: {ladder_score(results[name])}") for name in ("hard", "hard-full") if name in results
    ]
    return [
        *blocks,
        *(Text(f"`{name}`: {gaps_sentence(folder / name)}.") for name in SERIES if (folder / name).is_dir()),
    ]


def _table(caption: str, data: pd.DataFrame, columns: list[Column]) -> Text:
    return Text(f"{caption}\n\n{Table('', '', data, columns).markdown}")


def _fastest(results: Mapping[str, Results]) -> Text:
    caption = (
        "*Which solver to use*, by suite `speed`: with two threads, the line within the limit on every scene "
        "of the size with the least geometric mean of the seconds, and how many times as fast it is as the "
        "fastest library on each scene, the median. From the scene on: with any number of threads, and with "
        "what makes the matrices."
    )
    columns = [
        number("n", "n", whole),
        word("question", "question"),
        word("use", "method"),
        number("s", "seconds"),
        Column("times as fast as the fastest library", lambda line: significant(line["times"], 2)),
    ]
    return _table(caption, fastest(results["speed"]), columns)


def _accuracy(results: Results) -> Text:
    caption = (
        "*What accuracy costs*, by suite `accuracy`: the fastest settings that reach it on every scene of "
        "the size, and those of the libraries; seconds per load case."
    )
    columns = [
        number("n", "n", whole),
        number("error ≤, mm", "accuracy_mm", tidy_power),
        word("use", "use"),
        number("s", "seconds"),
        word("of the libraries", "library"),
        number("s ", "library_s"),
    ]
    return _table(caption, accuracy_cost(results), columns)


def _series(results: Results) -> Text:
    caption = (
        f"*Many load cases on one assembly*, by suite `series`, {THREADS} threads: the most per second, and "
        "the seconds of the fastest library's next case."
    )
    columns = [
        number("n", "n", whole),
        word("use", "solver"),
        Column("cases/s", lambda line: significant(line["rate"], 2)),
        number("fastest library, s per case", "library_s"),
    ]
    return _table(caption, series_rates(results), columns)


def _reports(found: Rows, results: Mapping[str, Results]) -> Text:
    lines = []
    for name, rows in found.items():
        taken, state = seconds(rows), commits({name: rows})
        title = (
            str(results[name].suite.get("title") or name) if name in results else "A series of random gaps"
        )
        lines.append(
            {
                "suite": f"[{name}]({name})",
                "title": title,
                "rows": len(rows),
                "within": sum(row["verdict"] == "within" for row in rows),
                "minutes": None if taken is None else taken / 60,
                "measured": _days(rows),
                "commit": "several" if len(state) > 1 else state[0].removeprefix("commit ")[:SHORT],
            }
        )
    columns = [word("suite", "suite"), word("what", "title"), number("rows", "rows", whole)]
    columns += [number("within the limit", "within", whole), number("minutes", "minutes", whole)]
    columns += [word("measured", "measured"), word("commit", "commit")]
    caption = (
        "Each directory has the rows. `python -m harness report results/published/speed` draws the report of "
        "one from them: report.md with its pictures and tables, and index.html for a browser."
    )
    return _table(caption, pd.DataFrame(lines), columns)
