"""What each random input contributes, in the report of a series: indices and derivatives."""

import pandas as pd

from report.document.blocks import Block, Figure, Table, Text, number, word
from report.document.numbers import out_of
from report.figures import contributors
from report.results.series_results import Series

OF_GAP = "*Contributors: shares of the variance of the largest gap*, with 95 % intervals."
OF_CONTACTS = "*The same of the gap at each contact: the total share of each input.*"
OF_FORCE = "*The same of the largest force in a fastener*; the CSV also has each fastener."
SLOPES = (
    "*The derivative of the largest gap by each input, at the mean of all*. It holds while the input is "
    "between the two values and the others stay: beyond, a contact opens or closes, or another gap is the "
    "largest. An input with `each` moves at all its elements."
)


def contributors_of(series: Series) -> list[Block]:
    """The blocks of a series for contributors, or why there are none: they need the answers to all cases."""
    if series.facts.get("cases_per_point", 1) == 1:
        return []
    if missing := series.facts["cases"] - len(series.cases):
        without = out_of(missing, series.facts["cases"], "case")
        return [Text(f"**Contributors** and derivatives are left out: {without} without an answer.")]
    gaps = series.cases["max_gap_mm"].to_numpy(), series.cases["gap_error_mm"].max(skipna=False)
    table = contributors.indices(series, *gaps)
    blocks: list[Block] = [Figure("contributors", OF_GAP, contributors.bars(table), table)]
    if series.nodes is not None:
        blocks.append(Figure("contributors-map", OF_CONTACTS, *contributors.maps(series, series.nodes)))
    if series.forces.size:
        largest, each = contributors.of_forces(series)
        blocks.append(Figure("contributors-force", OF_FORCE, contributors.bars(largest), each))
    columns = [word("input", "input"), number("mean", "mean"), number("mm per unit", "derivative")]
    columns += [number("mm per standard deviation", "per_sd_mm"), number("from", "low"), number("to", "high")]
    slopes = pd.DataFrame(series.facts.get("derivatives", {}))
    return [*blocks, Table("derivatives", SLOPES, slopes, columns)] if len(slopes) else blocks
