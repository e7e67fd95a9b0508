"""What the published rows say in a few figures: for the index page and, held to it by a test, the README."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from harness.results import series_file
from harness.results.published import rows_of
from harness.results.schema import DENSE_FORMS
from report.analysis.outcomes import with_outcomes
from report.analysis.precision import ACCURACIES, swept
from report.analysis.relative import load_cases
from report.analysis.roads import roads
from report.analysis.standings import geometric_mean
from report.document.blocks import Table, Text
from report.document.numbers import listed, power, significant
from report.results.reader import Results
from report.sections import methods
from report.sections.ladders import in_house, libraries
from report.sections.recommendation import recommended
from report.sections.series import compared

#: The solver that the README compares with the libraries, in the form of each question.
OWN, FROM_SPARSE = "newton (dual)", "newton (sparse)"
THREADS = 2
ALONE, PREPARED, FROM_SCENE = "one load case", "one load case, preparation included", "one, from the scene on"


def fastest(speed: Results) -> pd.DataFrame:
    """By n and `question`, the line within the limit on every scene with the least geometric mean: `method`,
    its `seconds`, and `times`, how many times as fast as the fastest library, the median over the scenes.
    """
    cases = load_cases(speed)
    cases = cases[cases["threads"] == THREADS]
    lines = _fastest(cases, "load_case_s", ALONE) + _fastest(cases, "total_s", PREPARED)
    ways = roads(speed)
    if len(ways):
        library = ways[~ways["in_house"]].groupby("scene")["total_1_s"].min()
        ways = ways.assign(library_total_1_s=ways["scene"].map(library))
        lines += _fastest(ways, "total_1_s", FROM_SCENE)
    return pd.DataFrame(lines).sort_values("n", kind="stable")


def _fastest(lines: pd.DataFrame, seconds: str, question: str) -> list[dict[str, Any]]:
    found = []
    for n, of_size in lines.dropna(subset=[seconds]).groupby("n"):
        table = of_size.pivot_table(index="scene", columns="method", values=seconds, aggfunc="median")
        means = table.dropna(axis=1).apply(geometric_mean)
        if means.empty:
            continue
        mine = of_size[of_size["method"] == means.idxmin()]
        ratio = (mine[seconds] / mine[f"library_{seconds}"]).groupby(mine["scene"]).median().median()
        line = {"n": n, "question": question, "method": means.idxmin()}
        found.append(line | {"seconds": means.min(), "times": 1 / ratio})
    return found


def ratios(speed: Results) -> pd.DataFrame:
    """By n, how many times as fast OWN is as the fastest library: `alone`, and `prepared`, what each prepares
    included; the medians over the scenes, of the medians of the repeats.
    """
    cases = load_cases(speed)
    mine = cases[(cases["threads"] == THREADS) & (cases["method"] == OWN)]
    by_scene = mine.groupby(["n", "scene"])[["to_library", "total_to_library"]].median()
    return (1 / by_scene.groupby("n").median()).set_axis(["alone", "prepared"], axis=1)


def ratio_sentence(speed: Results) -> str:
    found = ratios(speed)
    alone, prepared = (listed([significant(x, 2) for x in found[name]]) for name in ("alone", "prepared"))
    sizes = listed([f"{n:.0f}" for n in found.index])
    return (
        f"With two threads, the in-house `newton` is {alone} times as fast as the fastest library at "
        f"n = {sizes}, and {prepared} times as fast if the preparation for each assembly is included"
    )


def road_sentence(uncondensed: Results) -> str:
    """From the scene to the first answer: the most seconds of FROM_SPARSE on a scene of each n, and the least
    that others take, times as long, of those with an answer within the limit.
    """
    ways = roads(uncondensed)
    sizes = ways.groupby("scene")["n"].first()
    own = ways[ways["method"] == FROM_SPARSE].groupby("scene")["total_1_s"].min()
    condensed = ways[ways["in_house"] & ways["form"].isin(DENSE_FORMS)]
    found = [own.groupby(sizes).max()]
    found += [
        (others.groupby("scene")["total_1_s"].min() / own).groupby(sizes).min()
        for others in (condensed, ways[~ways["in_house"]])
    ]
    seconds, condensing, library = (listed([significant(x, 2) for x in values]) for values in found)
    return (
        f"From the scene to the first answer, `newton` on the sparse form takes at most {seconds} s at n = "
        f"{listed([f'{n:.0f}' for n in found[0].index])}; with condensed matrices it is at least "
        f"{condensing} times as long, and with the fastest library in any form at least {library} times"
    )


def series_rates(series: Results) -> pd.DataFrame:
    """By n, the most load cases per second of any line with THREADS: `solver` and `rate`; `library_s`, the
    seconds of the fastest library's next case.
    """
    rows = compared(series.of_threads(THREADS).rows)
    rows = rows[rows["case"].notna()]
    found = []
    for n, of_size in rows.groupby("n"):
        lines = of_size.groupby(["solver", "variant"])["later_s"].median().dropna()
        name = ", ".join(word for word in lines.index[int(lines.argmin())] if word)
        found.append(
            {"n": n, "solver": name, "rate": 1 / lines.min(), "library_s": of_size["library_s"].iloc[0]}
        )
    return pd.DataFrame(found)


def series_sentence(series: Results) -> str:
    found = series_rates(series)
    first, *others = [f"{significant(rate, 2)}" for rate in found["rate"]]
    sizes = [f"{n:.0f}" for n in found["n"]]
    rates = [
        f"{first} load cases per second at n = {sizes[0]}",
        *map(" at ".join, zip(others, sizes[1:], strict=True)),
    ]
    library = listed([significant(seconds, 2) for seconds in found["library_s"]])
    return f"{listed(rates)}; a case of the fastest library takes {library} s"


def methods_advice(results: Results) -> str:
    """Which method for contact problems to use."""
    return _of_methods(results, Text)


def methods_table(results: Results) -> str:
    """Their seconds and products with Q."""
    return _of_methods(results, Table)


def _of_methods(results: Results, kind: type[Text] | type[Table]) -> str:
    section = methods.section(results)
    blocks = [] if section is None else section.blocks
    return "".join(block.markdown for block in blocks if isinstance(block, kind))


def contact_sentence(speed: Results) -> str:
    """The range of the scenes' closed contacts."""
    share = 100 * speed.rows["active"] / speed.rows["m"]
    return f"from {share.min():.0f} to {share.max():.0f} % of the contacts closed"


def ladder_score(hard: Results) -> str:
    """How often the in-house solvers are correct, and how often a library says solved of a wrong answer."""
    rungs = hard.about("ladders")
    cells = with_outcomes(rungs.cells)
    return f"{in_house(rungs, cells)} {libraries(cells)}"


def accuracy_cost(accuracy: Results) -> pd.DataFrame:
    """By n and accuracy, mm, the fastest settings that reach it on every scene, of all and of the libraries:
    `use` and `seconds`, `library` and `library_s`.
    """
    lines = []
    for _, of_size in swept(accuracy).groupby("n"):
        for wanted in ACCURACIES:
            best = recommended(of_size, wanted)
            library = recommended(of_size[~of_size["in_house"]], wanted)
            lines.append(best | {"library": library["use"], "library_s": library["seconds"]})
    return pd.DataFrame(lines)


def gaps(directory: Path) -> Mapping[str, Any]:
    """Of a series: `cases`, `within`, `rate` (cases per second of set-up, solve, x and bound), `bound_mm`."""
    rows = rows_of(directory)
    spent = sum(row.get(step) or 0.0 for row in rows for step in ("setup_s", "solve_s", "form_s"))
    return {
        "cases": len(rows),
        "within": sum(row["verdict"] == "within" for row in rows),
        "rate": len(rows) / spent,
        "bound_mm": max(np.inf if row.get("bound_mm") is None else row["bound_mm"] for row in rows),
    }


def gaps_sentence(directory: Path) -> str:
    found = gaps(directory)
    return (
        f"{found['cases']} random load cases on {_scene(directory)}: {found['within']} proven to be within "
        f"{power(found['bound_mm'], 2)} mm, {significant(found['rate'], 2)} per second, the proof included"
    )


def _scene(directory: Path) -> str:
    return str((series_file.read_facts(directory) or {})["scene"])
