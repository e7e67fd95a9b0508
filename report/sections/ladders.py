"""The ladders: where each solver fails, and whether it reports the failure.

In the picture a wrong answer says by how much: k if its error is up to 10ᵏ times the limit, ∞ beyond 10⁹⁹.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pandas as pd
from matplotlib.figure import Figure as Drawing
from matplotlib.patches import Patch

from harness.results.schema import LADDERS, OWNERS
from report.document.blocks import Block, Figure, Section, Table, Text, number, records, word
from report.document.numbers import as_number, out_of, power, raised, whole
from report.figures.line_charts import Cell, Group, grid
from report.figures.style import BLUE, VERMILLION
from report.results.reader import Results
from report.results.rows import in_order, rung_of

CORRECT, CORRECT_UNCLAIMED = "correct, reported solved", "correct, not reported solved"
WRONG_UNCLAIMED, WRONG_CLAIMED = "wrong, not reported solved", "wrong, reported solved"
NO_ANSWER, UNJUDGED = "no answer", "cannot be judged"
#: The outcome by verdict, and by whether the solver reported it as solved. Correct: within the row's limit.
OUTCOMES = {
    ("within", True): CORRECT,
    ("within", False): CORRECT_UNCLAIMED,
    ("outside", False): WRONG_UNCLAIMED,
    ("outside", True): WRONG_CLAIMED,
    ("no_answer", False): NO_ANSWER,
    ("cannot_be_judged", False): UNJUDGED,
    ("cannot_be_judged", True): UNJUDGED,
}
KINDS = list(dict.fromkeys(OUTCOMES.values()))

ROW, LEGEND = 0.16, 0.5  # inches
WIDEST = 66.0  # columns
#: Text, face, ink and hatch of an outcome, distinct in greyscale too; a wrong answer's text is its size.
LOOKS = {
    CORRECT: Cell("", BLUE),
    CORRECT_UNCLAIMED: Cell("", "#A9CFE8"),
    UNJUDGED: Cell("?", "white"),
    NO_ANSWER: Cell("–", "#E6E6E6"),
    WRONG_UNCLAIMED: Cell("", "white", "black", "//////"),
    WRONG_CLAIMED: Cell("", VERMILLION, "white"),
}
WRONG = (WRONG_UNCLAIMED, WRONG_CLAIMED)
LARGEST = 1e99  # times the limit: the cell has room for two digits

#: The quantity that the rungs of a ladder count, and its unit.
COUNTED = {
    "coincident": "tie, N/mm",
    "conditioning": "cond(K)",
    "contact_scale": "2^±k in g",
    "degeneracy": "weak, %",
    "duplicates": "apart",
    "pivoting": "family, m",
    "refinement": "nodes along",
    "supports": "spring, N/mm",
    "thickness": "times as thick",
    "together": "cond(K)",
    "units": "of K and A",
}


def section(results: Results) -> Section:
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
    ]
    return Section("Where each solver fails, and whether it reports it", blocks)


def rungs_in_order(results: Results, cells: pd.DataFrame) -> dict[str, list[str]]:
    """The rungs of each ladder in the order of the suite, others in the order of measurement."""
    listed = [scene for scene in results.suite.get("scenes", []) if scene in set(cells["scene"])]
    ladders: dict[str, list[str]] = {}
    for scene in dict.fromkeys([*listed, *cells["scene"]]):
        ladder, rung = rung_of(scene)
        ladders.setdefault(ladder, []).append(rung)
    return ladders


def with_outcomes(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells on rungs with `ladder`, `rung` and `outcome`, without the forms that a solver does not take."""
    taken = cells[cells["status"] != "unsupported"]
    names = [*map(rung_of, taken["scene"])]
    ends = zip(taken["verdict"], taken["status"] == "solved", strict=True)
    outcomes = [OUTCOMES.get(end, NO_ANSWER) for end in ends]
    return taken.assign(ladder=[one for one, _ in names], rung=[one for _, one in names], outcome=outcomes)


def ladder_map(cells: pd.DataFrame, order: list[str], ladders: dict[str, list[str]]) -> Drawing:
    """cells : with outcomes. order : labels, the rows. ladders : the rungs of each ladder, the columns."""
    groups = [
        Group(name, {f"{name}/{rung}": rung for rung in rungs}, COUNTED.get(name, ""))
        for name, rungs in ladders.items()
    ]
    squares = {(cell["label"], f"{cell['ladder']}/{cell['rung']}"): _cell(cell) for cell in records(cells)}
    drawing = grid({label: label for label in order}, groups, squares, ROW, WIDEST)
    edge: dict[str, Any] = {"edgecolor": "#888888", "linewidth": 0.5}
    handles = [
        Patch(facecolor=look.face, hatch=look.hatch, label=f"{name} {look.text}", **edge)
        for name, look in LOOKS.items()
    ]
    drawing.set_figheight(drawing.get_figheight() + LEGEND)
    drawing.legend(handles=handles, loc="outside lower center", ncols=3)
    return drawing


def _cell(cell: Mapping[str, Any]) -> Cell:
    look = LOOKS[cell["outcome"]]
    if cell["outcome"] not in WRONG:
        return look
    share = cell["displacement_error_mm"] / cell["limit_mm"]
    return replace(look, text=f"{math.ceil(math.log10(share))}" if 1 <= share < LARGEST else "∞")


def claims(cells: pd.DataFrame) -> str:
    """How often a wrong answer is reported as solved."""
    wrong = cells["outcome"] == WRONG_CLAIMED
    counts = [
        f"{out_of(wrong[of].sum(), of.sum(), 'row')} of {whose}"
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


def rungs(results: Results) -> Section | None:
    """The rungs themselves, and the input that the model refuses."""
    if "scene" not in results.problems:
        return None
    problems = results.problems[results.problems["scene"].str.startswith(LADDERS)]
    problems = problems.drop_duplicates("scene", keep="last").reset_index(drop=True)
    limits = results.rows.groupby("scene")["limit_mm"].max()
    names = ("n", "m", "active", "cond_K", "reference_bound_mm")
    taken = problems[problems["scene"].isin(limits.index)].reindex(columns=["scene", "title", *names])
    taken = taken.assign(**{name: taken[name].map(as_number).astype(float) for name in names})
    taken["limit_mm"] = taken["scene"].map(limits)
    columns = [word("rung", "scene"), word("description", "title")]
    columns += [number(name, name, whole) for name in ("n", "m", "active")]
    columns += [
        number("cond(K)", "cond_K", power),
        number("limit, mm", "limit_mm", power),
        number("reference error bound, mm", "reference_bound_mm", lambda e: power(raised(e))),
    ]
    blocks: list[Block] = [
        Table("rungs", "*The measured rungs.* Bound 0: the reference is exact.", taken, columns)
    ]
    if "refused" in problems and problems["refused"].notna().any():
        refused = problems.loc[problems["refused"].notna(), ["scene", "title", "refused"]]
        refused = refused.replace({"refused": {"": "**accepted, although the model does not cover it**"}})
        columns = [word("rung", "scene"), word("description", "title"), word("error message", "refused")]
        caption = (
            "*What the model refuses, as it should*: a clear error rather than a plausible wrong answer."
        )
        blocks.append(Table("rungs-refused", caption, refused, columns))
    return Section("The rungs", blocks)
