"""The comparison of the search with other ways, on joints small enough for a test."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from studies import placement


def test_farthest_points() -> None:
    """The one that does most, then what is farthest from it."""
    places = ((0.0, 0.0), (1.0, 0.0), (10.0, 0.0))
    apart = np.array([[0, 1, 10], [1, 0, 9], [10, 9, 0]]) + np.diag([5.0, 5.1, 6.0])
    assert placement.farthest_plans(places, apart) == [places[2:], (places[0], places[2]), places]


@pytest.mark.slow
def test_it_compares_and_writes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small = placement.joint(200.0, 60.0, (11, 4), (2.0, 3.0))
    sizes = {"CASES": 10, "SHARE": 0.9, "SMALL_CASES": 5, "SMALL_JOINTS": 1, "HOLES": ((1, 3),)}
    for name, value in {"JOINTS": {"small": (small, 100.0, (1, 4))}, **sizes}.items():
        monkeypatch.setattr(placement, name, value)
    placement.main(tmp_path)
    fewest, optimum, orders = (pd.read_csv(tmp_path / f"{n}.csv") for n in ("fewest", "optimum", "orders"))
    assert len(fewest) == 2 * 5
    found = fewest[fewest["method"] == "removal and exchange"].set_index("scatter")["fasteners"]
    assert (fewest.set_index("scatter")["fasteners"] >= found.reindex(fewest["scatter"]).array).all()
    assert (optimum["found"] >= optimum["optimum"]).all()
    assert set(orders["order"]) == {"least needed last", "left to right", "centre outwards"}
    assert "random plans" in (tmp_path / "placement.md").read_text()
