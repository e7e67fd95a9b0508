"""The ladders at full size: as exact as the small ones, made when needed only, and all in the suite."""

import numpy as np
import pytest
import scipy.linalg as sla
from exact_answer import is_exact

from harness.planning.plan import expand
from harness.planning.suite import read_suite
from problems.ladders import ladders, make_rung, rung_names
from problems.ladders.manufactured import contacts, exact_assembly, spectrum, two_parts
from problems.model.scene import ManufacturedProblem, ManufacturedScene
from problems.scene import read_scene

RUNGS = rung_names("hard-full/")
OF_BOTH_SIZES = ["degeneracy", "duplicates", "supports", "thickness"]
N = 300  # unknowns per part: 256 + 32 + 8 + 4
SMALL = {
    **{
        f"{percent} % weak": two_parts(N, 1e6, seed=2, closed=min(0.4, 1 - percent / 100), weak=percent / 100)
        for percent in (25, 50, 75, 100)
    },
    **{f"cond {cond:g}": two_parts(N, cond, seed=2) for cond in (1e10, 1e12)},
    **{f"2^-{bits} apart": two_parts(N, 1e4, seed=3, A=contacts(N, 128, 2.0**-bits)) for bits in (4, 12, 16)},
}
IN_HOUSE = {("newton", "dual"), ("ipm-fast", "dual"), ("ipm", "dual"), ("gi", "dual"), ("gi", "primal")}


@pytest.mark.parametrize("name", SMALL)
def test_the_answer_is_exact(name: str) -> None:
    assert is_exact(SMALL[name], 2**60)


def test_the_spectrum_is_exact_for_every_size_and_that_of_hadamard_for_a_power_of_two() -> None:
    for n in (1, 22, 64):
        d = spectrum(n, 1e4)
        K, _ = exact_assembly(d, d).K.matrices
        np.testing.assert_allclose(np.linalg.eigvalsh(K), 64 * np.sort(d), rtol=1e-9)
    H = sla.hadamard(64, dtype=float)
    np.testing.assert_array_equal(K, (H * d) @ H)  # 64 = the stiffness of the grid's smallest eigenvalue


def test_a_rung_is_named_by_its_size_and_has_it() -> None:
    assert list(ladders("hard-full/")) == ["conditioning", *OF_BOTH_SIZES]
    for name in RUNGS:
        size = int(name.split("/")[2].split("-")[0])
        assert (read_scene(name).expected_size or ())[0] == size
        assert read_scene(name).on_ladder
    for ladder in OF_BOTH_SIZES:
        assert any(name.startswith(f"hard-full/{ladder}/11308-") for name in RUNGS)


def test_nothing_is_made_before_it_is_needed_and_one_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def make(name: str) -> ManufacturedProblem:
        made.append(name)
        return SMALL["25 % weak"]

    for name in RUNGS:
        scene = make_rung(name)
        if isinstance(scene, ManufacturedScene):
            monkeypatch.setitem(vars(scene), "make", lambda name=name: make(name))
    expand(read_suite("hard-full"))
    assert not made
    first, second = read_scene("hard-full/degeneracy/4386-025"), read_scene("hard-full/degeneracy/4386-050")
    for scene in (first, first, second, second, first):
        _ = scene.made  # type: ignore[attr-defined]
    assert made == [first.name, second.name, first.name]


def test_the_suite_measures_every_rung_with_every_solver_of_ours() -> None:
    suite = read_suite("hard-full")
    plan = expand(suite)
    assert {m.scene for m in plan} == set(RUNGS)
    for name in RUNGS:
        ours = {(m.solver, m.form) for m in plan if m.scene == name and m.gated}
        assert ours == IN_HOUSE - ({("gi", "primal")} if "/11308-" in name else set())
    assert len({m.solver for m in plan if not m.gated}) <= 2
    assert not any(scene.startswith("hard-full/") for scene in read_suite("hard").scenes)
