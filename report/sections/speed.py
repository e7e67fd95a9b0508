"""Time of each method against contacts and size, products with Q by scene, and the speed of the machine."""

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd
from matplotlib.figure import Figure as Drawing

from report.analysis.standings import best_tolerances, seconds_text, shown, spreads
from report.analysis.time_to_solution import exponent
from report.document.blocks import Column, Figure, Section, Table, number, records, word
from report.document.numbers import spread, whole
from report.figures import style
from report.figures.line_charts import MARKS, against_contacts, entries, styles_of, yardstick
from report.results.reader import Results
from report.results.rows import in_order

PANEL = 3.0  # inches
FEWEST = 3  # sizes of a fit, and scenes of a size for a line against their contacts
#: What grows with the size, its unit, and the smallest value that reflects the size of Q.
GROWING = {
    "load_case_s": ("seconds per load case", 1e-2),
    "once_s": ("seconds of preparation per assembly", 1e-2),
    "working_mib": ("working memory, MiB", 8.0),
}


def machine(results: Results) -> Section | None:
    rows = results.rows[results.rows["cholesky_s"].notna()]
    if rows.empty:
        return None
    at = ["n", "m", "threads"]
    lines = spreads(rows, at, ["cholesky_s", "product_s"])
    lines = lines.assign(runs=rows.groupby(at, dropna=False).size()).reset_index()
    lines["gflops"] = lines["m"] ** 3 / 3 / lines["cholesky_s"] / 1e9
    lines["gb_per_s"] = 8 * lines["m"] ** 2 / lines["product_s"] / 1e9
    columns = [number(name, name, whole) for name in (*at, "runs")]
    columns += [
        Column("Cholesky of Q, s", spread("cholesky_s")),
        number("10⁹ operations/s", "gflops"),
        Column("product Qv, s", spread("product_s")),
        number("GB/s read", "gb_per_s"),
    ]
    caption = "*What the machine can do*, measured after each solve in its process: medians (range)."
    table = Table("speed-yardsticks", caption, lines, columns)
    return Section("The machine's own speed", [table])


def contacts(results: Results) -> Section | None:
    """Time against the contacts, for sizes with several loads, as in the paper's Figures 5 to 7."""
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


def scaling(results: Results) -> Section | None:
    """Exponents in n for the scenes scaling/…, one joint on finer and finer meshes."""
    cells = best_tolerances(results.cells[results.cells["scene"].str.startswith("scaling/")])
    within = cells[cells["verdict"] == "within"].sort_values("n")
    if not within["cholesky_s"].notna().any() or within["n"].nunique() < FEWEST:
        return None
    lines = [_exponents(method, of) for method, of in within.groupby("method")]
    table = pd.DataFrame(lines).set_index("method").loc[in_order(within, "method")].reset_index()
    columns = [
        word("solver (form)", "method"),
        number("sizes", "sizes", whole),
        number("largest n", "largest", whole),
        *(word(f"exponent of {what}", f"{name} shown") for name, (what, _) in GROWING.items()),
    ]
    caption = (
        "*Exponents in n*: slopes in log–log with their standard errors, within the limit, without times "
        "below 10 ms and memory below 8 MiB."
    )
    figure = Figure(
        "scaling", "*Time and working memory against the size*, within the limit.", _growth(within)
    )
    return Section(
        "Scaling with the problem size", [figure, Table("scaling-exponents", caption, table, columns)]
    )


def _exponents(method: object, cells: pd.DataFrame) -> dict[str, Any]:
    """The exponent in n of each of GROWING, and its text. Values that are too small are left out."""
    line: dict[str, Any] = {"method": method, "sizes": len(cells), "largest": cells["n"].max()}
    for name, (_, least) in GROWING.items():
        fit = exponent(cells["n"].tolist(), cells[name].where(cells[name] >= least).tolist())
        line |= {name: fit and fit.slope, f"{name} shown": str(fit or "")}
    return line


def _growth(within: pd.DataFrame) -> Drawing:
    styles = styles_of(within)
    drawing, panels = style.panels(2, 3.3, style.legend_entries(styles), sharex=True)
    sizes = within.groupby("n")[["cholesky_s", "m"]].median().dropna()
    limits = {
        "load_case_s": (sizes["cholesky_s"], "one Cholesky of Q"),
        "working_mib": (8 * sizes["m"] ** 2 / 2**20, "Q itself"),
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


#: The methods whose rows before version 0.4.0 give the products with Q as their iterations alone.
COUNTED_AS_ITERATIONS = ("newton",)
BY_SCENE = (
    "*Time and products with Q*: seconds per load case, and in brackets the products with Q per load case, "
    "where a method counts them. Of several tolerances, the fastest within the limit, else the least wrong. "
    "A lower bound where it ran out of time."
)


def methods(results: Results) -> Section | None:
    """Time and products with Q by scene, if at least two methods count their products."""
    cells = results.cells[results.cells["status"] != "unsupported"]
    cells = cells.assign(products=[_products(cell) for cell in records(cells)])
    if cells.loc[cells["products"].notna(), "solver"].nunique() < 2:
        return None
    cells = best_tolerances(cells)
    scenes = list(cells.sort_values(["n", "active"])["scene"].unique())
    lines = [_line(cells[cells["method"] == method]) for method in in_order(cells, "method")]
    columns = [word("method", "method"), *(Column(scene, _shown(scene)) for scene in scenes)]
    table = Table("methods", BY_SCENE, pd.DataFrame(lines), columns)
    return Section("Methods for contact problems", [table])


def _products(cell: Mapping[str, Any]) -> float:
    """The products with Q that the method counted; NaN if it counts none."""
    details = cell.get("details")
    products = details.get("products") if isinstance(details, Mapping) else None
    if products is None and cell["solver"] in COUNTED_AS_ITERATIONS and cell["status"] == "solved":
        products = cell["iterations"]
    return float("nan") if products is None else float(products)


def _line(cells: pd.DataFrame) -> dict[str, Any]:
    line: dict[str, Any] = {"method": cells["method"].iloc[0]}
    for cell in records(cells):
        line[cell["scene"]] = seconds_text(cell)
        line[f"{cell['scene']} products"] = cell["products"]
    return line


def _shown(scene: str) -> Callable[[Mapping[str, Any]], str]:
    def text(line: Mapping[str, Any]) -> str:
        seconds, products = line[scene], line[f"{scene} products"]
        if not isinstance(seconds, str):
            return ""
        return seconds + (f" ({whole(products)})" if products == products else "")

    return text
