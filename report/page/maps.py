"""Gap maps for the page: places, gaps and forces of the contacts of scenes, answers and series.

A map has `fields` by name with their unit; the `group` of its places, which maps on the same contacts share;
and `contacts`, how many there are if only every k-th is in the page.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from report.page.write import Data, exact, packed
from report.results.answer_record import pair_name
from report.results.reader import Results
from report.results.series_results import Array, Series

NO_MARKS = np.zeros((0, 2))
BUDGET = 1_100_000  # characters of all maps of a page
MOST = 20_000  # contacts of a map; of more, every k-th is shown
CASES = 60  # of a series, at most
SHARES = (1.0, 0.99, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.02, 0.01, 0.0)
FIELDS = {"gap_before": "gap before", "gap_after": "gap after", "lam": "force"}


def scene_maps(results: Results) -> Data:
    """The maps of a run's scenes as far as they fit, and the names of those left out."""
    page = _empty()
    for scene in results.cells.sort_values(["n", "active", "scene"])["scene"].unique():
        arrays = results.scene_arrays(scene)
        if arrays == {}:  # damaged
            page["left_out"].append(scene)
        elif arrays:
            fields = {text: arrays[name] for name, text in FIELDS.items() if name in arrays}
            marks = arrays.get("fasteners", NO_MARKS)
            if not _added(page, scene, arrays["contact_nodes"], fields, marks, BUDGET):
                page["left_out"].append(scene)
    return page


def answer_maps(record: Data, arrays: dict[str, Array]) -> Data:
    """The maps of one answer, one per pair of parts in contact."""
    return _pairs(record, {text: arrays[name] for name, text in FIELDS.items()}, arrays)


def two_answers_maps(record: Data, answers: list[dict[str, Array]]) -> Data:
    """The maps of two answers on one junction, one per pair of parts: both gaps, and what the second adds."""
    first, second = (arrays["gap_after"] for arrays in answers)
    fields = {"first": first, "second": second, "second − first": second - first}
    page = _pairs(record, fields, answers[0])
    for each in page["maps"]:
        each["fields"][-1]["signed"] = True
    return page


def _pairs(record: Data, fields: dict[str, Array], arrays: dict[str, Array]) -> Data:
    page = _empty()
    marks = np.array([point for points in record.get("marks", {}).values() for point in points])
    for pair in record["pairs"] if "contact_nodes" in arrays else ():
        own = slice(pair["start"], pair["stop"])
        of_pair = {name: values[own] for name, values in fields.items()}
        _added(page, pair_name(pair), arrays["contact_nodes"][own], of_pair, marks)
    return page


def series_maps(series: Series, quantiles: Array, names: list[str]) -> Data:
    """The maps of a series: the quantiles over the cases, some cases, the worst among them, and for each
    contact the gaps that given shares of the cases exceed.

    quantiles : (len(names), m), mm.
    """
    page = _empty()
    if series.nodes is None or not len(series.cases):
        return page
    step = _step(len(series.nodes))
    curves = _exceeded(series, step)
    numbers = series.cases["case"].to_numpy()
    maps = dict(zip(names, quantiles, strict=True))
    _added(page, f"{len(numbers)} cases", series.nodes, maps, series.fasteners)
    (made,) = page["maps"]
    spent, worst, cases = _size(made["fields"]) + len(curves), next(_chosen(series)), []
    for case in _chosen(series):
        field = _field(f"case {case}", np.asarray(series.gaps[case, ::step], dtype=float)) | {"case": case}
        spent += _size([field])
        if spent > BUDGET:
            break
        cases.append(field)
    made["fields"] += sorted(cases, key=lambda field: field["case"])
    made |= {"shares": list(SHARES), "exceeded": curves, "worst": worst}
    return page


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
    shares = 1 - np.array(SHARES)
    return packed(np.concatenate([np.quantile(gaps, shares, axis=0).T for gaps in series.of_contacts(step)]))


def _empty() -> Data:
    return {"groups": [], "maps": [], "left_out": []}


def _added(
    page: Data, name: str, nodes: Array, fields: dict[str, Array], marks: Array, budget: float = np.inf
) -> bool:
    """Whether the map fitted into the page."""
    step = _step(len(nodes))
    place = exact(nodes[::step])
    made = [_field(text, values[::step]) for text, values in fields.items()]
    groups = page["groups"]
    spent = sum(map(len, groups)) + sum(_size(each["fields"]) for each in page["maps"])
    if spent + _size(made) + (0 if place in groups else len(place)) > budget:
        return False
    if place not in groups:
        groups.append(place)
    of_map = {"contacts": len(nodes), "every": step, "marks": marks.tolist(), "group": groups.index(place)}
    page["maps"].append({"name": name, "fields": made, **of_map})
    return True


def _field(name: str, values: Array) -> Data:
    return {"name": name, "unit": "N" if name == FIELDS["lam"] else "mm", "values": packed(values)}


def _size(fields: list[Data]) -> int:
    return sum(len(field["values"]) for field in fields)


def _step(contacts: int) -> int:
    return -(-contacts // MOST)
