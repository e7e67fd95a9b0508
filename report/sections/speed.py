"""Time: relative to the libraries and to the machine, against contacts and size, from the scene on, in a
series.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing

from report.analysis.fit import exponent
from report.analysis.precision import judged, with_errors
from report.analysis.roads import LOAD_CASES, STAGES, roads
from report.analysis.seconds import seconds_text
from report.analysis.standings import best_tolerances, shown
from report.analysis.versions import asked_for
from report.document.blocks import Column, Figure, Section, Table, number, word
from report.document.numbers import MISSING, counted, significant, spread, whole
from report.figures import style
from report.figures.bars import Looks, stacked
from report.figures.lines import MARKS, against_contacts, entries, styles_of, yardstick
from report.results.labels import in_order
from report.results.reader import Results

PANEL = 3.0  # inches
FEWEST = 3  # sizes of a fit, and scenes of a size for a line against their contacts
FEWEST_PROFILED = 5  # load cases
PLANNED = 0.75  # share of the scenes in the plan of a method, for it to be in a profile
FACTORS = {1.0: "fastest", 2.0: "τ ≤ 2", 10.0: "τ ≤ 10"}
#: Whom a method is compared with, and their names in headings.
OPPONENTS = {"library": "library", "textbook": "textbook method"}
MADE = ("model_s", "K_s", "factors_s", "Q_s")  # before the solver's own preparation
FROM_SCENE: Looks = {
    "model_s": ("finite-element model", "#C9C9C9", None),
    "K_s": ("condensation", "#5A5A5A", None),
    "factors_s": ("factors of K", style.PURPLE, None),
    "Q_s": ("Q", style.VERMILLION, "xxxx"),
    "once_s": ("preparation", style.GREEN, None),
    "solving_s": ("set-up and solve", style.BLUE, None),
    "recovery_s": ("p and x of the dual", style.SKY, "...."),
}
STEPS: Looks = {
    "convert_s": ("convert", "#B8B8B8", None),
    "prepare_s": ("prepare, once per assembly", style.GREEN, None),
    "setup_s": ("set up", style.ORANGE, "////"),
    "solve_s": ("solve", style.BLUE, None),
    "form_s": ("p and x of the dual", style.SKY, "...."),
}
#: What grows with the size, its unit, and the smallest value that reflects the size of Q.
GROWING = {
    "load_case_s": ("seconds per load case", 1e-2),
    "once_s": ("seconds of preparation per assembly", 1e-2),
    "working_mib": ("working memory, MiB", 8.0),
}


def _lines(method_of: pd.DataFrame, line: Any, name: str = "method") -> pd.DataFrame:
    """One line per method (or `name`), in their order."""
    return pd.DataFrame(
        [{name: each} | line(method_of[method_of[name] == each]) for each in in_order(method_of, name)]
    )


def _spread(values: pd.Series[float], name: str) -> dict[str, Any]:
    """As the `spread` of a column shows it."""
    return {name: values.median(), f"{name}_least": values.min(), f"{name}_most": values.max()}


def _ends(cells: pd.DataFrame) -> list[str]:
    """Of each size the scenes with the fewest and the most active contacts."""
    scenes = cells.drop_duplicates("scene").sort_values(["n", "active", "scene"])
    return [
        scene for _, of_size in scenes.groupby("n")["scene"] for scene in {of_size.iloc[0], of_size.iloc[-1]}
    ]


def load_cases(results: Results) -> pd.DataFrame:
    """The rows within the limit, with `method`, the seconds per load case and their ratios.

    load_case_s : set-up + solve + form
    total_s : the same with the solver's own preparation, paid once per assembly
    to_cholesky : load_case_s over one Cholesky factorisation of Q in the same process
    to_library, total_to_library : over the fastest library on the same scene, in any form, by its median
    to_textbook, total_to_textbook : the same over the fastest textbook method
    """
    rows = results.rows
    keys = ["scene", "solver", "form", "variant", "tolerance", "threads"]
    names = results.cells_by_threads()[[*keys, "method"]]
    cases = rows[rows["verdict"] == "within"].merge(names, on=keys)
    cases["load_case_s"] = cases[["setup_s", "solve_s", "form_s"]].sum(axis=1)
    cases["total_s"] = cases["load_case_s"] + cases[["convert_s", "prepare_s"]].sum(axis=1)
    cases["to_cholesky"] = cases["load_case_s"] / cases["cholesky_s"]
    for group in OPPONENTS:
        lines = cases[cases["owner"] == group].groupby(["scene", "threads", "method", "tolerance"])
        fastest = lines[["load_case_s", "total_s"]].median().groupby(["scene", "threads"]).min()
        fastest.columns = pd.Index(["fastest", "fastest_total"])
        cases = cases.join(fastest, on=["scene", "threads"])
        cases[f"to_{group}"] = cases["load_case_s"] / cases.pop("fastest")
        cases[f"total_to_{group}"] = cases["total_s"] / cases.pop("fastest_total")
    return cases


def relative(results: Results) -> Section | None:
    """Per size and number of threads, in a run with machine benchmarks."""
    cases = load_cases(results)
    if cases.empty or not cases["cholesky_s"].notna().any():
        return None

    def line(mine: pd.DataFrame) -> dict[str, Any]:
        found: dict[str, Any] = {"scenes": mine["scene"].nunique(), "runs": len(mine)}
        for name in [*(f"{of}{group}" for group in OPPONENTS for of in ("to_", "total_to_")), "to_cholesky"]:
            found |= _spread(mine[name], name) | {name: mine.groupby("scene")[name].median().median()}
        return found

    lines = []
    for _, group in cases.groupby(["n", "threads"]):
        lines.append(_lines(group, line).assign(**group[["n", "threads"]].iloc[0]))
    table = pd.concat(lines, ignore_index=True)
    columns = [
        number("n", "n", whole),
        number("threads", "threads", whole),
        word("solver (form)", "method"),
        *(
            Column(f"{what} / fastest {name}", spread(of + group))
            for group, name in OPPONENTS.items()
            for what, of in (("per load case", "to_"), ("with preparation", "total_to_"))
        ),
        Column("per load case / one Cholesky of Q", spread("to_cholesky")),
    ]
    caption = (
        "*Relative times within the limit*: over those of the fastest library and of the fastest textbook "
        "method on the same scene in any form, and over one Cholesky factorisation of Q in the same process. "
        "The median over the scenes (range of all runs); 0.1 is ten times as fast."
    )
    return Section("Relative speed", [Table("speed-ratios", caption, table, columns, keys=3)])


def machine(results: Results) -> Section | None:
    rows = results.rows[results.rows["cholesky_s"].notna()]
    if rows.empty:
        return None
    lines = []
    for (n, threads), group in rows.groupby(["n", "threads"]):
        m = float(group["m"].iloc[0])
        line: dict[str, Any] = {"n": n, "m": m, "threads": threads, "runs": len(group)}
        line |= _spread(group["cholesky_s"], "cholesky_s") | _spread(group["product_s"], "product_s")
        line |= {
            "gflops": m**3 / 3 / line["cholesky_s"] / 1e9,
            "gb_per_s": 8 * m**2 / line["product_s"] / 1e9,
        }
        lines.append(line)
    columns = [number(name, name, whole) for name in ("n", "m", "threads", "runs")]
    columns += [
        Column("Cholesky of Q, s", spread("cholesky_s")),
        number("10⁹ operations/s", "gflops"),
        Column("product Qv, s", spread("product_s")),
        number("GB/s read", "gb_per_s"),
    ]
    caption = "*What the machine can do*, measured after each solve in its process: medians (range)."
    return Section(
        "The machine's own speed", [Table("speed-yardsticks", caption, pd.DataFrame(lines), columns)]
    )


def contacts(results: Results) -> Section | None:
    """For sizes with several loads, as in the paper's Figures 5 to 7."""
    cells = best_tolerances(shown(results.cells))
    sizes = cells.groupby(["n", "m"], dropna=False)
    cells = cells[sizes["active"].transform("nunique") >= FEWEST]
    if cells.empty or cells["load_case_s"].isna().all():
        return None
    groups, styles = [*cells.groupby(["n", "m"], dropna=False)], styles_of(cells)
    drawing, panels = style.panels(len(groups), PANEL, entries(cells, styles))
    for axes, ((n, m), of_size) in zip(panels, groups, strict=True):
        against_contacts(axes, of_size, styles)
        axes.set_title(f"n = {n:.0f}" + (f", m = {m:.0f}" if m > 0 else ""), pad=5)
        if of_size["cholesky_s"].notna().any():
            yardstick(axes, of_size.groupby("active")["cholesky_s"].median().dropna(), "one Cholesky of Q")
    axes.set_xlabel("active contacts")
    caption = (
        "*Seconds per load case against the active contacts*, with the best tolerance on each scene; "
        f"methods run on at least half of the scenes.{style.forms_text(cells)} "
        f"{MARKS.format(limit=results.limit)}"
    )
    return Section("Time against active contacts", [Figure("time-active", caption, drawing)])


def from_scene(results: Results) -> Section | None:
    """The seconds of every stage, in a run with sparse and dense forms."""
    lines = roads(results)
    if lines.empty:
        return None
    order = in_order(lines)
    table = lines.assign(place=lines["label"].map(order.index), made_s=lines[[*MADE]].sum(axis=1))
    table = table.sort_values(["n", "active", "scene", "total_1_s", "place"])
    kept = ["scene", "n", "m", "active", "label", "threads", "tolerance", "status", "verdict"]
    kept += [*STAGES, "made_s", *(f"total_{k}_s" for k in LOAD_CASES)]
    kept += ["stored_mib", "peak_rss_mib", "load_case_s", "time_limit_s"]
    columns = [word("scene", "scene"), word("solver (form)", "label"), number("matrices, s", "made_s")]
    columns += [Column(f"{counted(k, 'load case')}, s", partial(_total, load_cases=k)) for k in LOAD_CASES]
    columns += [
        number("dense matrices, MiB", "stored_mib", whole),
        number("peak, MiB", "peak_rss_mib", whole),
    ]
    caption = (
        "*From the scene to the answer*, medians of the repeats, totals of several load cases extrapolated. "
        "Cached matrices count with the seconds that they took to make."
    )
    blocks: list[Figure | Table] = [Table("roads", caption, table[kept], columns, keys=2)]
    answered = best_tolerances(lines[lines["total_1_s"].notna()])
    answered = answered[answered["scene"].isin(_ends(answered))]
    if answered.groupby("scene")["method"].nunique().max() > 1:
        answered = answered[answered.groupby("scene")["method"].transform("nunique") > 1]
        caption = (
            "*From the scene to the answer of one load case*, the fastest first, in seconds; of each size, "
            "the scenes with the fewest and the most active contacts."
        )
        blocks.insert(0, Figure("roads", caption, stacked(answered, "total_1_s", FROM_SCENE)))
    return Section("From scene to answer", blocks)


def _total(line: Mapping[str, Any], load_cases: int) -> str:
    if line["verdict"] == "within":
        return significant(line[f"total_{load_cases}_s"])
    return seconds_text(line) if load_cases == LOAD_CASES[0] else ""


def steps(results: Results) -> Section | None:
    """Where no stage before the solver is known: the solver's own steps."""
    cells = best_tolerances(shown(results.cells))
    cells = cells[(cells["verdict"] == "within") & (cells["total_s"] > 0)]
    cells = cells[cells["scene"].isin(_ends(cells))]
    if cells.empty or len(roads(results)):
        return None
    caption = (
        "*Where the time goes*, within the limit, the fastest first; of each size, the scenes with the "
        "fewest and the most active contacts. The factor of K and Q, which the dense forms share, are not "
        "included."
    )
    return Section("Where the time goes", [Figure("time-steps", caption, stacked(cells, "total_s", STEPS))])


def variants(results: Results) -> Section | None:
    """A solver without one of its ingredients, relative to the complete solver."""
    cells = results.cells_by_threads()
    cells = cells[(cells["status"] != "unsupported") & ~asked_for(cells)]
    keys = ["solver", "form", "scene", "threads", "tolerance"]
    plain = cells[(cells["variant"] == "") & (cells["verdict"] == "within")]
    both = cells[cells["variant"] != ""].merge(plain, on=keys, suffixes=("", "_plain"))
    if both.empty or both["cholesky_s"].isna().all():
        return None
    both["ratio"] = (both["load_case_s"] / both["load_case_s_plain"]).where(both["verdict"] == "within")

    def line(mine: pd.DataFrame) -> dict[str, Any]:
        found = {"scenes": len(mine), "within": int((mine["verdict"] == "within").sum())}
        found |= _spread(mine["ratio"], "ratio") | {"error_mm": mine["displacement_error_mm"].max()}
        return found | {name: mine[name].median() for name in ("iterations", "iterations_plain")}

    columns = [
        word("solver (form), variant", "method"),
        number("scenes", "scenes", whole),
        number("within", "within", whole),
        Column("time relative to the complete solver", spread("ratio")),
        number("iterations", "iterations", whole),
        number("complete", "iterations_plain", whole),
        number("largest error, mm", "error_mm"),
    ]
    caption = (
        "*One ingredient omitted or replaced*: seconds per load case over those of the complete solver on "
        "the same scene, the median (range)."
    )
    return Section(
        "What each ingredient contributes", [Table("ingredients", caption, _lines(both, line), columns)]
    )


def scaling(results: Results) -> Section | None:
    """Exponents in n for the scenes scaling/…, one joint on finer and finer grids."""
    cells = best_tolerances(results.cells[results.cells["scene"].str.startswith("scaling/")])
    within = cells[cells["verdict"] == "within"].sort_values("n")
    if not cells["cholesky_s"].notna().any() or cells["n"].nunique() < FEWEST:
        return None

    def fitted(mine: pd.DataFrame, names: Iterable[str]) -> dict[str, Any]:
        found: dict[str, Any] = {"sizes": len(mine), "largest": mine["n"].max()}
        for name in names:
            least = GROWING[name][1] if name in GROWING else 0.0
            fit = exponent(mine["n"].tolist(), mine[name].where(mine[name] >= least, 0.0).tolist())
            found |= {name: fit and fit.slope, f"{name} shown": str(fit) if fit else MISSING}
        return found

    lines = _lines(within, partial(fitted, names=GROWING))
    once = within.dropna(subset=["cholesky_s"]).drop_duplicates("scene")  # not timed in the sparse form
    for name, what in (("cholesky_s", "one Cholesky of Q"), ("product_s", "one product Qv")):
        line = {key.replace(name, "load_case_s"): value for key, value in fitted(once, [name]).items()}
        lines = pd.concat([lines, pd.DataFrame([{"method": what} | line])], ignore_index=True)
    columns = [
        word("solver (form)", "method"),
        number("sizes", "sizes", whole),
        number("largest n", "largest", whole),
    ]
    for name, (what, _) in GROWING.items():
        columns.append(Column(f"exponent of {what}", partial(_exponent, name=f"{name} shown")))
    caption = (
        "*Exponents in n*: slopes in log–log with their standard errors, within the limit, without times "
        "below 10 ms and memory below 8 MiB."
    )
    figure = Figure(
        "scaling", "*Time and working memory against the size*, within the limit.", _growth(within)
    )
    return Section(
        "Scaling with the problem size", [figure, Table("scaling-exponents", caption, lines, columns)]
    )


def _exponent(line: Mapping[str, Any], name: str) -> str:
    return line[name] if isinstance(line[name], str) else MISSING


def _growth(within: pd.DataFrame) -> Drawing:
    styles = styles_of(within)
    drawing, panels = style.panels(2, 3.3, style.legend_entries(styles), sharex=True)
    known = within.groupby("n")[["cholesky_s", "m"]].median().dropna()
    limits = {
        "load_case_s": (known["cholesky_s"], "one Cholesky of Q"),
        "working_mib": (8 * known["m"] ** 2 / 2**20, "Q itself"),
    }
    for axes, (name, limit) in zip(panels, limits.items(), strict=True):
        for method, look in styles.items():
            line = within[within["method"] == method]
            axes.plot(line["n"], line[name].where(line[name] >= GROWING[name][1]), **look)
        yardstick(axes, *limit)
        axes.set(xscale="log", yscale="log", ylabel=GROWING[name][0])
        style.plain_log(axes.yaxis)
    ticks = sorted(within["n"].unique())
    axes.set_xticks(ticks, [f"{n:.0f}" for n in ticks])
    axes.minorticks_off()
    axes.set_xlabel("n")
    return drawing


def profiles(results: Results) -> Section | None:
    """Performance profiles (Dolan and Moré, Mathematical Programming 91:201-213, 2002) at the limit."""
    times = ratios(results.cells)
    if len(times) < FEWEST_PROFILED or len(times.columns) < 2:
        return None
    lines = pd.DataFrame({"method": times.columns, "load_cases": len(times)})
    lines["answered"] = np.isfinite(times).sum().to_numpy()
    columns = [word("solver (form)", "method"), number("load cases", "load_cases", whole)]
    columns.append(number(f"within {results.limit}", "answered", whole))
    for factor, heading in FACTORS.items():
        lines[f"within_{factor:g}"] = (times <= factor).sum().to_numpy()
        columns.append(number(heading, f"within_{factor:g}", whole))
    caption = (
        f"*Performance profiles over {counted(len(times), 'load case')}*: the share that a solver answers "
        f"within {results.limit}, with the best of its tolerances, in at most τ times the time of the "
        "fastest."
    )
    figure = Figure(
        "profiles", caption, _profiles(times, styles_of(results.cells[results.cells["method"].isin(times)]))
    )
    table = Table("profiles", "*The profiles in numbers*: load cases.", lines, columns)
    return Section("Performance profiles", [figure, table])


def ratios(cells: pd.DataFrame) -> pd.DataFrame:
    """Time over that of the fastest, by scene and method; infinite if the limit was not met. Compared are the
    methods planned for PLANNED of the scenes, on those planned for all of them, which the reference can judge
    and one answers.
    """
    cells = with_errors(cells[cells["status"] != "unsupported"])
    planned = cells.pivot_table(index="scene", columns="method", values="n", aggfunc="size").notna()
    often = planned.columns[planned.mean() >= PLANNED]
    common = planned.index[planned[often].all(axis=1)]
    cells = cells[cells["method"].isin(often) & cells["scene"].isin(common)]
    known = [scene for scene, of in cells.groupby("scene") if judged(of, of["limit_mm"].max())]
    good = cells[(cells["error"] <= cells["limit_mm"]) & cells["scene"].isin(known)]
    times = good.pivot_table(index="scene", columns="method", values="load_case_s", aggfunc="min")
    times = times.reindex(columns=in_order(cells, "method"))
    return times.div(times.min(axis=1), axis=0).fillna(np.inf)


def _profiles(times: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> Drawing:
    right = max(2.0, 1.3 * float(times.where(np.isfinite(times)).max().max()))
    drawing, (axes,) = style.panels(1, 3.2, style.legend_entries(styles))
    for method, look in styles.items():
        met, counts = np.unique(times[method][np.isfinite(times[method])], return_counts=True)
        shares = counts.cumsum() / len(times)
        axes.plot(met, shares, **style.marker_only(look))
        taus, heights = np.array([1.0, *met, right]), np.array([0.0, *shares, shares.max(initial=0)])
        axes.plot(taus, heights, drawstyle="steps-post", **(look | {"marker": ""}))
    axes.set(xscale="log", xlim=(0.97, right), ylim=(-0.04, 1.06))
    axes.set(xlabel="τ: time over that of the fastest", ylabel="share of the load cases")
    style.plain_log(axes.xaxis)
    return drawing
