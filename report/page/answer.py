"""The answer of one scene for the page."""

from __future__ import annotations

import pandas as pd

from report.document.numbers import listed, significant
from report.figures.answer import pair_name
from report.results.series import Array

from .banner import banner
from .maps import answer_maps, two_answers_maps
from .packed import Data

CODE = ("machine", "commit", "clean", "recorded_at")


def answer_data(record: Data, arrays: dict[str, Array]) -> Data:
    """What the page of one answer shows. record, arrays : of solution.json and solution.npz."""
    facts = {
        "solved by": record["method"],
        "unknowns n": record["n"],
        "contacts m": record["m"],
        "verdict at 1e-7 mm": record.get("verdict"),
        "solver's report": record.get("status"),
        "judged error, mm": _known(record.get("judged_error_mm")),
        "error bound, mm": _known(record.get("error_bound_mm")),
        "memory, MiB": _known(record.get("peak_rss_mib")),
        **{f"{step}, s": significant(seconds) for step, seconds in record.get("steps", {}).items()},
    }
    return {
        "kind": "answer",
        "banner": _banner([record]),
        "headline": headline(record, arrays),
        "fasteners": [
            [entry["kind"], pair_name(entry), entry["x"], entry["y"], entry["force_N"]]
            for entry in record.get("fasteners", [])
        ],
        "facts": [[name, str(value)] for name, value in facts.items() if value is not None],
        "maps": answer_maps(record, arrays),
    }


def headline(record: Data, arrays: dict[str, Array]) -> Data:
    """What the reader asks first: whether a gap is larger than allowed, if that was asked, and how large the
    largest is and where. kind : "pass", "fail" or "" if neither can be said.
    """
    if not record["m"]:
        return {"kind": "", "text": "The scene has no contact."}
    gap = arrays["gap_after"]
    worst = int(gap.argmax())
    pair = next(pair for pair in record["pairs"] if pair["start"] <= worst < pair["stop"])
    at = f"contact {worst}"
    if "contact_nodes" in arrays:
        x, y = arrays["contact_nodes"][worst]
        at = f"x = {significant(x)}, y = {significant(y)} mm"
    largest = f"the largest gap left is {significant(gap[worst])} mm, at {at} ({pair_name(pair)})"
    check = record.get("allowed_gap")
    if check is None:
        return {"kind": "", "text": f"{largest[0].upper()}{largest[1:]}."}
    kinds = {None: ("", "CANNOT BE TOLD"), True: ("fail", "FAIL"), False: ("pass", "PASS")}
    kind, word = kinds[check["exceeded"]]
    return {"kind": kind, "text": f"{word} at {significant(check['allowed_mm'])} mm: {largest}."}


def two_answers_data(records: list[Data], answers: list[dict[str, Array]], names: list[str]) -> Data:
    """What the page of two answers on one junction shows: records and arrays of both, and their names."""
    facts = [
        [which, f"{record['title']}, {record['method']}"]
        for which, record in zip(("first", "second"), records, strict=True)
    ]
    maps = two_answers_maps(records[0], answers)
    return {"kind": "answer", "banner": _banner(records), "facts": facts, "maps": maps}


def _banner(records: list[Data]) -> Data:
    rows = pd.DataFrame([{name: record.get(name) for name in CODE} for record in records])
    rows = rows.assign(**{name: rows[name].fillna("") for name in CODE if name != "clean"})
    changed = (rows["clean"] == 0).any()
    warned = ["Computed with uncommitted changes to that commit."] if changed else []
    methods = dict.fromkeys(str(record["method"]) for record in records)
    return banner(rows, counts=f"solved by: {listed(list(methods))}", warnings=warned)


def _known(value: object) -> str | None:
    return None if value is None else significant(value)
