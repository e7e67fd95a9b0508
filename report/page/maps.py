"""Gap maps for the page: places, gaps and forces of the contacts of scenes, answers and series.

A map has `nodes` (one per group of maps on the same contacts), `fields` by name with their unit, and
`contacts`, how many there are if only every k-th is in the page.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from report.figures.answer import pair_name
from report.results.reader import Results
from report.results.series import Array, Series

from .packed import Data, exact, packed

NO_MARKS = np.zeros((0, 2))
BUDGET = 1_100_000  # characters of all maps of a page
MOST = 20_000  # contacts of a map; of more, every k-th is shown
CASES = 60  # of a series, at most
SHARES = (1.0, 0.99, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.02, 0.01, 0.0)


def scene_maps(results: Results) -> Data:
    """The maps of a run's scenes as far as they fit, and the names of those left out."""
    page = _empty()
    spent = 0
    for scene in results.cells.sort_values(["n", "active", "scene"])["scene"].unique():
        arrays = results.scene_arrays(scene)
        if not arrays or "contact_nodes" not in arrays:
            continue
        made = _fields_map(scene, arrays["contact_nodes"], arrays, arrays.get("fasteners", NO_MARKS))
        new = 0 if made["nodes"] in page["groups"] else len(made["nodes"])
        size = new + sum(len(field["values"]) for field in made["fields"])
        if spent + size > BUDGET:
            page["left_out"].append(scene)
            continue
        spent += size
        _add(page, made)
    return page


def answer_maps(record: Data, arrays: dict[str, Array]) -> Data:
    """The maps of one answer, one per pair of parts in contact."""
    if "contact_nodes" not in arrays or not record["m"]:
        return _empty()
    page = _empty()
    for pair in record["pairs"]:
        own = slice(pair["start"], pair["stop"])
        of_pair = {name: arrays[name][own] for name in ("gap_before", "gap_after", "lam")}
        _add(page, _fields_map(pair_name(pair), arrays["contact_nodes"][own], of_pair, _places(record)))
    return page


def _places(record: Data) -> Array:
    """Of all marks on the junction."""
    return np.array([point for points in record.get("marks", {}).values() for point in points])


def two_answers_maps(record: Data, answers: list[dict[str, Array]]) -> Data:
    """The maps of two answers on one junction, one per pair of parts: both gaps, and what the second adds."""
    if "contact_nodes" not in answers[0]:
        return _empty()
    page = _empty()
    for pair in record["pairs"]:
        own = slice(pair["start"], pair["stop"])
        first, second = (arrays["gap_after"][own] for arrays in answers)
        nodes = answers[0]["contact_nodes"][own]
        step = _step(len(nodes))
        fields = [_field("first", first[::step]), _field("second", second[::step])]
        fields.append(_field("second − first", (second - first)[::step]) | {"signed": True})
        _add(page, _map(pair_name(pair), nodes, fields, _places(record)))
    return page


def series_maps(series: Series, quantiles: Array, names: list[str]) -> Data:
    """The maps of a series: the quantiles over the cases, some cases, the worst among them, and for each
    contact the gaps that given shares of the cases exceed.

    quantiles : (len(names), m), mm.
    """
    if series.nodes is None or not len(series.cases):
        return _empty()
    step = _step(len(series.nodes))
    numbers = series.cases["case"].to_numpy()
    fields = [_field(name, values[::step]) for name, values in zip(names, quantiles, strict=True)]
    curves = _exceeded(series, step)
    spent = sum(len(field["values"]) for field in fields) + len(curves)
    for case in _chosen(series):
        field = _field(f"case {case}", np.asarray(series.gaps[case, ::step], dtype=float))
        spent += len(field["values"])
        if spent > BUDGET:
            break
        fields.append(field | {"case": int(case)})
    fields[len(names) :] = sorted(fields[len(names) :], key=lambda field: field["case"])
    worst = next(_chosen(series))
    made = _map(f"{len(numbers)} cases", series.nodes, fields, series.fasteners)
    return _add(_empty(), made | {"shares": list(SHARES), "exceeded": curves, "worst": worst})


def _chosen(series: Series) -> Iterator[int]:
    """The worst case, then others at equal distances."""
    numbers = series.cases["case"].to_numpy()
    worst = int(numbers[series.cases["max_gap_mm"].to_numpy().argmax()])
    yield worst
    for place in np.unique(np.linspace(0, len(numbers) - 1, CASES - 1).astype(int)):
        if numbers[place] != worst:
            yield int(numbers[place])


def _exceeded(series: Series, step: int) -> str:
    """(contacts, len(SHARES)), mm: the gap that this share of the cases exceeds."""
    numbers, m = series.cases["case"].to_numpy(), series.gaps.m
    found = []
    width = max(2**22 // len(numbers), 1) * step
    for start in range(0, m, width):
        some = series.gaps[numbers, start : min(start + width, m) : step].astype(float)
        found.append(np.quantile(some, 1 - np.array(SHARES), axis=0).T)
    return packed(np.concatenate(found))


def _empty() -> Data:
    return {"groups": [], "maps": [], "left_out": []}


def _add(page: Data, made: Data) -> Data:
    """The page's maps with one more; maps on the same contacts share their places."""
    place = made.pop("nodes")
    if place not in page["groups"]:
        page["groups"].append(place)
    page["maps"].append(made | {"group": page["groups"].index(place)})
    return page


def _map(name: str, nodes: Array, fields: list[Data], marks: Array = NO_MARKS) -> Data:
    step = _step(len(nodes))
    return {
        "name": name,
        "contacts": len(nodes),
        "every": step,
        "fields": fields,
        "marks": marks.tolist(),
        "nodes": exact(nodes[::step]),
    }


def _fields_map(name: str, nodes: Array, arrays: dict[str, Array], marks: Array) -> Data:
    """The map of what is known of the gaps and forces."""
    step = _step(len(nodes))
    known = {"gap_before": ("gap before", "mm"), "gap_after": ("gap after", "mm"), "lam": ("force", "N")}
    fields = [_field(text, arrays[key][::step], unit) for key, (text, unit) in known.items() if key in arrays]
    return _map(name, nodes, fields, marks)


def _field(name: str, values: Array, unit: str = "mm") -> Data:
    return {"name": name, "unit": unit, "values": packed(values)}


def _step(contacts: int) -> int:
    return -(-contacts // MOST)
