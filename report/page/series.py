"""A series of load cases for the page."""

from __future__ import annotations

import pandas as pd

from report.analysis.checks import code_warnings
from report.results.series import Array, Series

from .banner import banner
from .maps import series_maps
from .packed import Data

CURVES = {"share_of_cases": "cases, by their largest gap", "share_of_contacts": "contacts, mean of the cases"}


def series_data(series: Series, quantiles: Array, names: list[str], curve: pd.DataFrame) -> Data:
    """What the page of a series shows.

    quantiles : (len(names), m), mm, the maps; curve : the exceedance over all contacts, as in
    report.analysis.remaining_gaps.
    """
    facts = series.facts
    versions = facts.get("versions") or {}
    identity = facts["identity"]
    known = {"machine": str(facts["machine"]), "recorded_at": "", "solver": identity["solver"]}
    rows = series.code.assign(**known, solver_code=identity.get("solver_code") or "")
    rows["clean"] = rows["clean"].astype(float)
    return {
        "kind": "series",
        "banner": banner(
            rows,
            warnings=code_warnings(rows),
            counts=f"{len(series.cases)} of {facts['cases']} load cases answered",
            versions=[f"{name} {version}" for name, version in versions.items()],
        ),
        "curves": [
            {
                "name": name,
                "points": [
                    [gap, 100 * share] for gap, share in zip(curve["gap_mm"], curve[key], strict=True)
                ],
            }
            for key, name in CURVES.items()
        ],
        "maps": series_maps(series, quantiles, names),
    }
