"""The answer of one scene for the page."""

from __future__ import annotations

import pandas as pd

from report.document.numbers import listed, significant
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
        "facts": [[name, str(value)] for name, value in facts.items() if value is not None],
        "maps": answer_maps(record, arrays),
    }


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
