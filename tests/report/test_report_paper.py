"""The paper's tables and figures in the report, from made-up rows."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread
from paper_results import (
    SCALING,
    Row,
    Rows,
    changed,
    gi,
    gi_row,
    ipm,
    ipm_row,
    late,
    paper_rows,
    results,
    write_paper,
)
from scipy.stats import linregress
from synthetic_results import no_answer

from report.analysis.fit import exponent
from report.analysis.paper.crossings import BETTER, below, compared, worst
from report.analysis.paper.selection import cells_of_paper, of_method
from report.figures import style
from report.results import printed
from report.sections.paper import figures5_7, table1, table2, table3, table4
from report.writers.markdown import write


@pytest.fixture(autouse=True)
def _coarse_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(style, "DPI", 40)


def test_the_printed_tables() -> None:
    assert [len(c) for both in printed.TABLE_1.values() for c in both.values()] == [36, 36, 34, 34]
    # the lines of iterations 1, 20, 29 and 34 of Table 1, read off the page
    lines = {1: (18395, 19636, 20, 22), 20: (30, 25, 11, 10), 29: (940, 242, 14, 13), 34: (6406, 3690, 23, 9)}
    for k, line in lines.items():
        assert tuple(c[k - 1] for both in printed.TABLE_1.values() for c in both.values()) == line
    none, V = ({k: sum(c) for k, c in both.items()} for both in printed.TABLE_1.values())
    assert sum(none.values()) > 300 * sum(V.values())  # the collapse that the text speaks of
    assert list(printed.TABLE_2) == [52, 107, 418, 795, 863, 1074, 1128, 1347, 1471, 1592]
    assert printed.TABLE_2[1347] == {"stp1": (25, 75.866), "stp2": (21, 71.506), "algorithm_5": (20, 64.038)}
    assert all(n in (2 * m, 2 * m + 1) for _, n, m, _ in printed.TABLE_4)


def test_another_suite_has_no_section_of_the_paper(tmp_path: Path) -> None:
    rows = [ipm_row("4386/0052", 4386, 52), gi_row("4386/0052", 4386, 52, "dual")]
    text = write(write_paper(tmp_path, rows, name="default")).read_text("utf-8")
    assert "Table 1" not in text
    assert "claims" not in text


def test_a_whole_report(tmp_path: Path) -> None:
    text = write(write_paper(tmp_path, paper_rows())).read_text("utf-8")
    titles = re.findall(r"^## (.*)", text, re.M)
    assert [t for t in titles if re.match(r"Table|Figure|The paper", t)] == [
        "The paper's claims",
        "Table 1: CG iterations",
        "Table 2: starting points",
        "Table 3: complexity and memory",
        "Table 4: test problems",
        "Figures 3 and 4: node grids and gap",
        "Figures 5 to 7: time against active contacts",
    ]
    pictures = re.findall(r"!\[.*?\]\((paper.*?)\)", text)
    assert len(pictures) == 7
    for name in pictures:
        assert imread(tmp_path / "report" / name)[..., :3].std() > 0.04, f"{name} is blank"
    assert "nan" not in re.findall(r"\w+", text.lower())
    assert "None" not in text


def test_a_stopped_solve_is_a_lower_bound(tmp_path: Path) -> None:
    def stopped(r: Row) -> Row:
        return r["details"] | {"cg": {"predictor": [7000, 9000], "corrector": [8000]}}

    cut = {"details": stopped, "status": "iteration_limit", "verdict": "outside"}
    part = results(tmp_path, changed(paper_rows(), ipm("preconditioner", "none"), **cut))
    text = "\n".join(_shown(table1.section(part)))
    assert "≥ 24000" in text
    assert re.search(r"\| +2 \| +32527 \| +33338 \| +≥ 9000 \| +\|", text)
    assert "n = 4386: **met** (scene 4386/0795 ≥ 24000 / 486 = ≥ 49)" in text
    assert re.search(r"\| 4386/0795 +\| V = U \+ √D +\| solved .* 486 +\| 13 +\| ≥ 49.4 +\|", text)
    assert re.search(r"\| 4386/0795 +\| V = I +\| iteration limit .* ≥ 24000 +\| ≥ 9000 +\| – +\|", text)
    few = changed(part.rows.to_dict("records"), lambda r: True)
    few = changed(few, ipm("preconditioner", "none"), details={"cg": {"predictor": [900], "corrector": []}})
    text = "\n".join(_shown(table1.section(results(tmp_path / "few", few))))
    assert "n = 4386: **not decided** (scene 4386/0795 ≥ 900 / 486 = ≥ 2)" in text


def _shown(section: Any) -> list[str]:
    """All text of a section as it stands in the report."""
    texts = []
    for block in section.blocks:
        texts.append(block.markdown if block.kind != "figure" else block.caption)
        texts.append(block.caption if block.kind == "table" else "")
    return texts


def test_table_1_counts_and_late_iterations(tmp_path: Path) -> None:
    rows = paper_rows()
    long = {"cg": {"predictor": [99, 3, 4, 41], "corrector": [98, 5, 6, 7]}, "start": {}}
    rows = changed(rows, lambda r: ipm()(r) and r["scene"] == "4386/0795", details=long)
    rows = changed(rows, lambda r: ipm()(r) and r["scene"] == "4386/0052", details=None)
    made = table1.section(results(tmp_path, rows))
    table = made.blocks[2].data.set_index(["scene", "system"])  # type: ignore[union-attr]
    line = table.loc[("4386/0795", "V = U + √D")]
    assert line["cg"] == 99 + 3 + 4 + 41 + 98 + 5 + 6 + 7
    assert line["late"] == 41
    assert line["ratio"] == pytest.approx(27920 / 263)
    assert table.loc[("4386/0795", "direct Cholesky"), ["cg", "factorisations"]].tolist() == [0, 20]
    assert ("4386/0795", "V = U + √D, CG to 1e-10") in table.index
    assert ("4386/0795", "V = U + √D, textbook scheme") in table.index
    text = "\n".join(_shown(made))
    late = "n = 4386: **met** (largest: V = U + √D: 41 (scene 4386/0795); V = U + √D, open gaps last: 7"
    assert late in text


def test_table_2_counts_the_loads(tmp_path: Path) -> None:
    stp1, stp2 = ipm("start", "stp1"), ipm("start", "stp2")
    rows = changed(paper_rows(), lambda r: stp1(r) and r["active"] in (52, 107), iterations=19)
    for row in rows:
        if stp1(row) and row["active"] in (52, 107):
            row["details"]["start"]["mu"] = 400.0 if row["active"] == 52 else 200.0
    rows = changed(rows, lambda r: stp2(r) and r["active"] == 418, **late(20.0))
    text = "\n".join(_shown(table2.section(results(tmp_path, rows))))
    assert "**7 of 9 loads** here (1 without an answer of all three), and on 8 of 10 in the printed" in text
    assert "It needs more at 52, 107 active" in text
    assert "Against STP2 alone it needs no more on 9 of 9" in text
    assert "STP1 alone it needs no more on 8 of 10; on the others it needs 1 more" in text
    assert "from a gap μ₀ 2.5 to 5.0 times as large" in text
    line = next(line for line in text.splitlines() if re.match(r"\| +418 ", line))
    words = [w.strip() for w in re.split(r"(?<!\\)\|", line)[1:-1]]
    assert words[:3] == ["418", "418", "22 \\| 24"]
    assert words[4:6] == ["– \\| 24", "> 20 \\| 121"]


def test_exponents_of_known_powers() -> None:
    sizes = [1170.0, 2522.0, 4386.0, 6762.0, 11308.0]
    exact = exponent(sizes, [3e-7 * n**2.5 for n in sizes])
    assert (exact.slope, exact.error, exact.constant) == pytest.approx((2.5, 0.0, 3e-7), abs=1e-9)
    noisy = [n**2 * f for n, f in zip(sizes, (1.1, 0.8, 1.3, 0.9, 1.0), strict=True)]
    fit, other = exponent(sizes, noisy), linregress(np.log(sizes), np.log(noisy))
    assert (fit.slope, fit.error) == pytest.approx((other.slope, other.stderr))
    assert exponent(sizes, [1.0, 2.0, math.nan, 0.0, math.nan]) is None


def test_table_3_fits_what_the_rows_say_and_says_what_is_missing(tmp_path: Path) -> None:
    rows = changed(paper_rows(), lambda r: gi("primal")(r) and r["scene"] == "scaling/11308", **late(33.0))
    made = table3.section(results(tmp_path, rows))
    fits = made.blocks[0].data.set_index("quantity")  # type: ignore[union-attr]
    assert fits.loc["s per CG iteration", "IPM"] == pytest.approx(2.0, abs=1e-4)
    assert fits.loc["data preparation", ["IPM", "GI dual"]].tolist() == pytest.approx([3.0, 3.0])
    assert fits.loc["outer iterations", "IPM"] == pytest.approx(0.3, abs=0.05)
    assert fits.loc["working memory", "GI primal"] == pytest.approx(2.0, abs=1e-6)
    assert fits.loc["working time", "GI dual"] == pytest.approx(3.0, abs=0.02)
    assert fits.loc["working time", ["GI dual, sizes", "GI primal, sizes"]].tolist() == [5, 4]
    assert "(4 sizes only)" in fits.loc["working time", "GI primal, shown"]
    assert fits.loc["of it the solver's own", ["IPM", "GI dual"]].tolist() == pytest.approx([3.0, 3.0])
    absolute = made.blocks[1]  # type: ignore[union-attr]
    assert len(absolute.data) == 4 * len(SCALING)  # type: ignore[union-attr]
    assert "> 33" in absolute.markdown  # type: ignore[union-attr]


def test_times_too_short_for_the_clock_give_no_exponent(tmp_path: Path) -> None:
    rows = changed(paper_rows(), gi("primal"), prepare_s=1.4e-5)
    fits = table3.section(results(tmp_path, rows)).blocks[0].data.set_index("quantity")  # type: ignore[union-attr]
    assert fits.loc["of it the solver's own", "GI primal, shown"] == "–"
    assert fits.loc["data preparation", "GI primal"] == pytest.approx(3.0, abs=0.05)


def test_table_4(tmp_path: Path) -> None:
    rows = [ipm_row("4386/0052", 4386, 52), ipm_row("scaling/6112", 6112, 1000)]
    made = table4.section(results(tmp_path, rows))
    table = made.blocks[0].data.set_index("problem")  # type: ignore[union-attr]
    assert table.loc[1, "difference_percent"] == pytest.approx(100 * (2.6303e6 / 2.63e6 - 1))
    assert pd.isna(table.loc[2, "cond_K"])


def _curve(name: str, seconds: Callable[[float], float], shares: list[float]) -> Rows:
    make = {"IPM": ipm_row, "GI dual": lambda *at, **f: gi_row(*at, "dual", **f)}[name]
    at = [(f"4386/{round(2193 * s):04d}", 4386, round(2193 * s)) for s in shares]
    return [make(*a, solve_s=seconds(a[2] / 2193)) for a in at]


def test_a_crossing_stands_where_it_was_put(tmp_path: Path) -> None:
    # log t: 2s against 1.5 − 3s, equal at s = 0.3
    shares = [0.05, 0.2, 0.45, 0.9]
    rows = _curve("IPM", lambda s: math.exp(2 * s), shares)
    rows += _curve("GI dual", lambda s: math.exp(1.5 - 3 * s), shares)
    pair = compared(cells_of_paper(results(tmp_path, rows)), 4386, "GI dual", "IPM")
    assert [c.at for c in pair.crossings] == pytest.approx([0.3], abs=1e-9)
    assert (pair.faster_at_low, pair.crossings[0].faster) == ("IPM", "GI dual")
    assert str(pair).endswith("at 5 % IPM is faster; at 30 % GI dual becomes faster")


def test_a_crossing_beside_a_stopped_run_is_an_interval(tmp_path: Path) -> None:
    rows = _curve("IPM", lambda s: 2.0, [0.1, 0.4, 0.8])
    rows += _curve("GI dual", lambda s: 1.0, [0.1, 0.4, 0.8])
    stopped = changed(rows, lambda r: gi("dual")(r) and r["active"] < 300, **late(5.0))
    pair = compared(cells_of_paper(results(tmp_path, stopped)), 4386, "GI dual", "IPM")
    assert str(pair) == "at 10 % IPM is faster; between 10 and 40 % GI dual becomes faster"
    # stopped before the other's time: nothing follows
    early = changed(rows, lambda r: gi("dual")(r) and r["active"] < 300, **late(1.5))
    pair = compared(cells_of_paper(results(tmp_path / "early", early)), 4386, "GI dual", "IPM")
    assert str(pair) == "none: GI dual is faster from 40 to 80 % (1 scene could not be compared)"


def test_worst_cases(tmp_path: Path) -> None:
    shares = [0.1, 0.9]
    rows = _curve("IPM", lambda s: 4.0, shares) + _curve("GI dual", lambda s: 10 - 9 * s, shares)
    primal = [(r["scene"], 4386, r["active"]) for r in rows[:2]]
    rows += [gi_row(*at, "primal", solve_s=8 * at[2] / 2193) for at in primal]
    cells = cells_of_paper(results(tmp_path, rows))
    found = {name: worst(cells, 4386, name) for name in ("IPM", "GI dual", "GI primal", BETTER)}
    assert [w.seconds for w in found.values() if w] == pytest.approx([4.0, 9.1, 7.2, 1.9], abs=0.01)
    answers = [below(found["IPM"], found[name]) for name in ("GI dual", "GI primal", BETTER)]
    assert answers == [True, True, False]
    crashed = changed(rows, lambda r: ipm()(r) and r["active"] > 1000, **no_answer("crashed"))
    cells = cells_of_paper(results(tmp_path / "crashed", crashed))
    assert below(worst(cells, 4386, "IPM"), worst(cells, 4386, "GI dual")) is None


def test_runs_without_an_answer_stay_in_the_figures_and_tables(tmp_path: Path) -> None:
    rows = changed(paper_rows(), lambda r: gi("primal")(r) and r["active"] == 1592, **late(30.0))
    rows = changed(rows, lambda r: ipm()(r) and r["active"] == 107, **no_answer("memory_limit"))
    wrong = {"verdict": "outside", "displacement_error_mm": 1e-3}
    rows = changed(rows, lambda r: gi("dual")(r) and r["active"] == 418, **wrong)
    made = figures5_7.section(results(tmp_path, rows))
    table = next(b for b in made.blocks if b.name == "paper-times-4386")  # type: ignore[union-attr]
    lines = table.data.set_index("active")  # type: ignore[union-attr]
    assert lines.loc[1592, "GI primal"] == "> 30"
    assert lines.loc[107, "IPM"] == "memory limit"
    assert lines.loc[418, "GI dual"].endswith("(outside)")
    legend = made.blocks[0].drawing.legends[0]  # type: ignore[union-attr]
    words = [text.get_text() for text in legend.get_texts()]
    assert words[-3:] == ["not within the limit", "not finished in time", "no answer"]


def test_of_several_tolerances_the_tightest(tmp_path: Path) -> None:
    at = ("4386/0052", 4386, 52)
    rows = [ipm_row(*at, tolerance=t, solve_s=s) for t, s in ((1e-8, 1.0), (1e-14, 3.0))]
    cells = of_method(cells_of_paper(results(tmp_path, rows)), "IPM")
    assert cells["load_case_s"].tolist() == [3.0]
