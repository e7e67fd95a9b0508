"""Gap maps for the page: places, gaps and forces of the contacts of scenes, answers and series.

A map has `fields` by name; the `group` of its places, which maps on the same contacts share; and `marks`, the
fasteners. A field has packed `values`, and a `kind` and a range for its colours. A group has packed arrays in
mm: x, y, and the corners of each contact's cell.
"""

from collections.abc import Iterator

import numpy as np

from report.document.numbers import ROUNDING, counted
from report.figures.node_cells import cells_of
from report.page.page_figures import map_item
from report.page.page_file import Data, choice, exact, packed
from report.results.answer_record import pair_name, stress_map
from report.results.reader import Results
from report.results.series_results import Array, Series, allowed_mm

LARGEST_MAP = np.array([1100.0, 560.0])  # pixels
BESIDE_MAP, BELOW_MAP = 165, 65  # pixels of the axes, the colours and the tools
NO_MARKS = np.zeros((0, 2))
BUDGET = 1_100_000  # characters of all maps of a page
MOST = 20_000  # contacts of a map; of more, every k-th is shown
CASES = 60  # of a series, at most
SHARES = (1.0, 0.99, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.02, 0.01)
COLOUR_ENTRIES = {"low": "from", "high": "to", "threshold": "outline above"}
SHOWN_FIRST = ("gap after", "95 % quantile")
FIELDS = {"gap_before": "gap before", "gap_after": "gap after", "lam": "force"}
STRESS = "von Mises stress"


def scene_maps(results: Results) -> Data:
    """The maps of a run's scenes as far as they fit; what they tell names those left out."""
    page, left_out = _empty(), []
    for scene in results.cells.sort_values(["n", "active", "scene"])["scene"].unique():
        if (arrays := results.scene_arrays(scene)) is None:
            continue
        fields = {text: arrays[name] for name, text in FIELDS.items() if name in arrays}
        marks = arrays.get("fasteners", NO_MARKS)
        damaged = not arrays
        if damaged or not _add_map(page, scene, arrays["contact_nodes"], fields, marks, budget=BUDGET):
            left_out.append(scene)
    if left_out:
        for made in page["maps"]:
            made["about"] += f" Left out, too large or damaged: {', '.join(left_out)}."
    return page


def answer_maps(record: Data, arrays: dict[str, Array]) -> Data:
    """The maps of one answer, one per pair of parts in contact, and one of the stress in each part. What is
    above the limits of gap and stress is outlined.
    """
    fields = {text: arrays[name] for name, text in FIELDS.items()}
    gaps = zip(record.get("stages", []), arrays.get("stage_gaps", ()), strict=True)
    fields |= {f"gap of {stage['name']}": gap for stage, gap in gaps}
    page, stress = _pairs(record, fields, arrays, allowed_mm(record)), record.get("stress") or {}
    for k, part in enumerate(record["parts"] if "stress" in arrays else ()):
        places, highest, unread = stress_map(arrays, k)
        values, name = np.where(unread, np.nan, highest), f"stress of {part['name']}"
        if len(places):
            limit = stress.get("allowed", np.inf)
            _add_map(page, name, places, {STRESS: values}, _marked(record), limit, noun="place")
    return page


def two_answers_maps(record: Data, answers: list[dict[str, Array]]) -> Data:
    """The maps of two answers on one junction, one per pair of parts: both gaps, and what the second adds."""
    first, second = (arrays["gap_after"] for arrays in answers)
    change = second - first
    page = _pairs(record, {"first": first, "second": second, "second − first": change}, answers[0])
    for made, pair in zip(page["maps"], record["pairs"], strict=False):  # no map without places
        most = float(abs(change[pair["start"] : pair["stop"]]).max()) or 1.0
        made["fields"]["second − first"] |= {"kind": "change", "low": -most, "high": most}
    return page


def _pairs(record: Data, fields: dict[str, Array], arrays: dict[str, Array], limit: float = np.inf) -> Data:
    page = _empty()
    marks = _marked(record)
    for pair in record["pairs"] if "contact_nodes" in arrays else ():
        contacts = slice(pair["start"], pair["stop"])
        of_pair = {name: values[contacts] for name, values in fields.items()}
        _add_map(page, pair_name(pair), arrays["contact_nodes"][contacts], of_pair, marks, limit)
    return page


def _marked(record: Data) -> Array:
    return np.array([point for points in record.get("marks", {}).values() for point in points])


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
    maps = dict(zip(names, quantiles, strict=True))
    name, limit = counted(len(series.cases), "case"), allowed_mm(series.facts)
    _add_map(page, name, series.nodes, maps, series.fasteners, limit)
    (made,) = page["maps"]
    worst, spent, cases = series.worst_case, _size(made["fields"]) + len(curves), {}
    for case in _chosen(series):
        gaps = np.asarray(series.gaps[case, ::step], dtype=float)
        field = _field("gap", gaps, limit) | {"hover": False}
        spent += len(field["values"])
        if spent > BUDGET:
            break
        cases[case] = field
    for case, field in sorted(cases.items()):
        made["fields"][f"case {case}{', the worst' if case == worst else ''}"] = field
    made["about"] += " A click on a contact shows how often its gap is exceeded."
    made |= {"shares": [100 * share for share in SHARES], "exceeded": curves}
    return page


def _chosen(series: Series) -> Iterator[int]:
    """The worst case, then others at equal distances."""
    numbers = series.cases["case"].to_numpy()
    worst = series.worst_case
    yield worst
    for place in np.unique(np.linspace(0, len(numbers) - 1, CASES - 1).astype(int)):
        if numbers[place] != worst:
            yield int(numbers[place])


def _exceeded(series: Series, step: int) -> str:
    """(contacts, len(SHARES)), mm: the gap that this share of the cases exceeds."""
    shares = 1 - np.array(SHARES)
    return packed(np.concatenate([np.quantile(gaps, shares, axis=0).T for gaps in series.of_contacts(step)]))


def _controls(page: Data) -> list[Data]:
    """The lists and numbers above the maps of a page, if it has any."""
    if not page["maps"]:
        return []
    names = dict.fromkeys(name for made in page["maps"] for name in made["fields"])
    first = next((name for name in SHOWN_FIRST if name in names), None)
    ordered = sorted(names, key=lambda name: name != first)
    return [
        choice("map", "map", [(k, made["name"]) for k, made in enumerate(page["maps"])], "maps"),
        choice("field", "show", [(name, name) for name in ordered], "maps"),
        choice("scale", "colours", [("linear", "linear"), ("log", "logarithmic")], "maps"),
        *({"name": name, "label": label, "views": "maps"} for name, label in COLOUR_ENTRIES.items()),
    ]


def map_view(page: Data) -> Data:
    """The view, the controls and the figure of a page's maps, which tells values where the pointer is."""
    fields = (item for made in page["maps"] for item in made["fields"].items())
    told = dict.fromkeys(name for name, field in fields if field["hover"])
    views = [("maps", "Gap maps")] if page["maps"] else []
    figures = {"map": map_item([*told])}
    return {"views": views, "controls": _controls(page), "maps": page, "figures": figures}


def _empty() -> Data:
    return {"groups": [], "maps": []}


def _add_map(
    page: Data,
    name: str,
    nodes: Array,
    fields: dict[str, Array],
    marks: Array,
    limit: float = np.inf,
    budget: float = np.inf,
    noun: str = "contact",
) -> bool:
    """Add a map to the page if it fits into the budget; returns whether it did."""
    step = _step(len(nodes))
    place = {side: exact(values) for side, values in _cells(nodes[::step]).items()}
    made = {text: _field(text, values[::step], limit) for text, values in fields.items()}
    groups = page["groups"]
    spent = sum(len(text) for group in groups for text in group.values()) + sum(
        _size(other["fields"]) for other in page["maps"]
    )
    if spent + _size(made) + (0 if place in groups else sum(map(len, place.values()))) > budget:
        return False
    if place not in groups:
        groups.append(place)
    about = counted(len(nodes), noun) + (f", one in {step} of which is drawn" if step > 1 else "") + "."
    x, y = np.reshape(marks, (-1, 2)).T.tolist()
    page["maps"].append(
        {
            "name": name,
            "about": about + (" Circles: fasteners and clamps." if x else ""),
            "fields": made,
            "marks": {"x": x, "y": y},
            "group": groups.index(place),
            **_frame(nodes),
        }
    )
    return True


def _frame(nodes: Array) -> Data:
    """Pixels and ranges of a map with about the same scale in x and y, and a margin."""
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    margin = 0.02 * (high - low).max() + 1e-3
    low, high = low - margin, high + margin
    pixels = (high - low) * (LARGEST_MAP / (high - low)).min()
    return {
        "frame": {"width": round(pixels[0]), "height": round(pixels[1])},
        "beside": {"width": BESIDE_MAP, "height": BELOW_MAP},
        "x_range": {"start": low[0], "end": high[0]},
        "y_range": {"start": low[1], "end": high[1]},
    }


def _field(name: str, values: Array, limit: float) -> Data:
    """A field with the range of its colours: gaps from the least, at most 0, forces from 1/10 000 of the
    most. limit : of a gap or a stress, above which contacts are outlined.
    """
    high = float(np.nanmax(values, initial=0.0)) or 1.0
    values = np.where(abs(values) <= ROUNDING * high, 0.0, values)
    force = name == FIELDS["lam"]
    limit = np.inf if force else limit
    return {
        "kind": "force" if force else "gap",
        "unit": "N" if force else "N/mm²" if name == STRESS else "mm",
        "low": 1e-4 * high if force else float(np.nanmin(values, initial=0.0)),
        "high": high,
        "hover": True,
        "limit": limit,
        "values": packed(values, limit),
    }


def _cells(nodes: Array) -> dict[str, Array]:
    """Places of the contacts, the corners of their cells one after another, mm, and how many each has."""
    cells = cells_of(nodes)
    (x, y), (xs, ys) = nodes.T, np.concatenate(cells).T
    return {"x": x, "y": y, "xs": xs, "ys": ys, "corners": np.array([len(cell) for cell in cells])}


def _size(fields: dict[str, Data]) -> int:
    return sum(len(field["values"]) for field in fields.values())


def _step(contacts: int) -> int:
    return -(-contacts // MOST)
