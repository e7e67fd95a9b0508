"""The paper's test problems: sizes and condition of Table 4, active constraints of Table 2."""

import numpy as np
import pytest
from solving import solve

from problems.build import load_case, prepared
from problems.forms.prepared import Prepared
from problems.scene import read_scene, scene_names

TABLE_2 = (52, 107, 418, 795, 863, 1074, 1128, 1347, 1471, 1592)
TABLE_4 = {4386: (2193, 2.63e6), 6112: (3056, 1.11e7), 11308: (5654, 1.77e7)}


@pytest.mark.parametrize("n", TABLE_4)
def test_every_size_has_from_few_to_many_active_constraints(n: int) -> None:
    """The paper's ten at the smallest size and one with nearly all contacts closed; else six and more, none
    far from the next, over 5 … 95 % of m."""
    counts = [int(name.split("/")[1]) for name in scene_names() if name.startswith(f"{n}/")]
    if n == 4386:
        assert tuple(counts) == (*TABLE_2, 2150)
        return
    fractions = np.array(counts) / TABLE_4[n][0]
    assert ((fractions > 0.05) & (fractions < 0.95)).sum() >= 6
    assert fractions.min() < 0.05
    assert fractions.max() > 0.94
    assert np.diff(fractions).max() < 0.3


@pytest.mark.slow
def test_condition_of_the_smallest_problem() -> None:
    """By all eigenvalues of both blocks, where the build takes a few by Lanczos."""
    smallest = prepared(read_scene("4386/0052"))
    assert (smallest.assembly.n, smallest.assembly.m) == (4386, 2193)
    values = np.concatenate([np.linalg.eigvalsh(K) for K in smallest.assembly.K.matrices])
    condition = values.max() / values.min()
    assert condition == pytest.approx(2.63e6, rel=0.01)
    assert smallest.facts["cond_K"] == pytest.approx(condition, rel=1e-6)


@pytest.fixture(scope="module")
def data() -> Prepared:
    """What all scenes of the smallest size share."""
    return prepared(read_scene("4386/0052"), form="sparse")


@pytest.mark.slow
@pytest.mark.parametrize("count", TABLE_2)
def test_active_constraints_of_the_paper(data: Prepared, count: int) -> None:
    case = load_case(read_scene(f"4386/{count:04}"), "sparse")
    lam = solve("newton", "sparse", data, case)[0].lam
    assert abs(int((lam > 0).sum()) - count) <= 22  # 1 % of m
    assert lam.min() >= 0
    assert (data.compliance @ lam - data.dual_load(case)).min() > -1e-9
