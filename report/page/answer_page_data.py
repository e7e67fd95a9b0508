"""Collects what the page of an answer, or of two answers on one junction, shows."""

import pandas as pd

from report.document.blocks import Column, Table, number, word
from report.document.numbers import (
    beside,
    coordinate,
    listed,
    out_of,
    position,
    proven_to,
    raised,
    significant,
    whole,
    without_rounding,
)
from report.page.contact_maps import answer_maps, map_view, two_answers_maps
from report.page.page_file import Data, banner, table_data
from report.results.answer_record import STRESS, SavedAnswer, fasteners, pair_name, stages
from report.results.series_results import Array, allowed_mm

CODE = ("machine", "commit", "clean", "recorded_at")
#: The columns of a table of fasteners, but for their forces.
FASTENER = [word("fastener", "kind"), word("contact", "contact")]
FASTENER += [number(f"{axis}, mm", f"{axis}_mm", coordinate) for axis in "xy"]
FORCE = number("force, N", "force_N")


def answer_data(record: Data, arrays: dict[str, Array]) -> Data:
    """The data of the page of one answer. record, arrays : from solution.json and solution.npz."""
    page = _with_maps([record], facts(record), answer_maps(record, arrays))
    history, forces = stage_table(record, arrays), fasteners(record)
    more = [table_data("Stages", history.columns, history.data)] if len(history.data) else []
    if len(forces):
        more.append(table_data("Forces in the fasteners", [*FASTENER, FORCE], forces))
    return page | {"headline": headline(record, arrays), "tables": [*more, *page["tables"]]}


def stage_table(record: Data, arrays: dict[str, Array]) -> Table:
    """The history of a scene with stages: a line per stage; without stages, no line."""
    table = stages(record, arrays)
    shown = beside(allowed_mm(record))
    columns = [Column("stage", lambda line: str(line["stage"]), "left")]
    columns += [number("largest gap, mm", "largest_mm", shown), word("at", "at")]
    columns += [number(name, name) for name in table.columns if name == STRESS]
    columns += [number("closed", "closed", whole)]
    columns += [number(name, name) for name in table.columns if name.endswith(", N")]
    columns += [word("verdict", "verdict")] if "verdict" in table else []
    caption = "*The stages.* The answer below is that of the last one; forces are sums."
    return Table("stages", caption, table, columns)


def stage_lines(record: Data, arrays: dict[str, Array]) -> list[list[str]]:
    """The headings and the lines of the table of the stages, for the console."""
    history = stage_table(record, arrays)
    shown = table_data("Stages", history.columns, history.data)
    return [shown["heads"], *shown["lines"]]


def facts(record: Data) -> list[list[str]]:
    """Names and values that tell how the scene was solved and judged; answer.md has them too."""
    values = {
        "solved by": record["method"],
        "unknowns n": record["n"],
        "contacts m": record["m"],
        "verdict at 1e-7 mm": record.get("verdict"),
        "solver's report": record.get("status"),
        "judged error, mm": record.get("judged_error_mm"),
        "error bound, mm": raised(record.get("error_bound_mm")),
        "gaps proven to, mm": raised((record.get("allowed_gap") or {}).get("uncertainty_mm")),
        "mesh error, mm (estimated)": (record.get("grid") or {}).get("error_mm"),
        "memory, MiB": record.get("peak_rss_mib"),
        **{f"{step}, s": seconds for step, seconds in record.get("steps", {}).items()},
    }
    return [
        [name, significant(value) if isinstance(value, float) else str(value)]
        for name, value in values.items()
        if value is not None
    ]


def headline(record: Data, arrays: dict[str, Array]) -> Data:
    """The first sentences of an answer: whether a gap, or a stress, is larger than its limit, if there is
    one, and how large the largest is and where. kind : "pass", "fail", or "" if neither can be said.
    """
    gap, stress = _gap_headline(record, arrays), record.get("stress")
    if stress is None:
        return gap
    limited = [gap["kind"]] * ("allowed_gap" in record) + [stress["kind"]] * ("allowed" in stress)
    kind = "fail" if "fail" in limited else "pass" if limited and "" not in limited else ""
    return {"kind": kind, "text": f"{gap['text']} {stress['said']}."}


def _gap_headline(record: Data, arrays: dict[str, Array]) -> Data:
    """The sentence on the largest gap."""
    if not record["m"]:
        return {"kind": "pass" if "allowed_gap" in record else "", "text": "The scene has no contact."}
    gap = arrays["gap_after"]
    worst = int(gap.argmax())
    pair = next(pair for pair in record["pairs"] if pair["start"] <= worst < pair["stop"])
    at = f"contact {worst}"
    if "contact_nodes" in arrays:
        at = position(arrays["contact_nodes"][worst], arrays["contact_nodes"])
    left = without_rounding(gap[worst], abs(arrays["gap_before"]).max())
    check = record.get("allowed_gap")
    shown = beside(allowed_mm(record))(left)
    largest = f"the largest gap left is {shown} mm, at {at} ({pair_name(pair)})"
    if check is None:
        return {"kind": "", "text": f"{largest[0].upper()}{largest[1:]}."}
    limit = f"limit {check['allowed_mm']:g} mm"
    near = ", closer to the limit than the mesh can tell" if check.get("closer_than_grid_mm") else ""
    near += f"; {check['beyond_scan']}" if "beyond_scan" in check else ""
    if check["exceeded"] is None:
        kind, verdict = "", f"CANNOT BE TOLD: {limit}, gaps are {proven_to(check['uncertainty_mm'])}"
    elif check["exceeded"]:
        larger = f"at {out_of(len(check['contacts']), record['m'], 'contact')}"
        where = f"{larger}, {check['share']:.1%} of the junction, between {', '.join(check['pairs'])}"
        kind, verdict = "fail", f"FAIL: {limit}, exceeded {where}"
    else:
        kind, verdict = "pass", f"PASS: {limit}"
    return {"kind": kind, "text": f"{verdict}; {largest}{near}."}


def two_answers_data(answers: list[SavedAnswer], common: list[SavedAnswer]) -> Data:
    """The data of the page of two answers on one junction. common : with their gaps at common places."""
    records = [record for record, _ in answers]
    named = [f"{record['scene']}: {record['title']}, {record['method']}" for record in records]
    said = [headline(*answer)["text"] for answer in answers]
    maps = two_answers_maps(common[0][0], [arrays for _, arrays in common])
    both = [["first", named[0], said[0]], ["second", named[1], said[1]]]
    return _with_maps(records, both, maps)


def _with_maps(records: list[Data], lines: list[list[str]], maps: Data) -> Data:
    """The data of a page with gap maps and a table of facts; times and memory are folded away."""
    times = [line for line in lines if line[0].endswith((", s", ", MiB"))]
    tables = {"Facts": [line for line in lines if line not in times], "Time and memory": times}
    return {
        "banner": _banner(records),
        "tables": [
            {"title": title, "summary": "", "heads": [], "lines": some, "folded": some is times}
            for title, some in tables.items()
            if some
        ],
    } | map_view(maps)


def _banner(records: list[Data]) -> Data:
    rows = pd.DataFrame([{name: record.get(name) for name in CODE} for record in records])
    rows = rows.assign(**{name: rows[name].fillna("") for name in CODE if name != "clean"})
    changed = (rows["clean"] == 0).any()
    warned = [f"{sentence}." for record in records for sentence in record.get("unusual", ())]
    warned += ["Computed with uncommitted changes to that commit."] if changed else []
    methods = dict.fromkeys(str(record["method"]) for record in records)
    return banner(rows, counts=f"solved by: {listed(list(methods))}", warnings=warned)
