"""Statistics of a series against brute force, and the report's files."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from synthetic_series import CASES, M, made

from harness.results import series_file
from report.document.blocks import Figure, records
from report.document.numbers import significant
from report.results.series_results import QUANTILES, convergence, exceedance, quantile_maps, read
from report.writers import place_report
from report.writers.series_report import _maps, _sheet, _statistics, _swept, write
from report.writers.sheet import Sheet


@pytest.mark.parametrize("at_once", [1, 1000, 2**22])
def test_maps_and_exceedance_in_pieces(at_once: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gaps = made(tmp_path)
    monkeypatch.setattr("report.results.series_results.AT_ONCE", at_once)
    series = read(tmp_path)
    assert series.counts == {"within": CASES - 1, "no_answer": 1}
    maps = quantile_maps(series)
    for q, values in zip(QUANTILES, maps, strict=False):
        np.testing.assert_allclose(values, np.quantile(gaps, q, axis=0))
    np.testing.assert_allclose(maps[-1], gaps.mean(axis=0))
    curve = exceedance(series)
    for t, cases, contacts in curve.to_numpy()[::17]:
        assert cases == pytest.approx((gaps.max(axis=1) > t).mean())
        assert contacts == pytest.approx((gaps > np.float32(t)).mean())
    assert curve["share_of_contacts"][0] < 1  # a contact without a gap does not exceed zero
    assert curve["share_of_cases"].iloc[-1] == 0


def test_the_interval_of_a_quantile_covers_it_as_often_as_it_says(tmp_path: Path) -> None:
    """Median of 100: the 40th and the 61st value. And by simulation for the 95 % quantile."""
    made(tmp_path)
    series = read(tmp_path)
    table = convergence(series)
    values = np.sort(series.cases["max_gap_mm"].to_numpy())
    last = table[table["cases"] == len(values)].set_index("quantile")
    assert last.loc[0.95, "gap_mm"] == pytest.approx(np.quantile(values, 0.95))
    assert np.isnan(last.loc[0.99, "high_mm"])  # 239 cases do not bound it from above
    rng = np.random.default_rng(1)
    hits = 0
    for _ in range(50):
        cases = pd.DataFrame({"max_gap_mm": rng.uniform(size=100)})
        found = convergence(replace(series, cases=cases))
        row = found[(found["cases"] == 100) & (found["quantile"] == 0.5)].iloc[0]
        ordered = np.sort(cases["max_gap_mm"])
        assert (row["low_mm"], row["high_mm"]) == (ordered[39], ordered[60])
        hits += row["low_mm"] <= 0.5 <= row["high_mm"]
    assert 0.9 <= hits / 50 <= 1.0


@pytest.mark.parametrize("swept", [False, True])
def test_the_report_and_its_files(swept: bool, tmp_path: Path) -> None:
    gaps = made(tmp_path, swept)
    text = write(tmp_path).read_text()
    last = "sweep-initial_gap.mean" if swept else "convergence"
    for name in ("quantile-maps", "worst-case", "exceedance", last):
        assert (tmp_path / "report" / f"{name}.png").stat().st_size > 3000
        assert f"]({name}.png)" in text
        assert len(pd.read_csv(tmp_path / "report" / f"{name}.csv")) > 3
    worst = pd.read_csv(tmp_path / "report" / "worst-case.csv")
    assert worst["gap_mm"].max() == pytest.approx(gaps.max())
    maps = pd.read_csv(tmp_path / "report" / "quantile-maps.csv")
    np.testing.assert_allclose(maps["q0.95_mm"], np.quantile(gaps, 0.95, axis=0))
    assert "239 within, 1 no answer" in text.replace("1 no answer, 239 within", "239 within, 1 no answer")
    assert "76.9 cases per second of work" in text


def test_a_sweep_that_changes_nothing_says_so(tmp_path: Path) -> None:
    made(tmp_path, swept=True)
    series = read(tmp_path)
    values = series.cases["initial_gap.mean"]
    for moved, error, said in (
        (0.0, 1e-12, True),
        (3e-13, 1e-12, True),
        (1e-9, 1e-12, False),
        (0.0, None, False),
        (0.0, np.where(values > 0, 1e-12, np.nan), False),
    ):
        own = {"max_gap_mm": 0.04 + moved * values, "mean_gap_mm": 0.01, "gap_error_mm": error}
        cases = series.cases.assign(**own)
        figure = _swept(replace(series, cases=cases), "initial_gap.mean")
        assert ("initial_gap.mean changes neither" in figure.caption) is said


def test_one_unknown_error_leaves_the_exactness_untold(tmp_path: Path) -> None:
    """Though all others are proven: an infinite error is null in the file, and NaN here."""
    made(tmp_path)
    series = read(tmp_path)
    errors = np.full(len(series.cases), 1e-9)
    for first, said in ((1e-9, "is exact to"), (np.nan, "could not be shown")):
        errors[0] = first
        cases = series.cases.assign(gap_error_mm=errors)
        assert said in _sheet(replace(series, cases=cases), tmp_path, tmp_path).sure[0]


def test_the_largest_gap_is_on_its_side_of_the_limit_in_tables_and_captions(tmp_path: Path) -> None:
    """Where three digits are on the other side."""
    largest = float(made(tmp_path).max())
    allowed = largest * (1 + 1e-6 * np.sign(float(significant(largest)) - largest))
    series = read(tmp_path)
    series = replace(series, facts=series.facts | {"allowed_gap": {"allowed_mm": allowed}})
    table, (_, worst) = _statistics(series), _maps(series, quantile_maps(series))
    shown = table.columns[-1].show(records(table.data)[0])
    assert (float(shown) > allowed) == (largest > allowed)
    assert f"a largest gap of {shown} mm, in case" in worst.caption


@pytest.mark.usefixtures("without_pictures")
def test_a_report_replaces_the_files_of_the_last_and_no_other(tmp_path: Path) -> None:
    """Even if the title of the series looks like a link to one. Without an answer it is a summary alone."""
    made(tmp_path, name="[CSV](mine.csv)")
    target = write(tmp_path).parent
    older = {path.name for path in target.iterdir()}
    assert {"quantile-maps.png", "worst-case.csv", "sheet.pdf"} < older
    (target / "mine.csv").write_text("x,y,gap\n")
    series_file.append(tmp_path, [({"case": k, "verdict": "no_answer"}, None) for k in range(CASES)])
    text = write(tmp_path).read_text()
    assert {path.name for path in target.iterdir()} == {"mine.csv", "report.md", "summary.csv"}
    assert f"{CASES} no answer" in text
    assert text.count("## ") == 1


def test_the_sheet_has_no_map_of_an_earlier_verdict(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made(tmp_path)
    (tmp_path / "allowed-gap.png").touch()
    sheets: list[Sheet] = []
    monkeypatch.setattr("report.writers.series_report.write_sheet", lambda _, sheet: sheets.append(sheet))
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda _, file, **__: file.touch())
    check = {"kind": "", "said": ["In 1 case it cannot be told."], "allowed_mm": 0.1}
    for more in ({}, {"allowed_gap": check}):
        facts = series_file.read_facts(tmp_path) or {}
        series_file.write_fact(tmp_path, "series", json.dumps(facts | more))
        write(tmp_path)
    assert [sheet.pictures[0].name for sheet in sheets] == ["worst-case.png", "allowed-gap.png"]


def test_a_case_without_an_answer_has_the_largest_gaps_of_the_map_of_a_plan(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    gaps = made(tmp_path / "own")
    record = {"share": 0.95, "own": [], "best": None, "samples": [], "limit_mm": None}
    (figure,) = place_report._maps(record, tmp_path)
    assert isinstance(figure, Figure)
    assert figure.data is not None
    all_cases = np.vstack([gaps, np.full(M, np.inf)])
    np.testing.assert_allclose(figure.data["own_mm"], np.quantile(all_cases, 0.95, axis=0), rtol=1e-6)


@pytest.mark.usefixtures("without_pictures")
def test_plans_of_which_nothing_is_proven_have_a_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As after a stage that is not proven: in their record all gaps are null."""
    step = {"moved": "all candidates", "fasteners": 3, "gap_mm": None}
    lists = {name: [] for name in ("plan", "failing", "unproven")}
    record = {"title": "a joint", "said": "FAIL", "limit_mm": 0.1, "share": 1.0, "count": None, "best": None}
    record |= {"cases": 1, "chosen_by_share": 1.0, "preload": 40.0, "steps": [step | lists]}
    record |= {name: [] for name in ("stages", "samples", "order")}
    record |= {"candidates": [[0.0, 0.0]]}
    (tmp_path / "place.json").write_text(json.dumps(record))
    for name in ("_maps", "_sheet", "write_sheet"):  # of its series
        monkeypatch.setattr(place_report, name, lambda *_: [])
    text = place_report.write(tmp_path).read_text("utf-8")
    assert "| all candidates | 3 | – | no |" in " ".join(text.split())
    assert "| candidates | 1 hole, 40.0 N each |" in " ".join(text.split())


@pytest.mark.usefixtures("without_pictures")
def test_a_series_without_nodes_has_no_map(tmp_path: Path) -> None:
    made(tmp_path)
    series_file.write_contacts(tmp_path, {"m": np.array(M)})
    text = write(tmp_path).read_text()
    assert "exceedance.png" in text
    assert "quantile-maps" not in text
