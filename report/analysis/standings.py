"""The ranking of the solvers: answers within the limit first, then time.

Times of different solvers are averaged only over the same scenes. At each size, the lines within the limit on
more than half of its scenes are compared by the geometric mean over those scenes that all of them answered
within the limit. Failures are counted, but enter no mean.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pandas as pd

from report.results.labels import in_order
from report.results.reader import Results

#: Lines that take at most this many times as long as the fastest count as equally fast, more if the repeats
#: of one of them differ by more: single runs on a shared machine vary by as much.
TIE = 1.15


@dataclass(frozen=True)
class Comparison:
    """The geometric means at one size: seconds per load case by label, over `common` of `scenes`."""

    n: int
    scenes: list[str]
    common: list[str]
    seconds: dict[str, float]


def geometric_mean(values: pd.Series[float]) -> float:
    return float(np.exp(np.log(values).mean()))


def seconds_within(cells: pd.DataFrame) -> pd.DataFrame:
    """Seconds per load case by scene (rows) and label (columns), missing if not within the limit."""
    within = cells[(cells["verdict"] == "within") & cells["load_case_s"].notna()]
    table = within.pivot_table(index="scene", columns="label", values="load_case_s", aggfunc="first")
    return table.reindex(index=cells.drop_duplicates("scene").sort_values("active")["scene"])


def preferred(seconds: pd.Series[float], cells: pd.DataFrame) -> pd.DataFrame:
    """One line per method with the setting to use, the fastest first: `label` (the index), `method`,
    `tolerance` and `seconds`. It is the tightest of the tolerances that are as fast as the method's fastest.

    seconds : by label, of the settings to choose from.
    """
    known = cells.drop_duplicates("label").set_index("label")[["method", "tolerance"]].loc[seconds.index]
    known = known.assign(seconds=seconds)
    several = cells.groupby("label")["tolerance"].nunique() > 1  # each scene's own, found by a search
    known["tolerance"] = known["tolerance"].mask(several)
    as_fast = known["seconds"] <= TIE * known.groupby("method")["seconds"].transform("min")
    tightest = known[as_fast].sort_values(["tolerance", "seconds"]).drop_duplicates("method")
    return tightest.sort_values("seconds")


def tie_of(cells: pd.DataFrame, *labels: str) -> float:
    """TIE, or the ratio of slowest to fastest repeat of one of these lines, its mean over the scenes."""
    ratios = cells[cells["label"].isin(labels)].assign(ratio=lambda line: line["most_s"] / line["least_s"])
    ratios = ratios[ratios["least_s"] > 0]
    return max([TIE, *ratios.groupby("label")["ratio"].agg(geometric_mean)])


def compare(results: Results, n: int) -> Comparison:
    seconds = seconds_within(results.of_size(n))
    compared = seconds.loc[:, seconds.notna().sum() * 2 > len(seconds)]
    common = compared.dropna()
    means = {str(label): geometric_mean(common[label]) for label in common} if len(common) else {}
    return Comparison(n, seconds.index.tolist(), common.index.tolist(), means)


def standings(results: Results) -> pd.DataFrame:
    """One line per label, the best first: by the share of scenes within the limit, then by time relative to
    the fastest on the scenes it answered.
    """
    cells = results.cells[results.cells["status"] != "unsupported"]
    comparisons = [compare(results, n) for n in results.sizes]
    seconds = seconds_within(cells)
    slower = seconds.div(seconds.min(axis=1), axis=0)
    lines = []
    for label in in_order(cells):
        line = cells[cells["label"] == label]
        verdicts = line["verdict"].value_counts()
        missed = line[line["verdict"] == "no_answer"]["status"]
        outside = line[line["verdict"] == "outside"]
        record = {
            "label": label,
            "method": line["method"].iloc[0],
            "solver": line["solver"].iloc[0],
            "form": line["form"].iloc[0],
            "scenes": len(line),
            "within": int(verdicts.get("within", 0)),
            "outside": len(outside),
            "outside_claimed": int((outside["status"] == "solved").sum()),
            "cannot_be_judged": int(verdicts.get("cannot_be_judged", 0)),
            "no_answer": len(missed),
            "no_answer_because": ", ".join(f"{k} {_words(s)}" for s, k in Counter(missed).most_common()),
            "worst_error_mm": line["displacement_error_mm"].max(),
        }
        for comparison in comparisons:
            record[f"load_case_s_{comparison.n}"] = comparison.seconds.get(label)
        record["peak_rss_mib"] = line["peak_rss_mib"].max()
        record["slower"] = geometric_mean(slower[label].dropna()) if label in slower else np.inf
        lines.append(record)
    table = pd.DataFrame(lines)
    if table.empty:
        return table
    table["share"] = table["within"] / table["scenes"]
    keys = {"share": False, "within": False, "slower": True, "no_answer": True, "worst_error_mm": True}
    table = table.sort_values([*keys], ascending=[*keys.values()], kind="stable")
    return table.drop(columns=["share", "slower"]).reset_index(drop=True)


def _words(status: str) -> str:
    return status.replace("_", " ")
