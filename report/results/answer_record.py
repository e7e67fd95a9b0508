"""The answer of one scene: its record and arrays, and tables of its nodes, contacts and fasteners."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from harness.results import records
from harness.results.schema import EXCEEDED
from report.document.escape import quoted
from report.document.numbers import position

from .series_results import Array

SavedAnswer = tuple[dict[str, Any], dict[str, Array]]


def read(directory: Path) -> SavedAnswer:
    """The content of solution.json and solution.npz."""
    record = quoted(records.read_object(directory / "solution.json"))
    return record, records.read_arrays(directory / "solution.npz")


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


def stresses(record: dict[str, Any], arrays: dict[str, Array]) -> pd.DataFrame:
    """One line per place and side, N/mm²; where `stress_side` is 0, the bottom has the negative ones, too."""
    names = np.array([part["name"] for part in record["parts"]])
    x, y = arrays["stress_places"].T
    places = {"part": names[arrays["stress_part"]], "x": x, "y": y}
    value = {"von_mises": von_mises(arrays), "proven_error": arrays["stress_error"]}
    value["not_to_be_read"] = np.where(arrays["stress_near_force"], "force at a point", "")
    sides, of_side = [], arrays["stress_side"]
    for side, sign in (("top", 1.0), ("bottom", -1.0)):
        signed = np.where(of_side == 0, sign, 1.0) * arrays["stress"].T
        components = dict(zip(("sxx", "syy", "sxy"), signed, strict=True))
        lines = pd.DataFrame(places | {"side": side} | components | value)
        sides.append(lines[(of_side == 0) | (of_side == sign)])
    return pd.concat(sides, ignore_index=True)


def von_mises(arrays: dict[str, Array]) -> Array:
    """(k,) von Mises' stress at the places of `stress`, N/mm²; infinite where it is not known."""
    scale = abs(arrays["stress"]).max(axis=1)  # squares of what is above 1e154 overflow
    with np.errstate(over="ignore", invalid="ignore"):
        xx, yy, xy = arrays["stress"].T / np.where(scale > 0, scale, 1.0)
        value = scale * np.sqrt(xx**2 - xx * yy + yy**2 + 3 * xy**2)
    return np.where(np.isnan(value), np.inf, value)


def stress_map(arrays: dict[str, Array], part: int) -> tuple[Array, Array, Any]:
    """x, y (k, 2) of a part's places, the larger von Mises stress of their sides, whether not to be read."""
    values, here = von_mises(arrays), np.flatnonzero(arrays["stress_part"] == part)
    here = here[np.argsort(-values[here], kind="stable")]
    here = np.sort(here[np.unique(arrays["stress_places"][here], axis=0, return_index=True)[1]])
    return arrays["stress_places"][here], values[here], arrays["stress_near_force"][here]


def closed_contacts(lam: Array) -> int | None:
    """The number of closed contacts; None if their forces are not known."""
    return None if np.isnan(lam).any() else int((lam > 0).sum())


def fasteners(record: dict[str, Any]) -> pd.DataFrame:
    """One line per fastener and contact."""
    lines = [
        (each["kind"], pair_name(each), each["x"], each["y"], each["force_N"])
        for each in record.get("fasteners") or []
    ]
    return pd.DataFrame(lines, columns=["kind", "contact", "x_mm", "y_mm", "force_N"])


STRESS = "stress, N/mm²"
ROUNDING = 1e-9  # of the largest force: a smaller one is rounding


def stages(record: dict[str, Any], arrays: dict[str, Array]) -> pd.DataFrame:
    """One line per stage: its largest gap, closed contacts, forces by the name of their effect, and verdict.

    Forces of what does not act, or that are not known, are missing; there is a verdict only if there is a
    limit.
    """
    told, lines = record.get("stages", []), []
    for stage, gap in zip(told, arrays.get("stage_gaps", ()), strict=True):
        line: dict[str, Any] = {
            "stage": stage["name"],
            "largest_mm": gap.max() if len(gap) else np.nan,
            "at": "",
        }
        if len(gap) and "contact_nodes" in arrays:
            line["at"] = position(arrays["contact_nodes"][gap.argmax()], arrays["contact_nodes"])
        forces = {
            f"{name}, N": np.nan if force is None else force for name, force in stage["forces_N"].items()
        }
        least = ROUNDING * float(np.nanmax([0.0, *map(abs, forces.values())]))
        forces = {name: 0.0 if abs(force) <= least else force for name, force in forces.items()}
        if "largest_stress" in stage:
            line[STRESS] = stage["largest_stress"]
        verdict = {"verdict": EXCEEDED[stage["exceeded"]]} if "exceeded" in stage else {}
        lines.append(line | {"closed": stage["closed"]} | forces | verdict)
    table = pd.DataFrame(lines)
    last = [name for name in ("contacts, N", "verdict") if name in table]
    return table[[*table.columns.drop(last), *last]]


def _places(heading: str, names: list[str], places: Array | None, ids: Array | None) -> pd.DataFrame:
    if places is None:
        return pd.DataFrame({heading: names, "index": range(len(names))})
    labels = {} if ids is None else {"node": ids}
    return pd.DataFrame({heading: names} | labels | {"x_mm": places[:, 0], "y_mm": places[:, 1]})
