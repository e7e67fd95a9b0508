"""How fast is it? Ratios of the fastest answers of each owner, scene by scene."""

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from synthetic_results import results, row, times

from report.results.reader import read
from report.sections import time_to_solution
from report.sections.time_to_solution import FROM_SCENE, ONE_MORE, ours_and_others
from studies.publish import in_series

#: solver, form, owner, seconds to solve on scenes 0 and 1; None: outside the limit.
LINES: list[tuple[str, str, str, tuple[float | None, float | None]]] = [
    ("newton", "dual", "ours", (0.1, 0.2)),
    ("newton", "sparse", "ours", (1.0, 1.0)),
    ("a", "dual", "library", (5.0, None)),
    ("a", "sparse", "library", (3.0, None)),
    ("b", "dual", "textbook", (0.5, 0.4)),
]
PROBLEMS = [
    {"scene": f"4386/{k}", "build_s": {"condensation": 4.0, "cholesky": 1.0, "Q": 2.0}} for k in range(2)
]


def rows() -> list[dict[str, Any]]:
    made = []
    for solver, form, owner, seconds in LINES:
        for k, taken in enumerate(seconds):
            figures: dict[str, Any] = times(solve_s=taken or 1.0) | {"owner": owner}
            figures |= {"model_s": 0.5} if form == "sparse" else {"stages": "K factors Q"}
            figures |= {} if taken else {"verdict": "outside"}
            made.append(row(f"4386/{k}", solver, form, **figures))
    return made


def table(folder: Path, made: list[dict[str, Any]]) -> pd.DataFrame:
    found = ours_and_others(results(folder, made, *PROBLEMS))
    return found.set_index("question") if len(found) else found


def test_the_fastest_of_each_owner_scene_by_scene(tmp_path: Path) -> None:
    ratios = table(tmp_path, rows())
    more = ratios.loc[ONE_MORE]
    assert (more["scenes"], more["seconds"], more["seconds_most"]) == (2, pytest.approx(0.15), 0.2)
    assert (more["textbook"], more["textbook_least"]) == (pytest.approx(3.5), pytest.approx(2.0))
    assert (more["library_least"], more["library_none"]) == (pytest.approx(30.0), 1)
    first = ratios.loc[FROM_SCENE]  # the sparse form: 0.5 + 1 s; the dual one 7 s more
    assert first["seconds"] == pytest.approx(1.5)
    assert first["library_least"] == pytest.approx(3.5 / 1.5)
    assert first["textbook_least"] == pytest.approx(7.4 / 1.5)


def test_scenes_without_a_library_do_not_count_against_libraries(tmp_path: Path) -> None:
    made = [r for r in rows() if (r["owner"], r["scene"]) != ("library", "4386/1")]
    ratios = table(tmp_path, made).loc[ONE_MORE]
    assert (ratios["library"], ratios["library_none"]) == (pytest.approx(30.0), 0)
    assert (ratios["scenes"], ratios["textbook"]) == (2, pytest.approx(3.5))


def test_a_round_on_a_slower_machine_has_the_same_ratios(tmp_path: Path) -> None:
    """What was measured beside it is compared with it alone; ours in seconds is what stands by itself."""
    when, made = "2026-01-01T00:00:00+00:00", []
    for each in rows():
        slower = each | {"machine": "Slower CPU", "solve_s": 7 * each["solve_s"], "beside_round": when}
        again = slower | {"round": when, "beside_round": None}
        made += [slower] if each["owner"] == "library" else [each, again]
    ratios = table(tmp_path / "two", made).loc[ONE_MORE]
    expected = table(tmp_path / "one", rows()).loc[ONE_MORE]
    assert ratios.to_dict() == pytest.approx(expected.to_dict())
    assert not read(tmp_path / "two").rows["round"].any()


def test_what_no_library_solves_counts_as_more(tmp_path: Path) -> None:
    made = [r | ({"verdict": "outside"} if r["owner"] == "library" else {}) for r in rows()]
    section = time_to_solution.how_fast(results(tmp_path, made, *PROBLEMS))
    assert section is not None
    (text,) = (block.markdown for block in section.blocks)
    assert "more × (–)" in text


@pytest.mark.parametrize("missing", ["library", "textbook"])
def test_without_an_opponent_there_is_no_figure(tmp_path: Path, missing: str) -> None:
    assert table(tmp_path, [r for r in rows() if r["owner"] != missing]).empty


def test_a_case_of_a_series_with_its_proof_is_compared_with_later_cases(tmp_path: Path) -> None:
    """A library's first case does not count where it has an update; a textbook method has none."""
    made = []
    for solver, owner, seconds in (("a", "library", (9.0, 4.0, 2.0)), ("b", "textbook", (1.0, 1.5, 1.5))):
        for case, taken in enumerate(seconds):
            figures = times(solve_s=taken) | {"case": case, "warm": owner == "library" and case > 0}
            made.append(row("4386/1074", solver, "dual", owner=owner, **figures))
    rows, proven = results(tmp_path, made, *PROBLEMS).rows, {"4386/1074": pd.Series([0.1, 0.2])}
    (line,) = in_series(rows, proven).to_dict("records")
    figures = [line[name] for name in ("n", "scenes", "seconds", "seconds_most", "library", "textbook")]
    assert figures == pytest.approx([4386, 1, 0.15, 0.2, 20.0, 10.0])
    without = in_series(rows[rows["owner"] == "library"], proven)
    assert " – |" in time_to_solution.how_fast_table(without).markdown
