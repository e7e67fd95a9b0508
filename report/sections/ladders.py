"""The ladders: where each solver fails, and whether it reports the failure."""

from __future__ import annotations

import pandas as pd

from harness.results.schema import LADDERS, OWNERS
from report.analysis.outcomes import OUTCOMES, WRONG_CLAIMED, with_outcomes
from report.document.blocks import Block, Figure, Section, Table, Text, number, word
from report.document.numbers import MISSING, as_number, counted, power, whole
from report.figures.ladder_map import ladder_map
from report.results.labels import in_order
from report.results.reader import Results

KINDS = list(dict.fromkeys(OUTCOMES.values()))
NOT_RUN = "not run"


def section(results: Results) -> Section | None:
    if results.cells.empty:
        return None
    cells = with_outcomes(results.cells)
    order = in_order(cells)
    ladders = rungs_in_order(results, cells)
    blocks: list[Block] = [
        Text(claims(cells)),
        Figure(
            "ladders",
            "*Every solver on every rung; each ladder grows harder to the right.* A number k in a wrong "
            "answer: its error is up to 10ᵏ times the limit max(1e-7 mm, 100 cond(K) 2⁻⁵³ max|x*|), what "
            "conditioning allows in float64; ∞: beyond 10⁹⁹. Empty: not run.",
            ladder_map(cells, order, ladders),
        ),
        honesty(cells, order),
        breaking_points(cells, order, ladders),
    ]
    return Section("Where each solver fails, and whether it reports it", blocks)


def rungs_in_order(results: Results, cells: pd.DataFrame) -> dict[str, list[str]]:
    """The rungs of each ladder in the order of the suite, others in the order of measurement."""
    listed = [scene for scene in results.suite.get("scenes", []) if scene in set(cells["scene"])]
    ladders: dict[str, list[str]] = {}
    for scene in dict.fromkeys([*listed, *cells["scene"]]):
        _, ladder, rung = scene.split("/")
        ladders.setdefault(ladder, []).append(rung)
    return ladders


def claims(cells: pd.DataFrame) -> str:
    """How often a wrong answer is reported as solved."""
    wrong = cells["outcome"] == WRONG_CLAIMED
    counts = [
        f"{wrong[of].sum()} of {counted(int(of.sum()), 'row')} of {whose}"
        for owner, whose in zip(OWNERS, ("our solvers", "textbook methods", "libraries"), strict=True)
        if (of := cells["owner"] == owner).any()
    ]
    return f"Wrong answers reported as solved: {', '.join(counts)}."


def honesty(cells: pd.DataFrame, order: list[str]) -> Table:
    counts = pd.crosstab(cells["label"], cells["outcome"]).reindex(index=order, columns=KINDS, fill_value=0)
    solved = cells[cells["status"] == "solved"]
    share = solved["displacement_error_mm"] / solved["limit_mm"]
    wrong = cells[cells["outcome"] == WRONG_CLAIMED].groupby("label")["scene"]
    table = counts.assign(
        rungs=counts.sum(axis=1),
        worst_share=share.groupby(solved["label"]).max(),
        backward_error=solved.groupby("label")["backward_error"].median(),
        where=wrong.agg(lambda scenes: ", ".join(scene.split("/", 1)[1] for scene in scenes)),
    )
    columns = [word("solver (form)", "label"), number("rungs", "rungs", whole)]
    columns += [number(name, name, whole) for name in KINDS[:-1] if name != WRONG_CLAIMED]
    columns.append(number(f"**{WRONG_CLAIMED}**", WRONG_CLAIMED, lambda k: f"**{k}**" if k else "0"))
    columns.append(number("largest error / limit, reported solved", "worst_share", power))
    caption = "*Wrong answers reported as solved* are the worst outcome."
    return Table("honesty", caption, table.reset_index(), columns)


def breaking_points(cells: pd.DataFrame, order: list[str], ladders: dict[str, list[str]]) -> Table:
    by_line = {key: line for key, line in cells.groupby(["label", "ladder"])}
    lines = [
        {"label": label}
        | {ladder: _first_broken(by_line.get((label, ladder)), rungs) for ladder, rungs in ladders.items()}
        for label in order
    ]
    columns = [word("solver (form)", "label"), *(word(ladder, ladder) for ladder in ladders)]
    caption = (
        "*Breaking points: the first rung of each ladder without a correct answer.* ×: reported as solved. "
        f"{MISSING}: correct on every rung that was run."
    )
    return Table("breaking-points", caption, pd.DataFrame(lines), columns)


def _first_broken(line: pd.DataFrame | None, rungs: list[str]) -> str:
    if line is None:
        return NOT_RUN
    broken = line[line["verdict"] != "within"].set_index("rung")["outcome"]
    first = next((rung for rung in rungs if rung in broken), MISSING)
    return f"{first} ×" if broken.get(first) == WRONG_CLAIMED else first


def rungs(results: Results) -> Section | None:
    """The rungs themselves, the measurements without a correct answer, and what the model rejects."""
    if results.cells.empty or "scene" not in results.problems:
        return None
    known = results.problems[results.problems["scene"].str.startswith(LADDERS)]
    known = known.drop_duplicates("scene", keep="last").reset_index(drop=True)
    limits = results.rows.groupby("scene")["limit_mm"].max()
    names = ("n", "m", "active", "cond_K", "reference_bound_mm")
    taken = known[known["scene"].isin(limits.index)].reindex(columns=["scene", "title", *names])
    taken = taken.assign(**{name: taken[name].map(as_number).astype(float) for name in names})
    taken["limit_mm"] = taken["scene"].map(limits)
    columns = [word("rung", "scene"), word("description", "title")]
    columns += [number(name, name, whole) for name in ("n", "m", "active")]
    columns += [
        number("cond(K)", "cond_K", power),
        number("limit, mm", "limit_mm", power),
        number("reference error bound, mm", "reference_bound_mm", power),
    ]
    blocks: list[Block] = [
        Table("rungs", "*The measured rungs.* Bound 0: the reference is exact.", taken, columns)
    ]
    broken = with_outcomes(results.cells).query("verdict != 'within'").sort_values(["scene", "label"])
    if len(broken):
        kept = ["label", "scene", "status", "verdict", "outcome", "displacement_error_mm", "limit_mm"]
        kept += ["backward_error", "iterations", "solve_s", "message"]
        columns = [word("rung", "scene"), word("solver (form)", "label"), word("status", "status")]
        columns += [
            number("error, mm", "displacement_error_mm", power),
            number("limit, mm", "limit_mm", power),
        ]
        columns.append(number("backward error", "backward_error", power))
        caption = "*Every measurement without a correct answer.*"
        blocks.append(Table("rungs-broken", caption, broken[kept], columns))
    if "refused" in known and known["refused"].notna().any():
        refused = known.loc[known["refused"].notna(), ["scene", "title", "refused"]]
        refused = refused.replace({"refused": {"": "**accepted, although the model does not cover it**"}})
        columns = [word("rung", "scene"), word("description", "title"), word("error message", "refused")]
        caption = (
            "*What the model rejects, as it should*: a clear error rather than a plausible wrong answer."
        )
        blocks.append(Table("rungs-refused", caption, refused, columns))
    return Section("The rungs", blocks)
