"""The answer of one scene: its record and arrays, and tables of its nodes, contacts and fasteners."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from report.document.escape import quoted

from .series_results import Array

Answer = tuple[dict[str, Any], dict[str, Array]]


def read(directory: Path) -> Answer:
    """What solution.json and solution.npz hold."""
    record = quoted(json.loads((directory / "solution.json").read_text("utf-8")))
    with np.load(directory / "solution.npz") as saved:
        return record, {name: saved[name] for name in saved.files}


def pair_name(pair: dict[str, Any]) -> str:
    return " – ".join(pair["pair"])


def nodes(record: dict[str, Any], arrays: dict[str, Array]) -> pd.DataFrame:
    """One line per node of each part."""
    names = [part["name"] for part in record["parts"] for _ in range(part["start"], part["stop"])]
    table = _places("part", names, arrays.get("nodes"), arrays.get("node_ids"))
    return table.assign(displacement_mm=arrays["x"])


def contacts(record: dict[str, Any], arrays: dict[str, Array]) -> pd.DataFrame:
    """One line per contact of each pair."""
    names = [pair_name(pair) for pair in record["pairs"] for _ in range(pair["start"], pair["stop"])]
    return _places("contact", names, arrays.get("contact_nodes"), arrays.get("contact_ids")).assign(
        gap_before_mm=arrays["gap_before"], gap_after_mm=arrays["gap_after"], force_N=arrays["lam"]
    )


def fasteners(record: dict[str, Any]) -> pd.DataFrame:
    """One line per fastener and contact."""
    lines = [
        (each["kind"], pair_name(each), each["x"], each["y"], each["force_N"])
        for each in record.get("fasteners") or []
    ]
    return pd.DataFrame(lines, columns=["kind", "contact", "x_mm", "y_mm", "force_N"])


def _places(heading: str, names: list[str], places: Array | None, ids: Array | None) -> pd.DataFrame:
    if places is None:
        return pd.DataFrame({heading: names, "index": range(len(names))})
    labels = {} if ids is None else {"node": ids}
    return pd.DataFrame({heading: names} | labels | {"x_mm": places[:, 0], "y_mm": places[:, 1]})
