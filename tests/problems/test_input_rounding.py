"""What float64 cannot hold is rounded, an asymmetry within rounding taken out, both are said, and the problem
that results is the one that is proven.
"""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exact_answer import exact_optimum, exactly

from harness.verification.reference import best_of_candidates
from problems import storage
from problems.build import load_case, prepared
from problems.input.user_matrices import read_matrices
from problems.scene_files import read_scene

N = 4


def conditioned(seed: int, condition: float) -> dict[str, Any]:
    """K with λmin 1 and λmax `condition`, contacts against rigid tools, half of them closed."""
    rng = np.random.default_rng(seed)
    basis = np.linalg.qr(rng.standard_normal((N, N)))[0]
    K = (basis * np.geomspace(1, condition, N)) @ basis.T
    x = rng.standard_normal(N)
    f = K @ x + np.array([3.0, 2.0, 0.0, 0.0])
    return {"K": (K + K.T) / 2, "A": np.eye(N), "f": f, "g": x + np.array([0.0, 0.0, 1.0, 2.0])}


def by_an_ulp(seed: int, condition: float) -> dict[str, Any]:
    data = conditioned(seed, condition)
    rng = np.random.default_rng(seed)
    K = data["K"]
    for i, j in zip(*np.triu_indices(N, 1), strict=True):
        K[i, j] = np.nextafter(K[i, j], rng.choice([-np.inf, np.inf]))
    return data


def extended(seed: int, condition: float) -> dict[str, Any]:
    data, rng = conditioned(seed, condition), np.random.default_rng(seed)
    for key in "KAfg":
        value = np.asarray(data[key], dtype=np.longdouble)
        data[key] = value * (1 + np.longdouble(2.0**-55) * rng.integers(-3, 4, value.shape))
    data["K"] = np.triu(data["K"]) + np.triu(data["K"], 1).T
    return data


def whole(seed: int, condition: float) -> dict[str, Any]:
    """Integers around 2⁶⁰, the unit of force so small that λmin is 2⁶⁰/condition or so."""
    data, rng = conditioned(seed, condition), np.random.default_rng(seed)
    scale = 2.0**60 / abs(data["K"]).max()
    K = (data["K"] * scale).astype(np.int64) + rng.integers(-60, 60, (N, N))
    K = np.triu(K) + np.triu(K, 1).T
    return data | {"K": K, "f": (data["f"] * scale).astype(np.int64), "A": np.eye(N, dtype=np.int8)}


Make = Callable[[int, float], dict[str, Any]]
long_double = pytest.mark.skipif(np.finfo(np.longdouble).nmant <= 53, reason="no long double here")
ROUNDED, SYMMETRISED = "that float64 cannot hold were rounded", "was replaced by (K + Kᵀ)/2"


@pytest.mark.parametrize(
    ("make", "note"),
    [
        (by_an_ulp, SYMMETRISED),
        (whole, f"K {ROUNDED}"),
        pytest.param(extended, f"K, A, f, g {ROUNDED}", marks=long_double),
    ],
)
@pytest.mark.parametrize("condition", [4e6, 4e9, 4e12])
def test_the_bound_holds_for_the_problem_as_it_was_taken(
    tmp_path: Path, make: Make, note: str, condition: float
) -> None:
    for seed in range(3):
        np.savez(path := tmp_path / f"{seed}.npz", **make(seed, condition))
        made, load = prepared(scene := read_scene(str(path))), load_case(scene)
        assert note in made.assembly.notes[0]
        (K,) = made.assembly.K.matrices
        assert (K == K.T).all()
        known = best_of_candidates(made, load)
        assert known.bound_mm < np.inf
        exact, *_ = exact_optimum(made.assembly, load, known.active)
        error = max(abs(a - b) for a, b in zip(exactly(known.x), exact, strict=True))
        assert error <= Fraction(known.bound_mm)


def test_what_float64_holds_is_taken_as_it_is(tmp_path: Path) -> None:
    data, path = conditioned(0, 1e3), tmp_path / "same.npz"
    for dtype in (np.float64, np.float32, np.longdouble):
        np.savez(path, **{key: value.astype(np.float32).astype(dtype) for key, value in data.items()})
        assert read_matrices({"problem": path})[0].notes == ()
    K = np.eye(N, dtype=np.int64) * 2**60
    np.savez(path, K=K, A=np.eye(N, dtype=bool), f=np.arange(N), g=np.full(N, 2**63, dtype=np.uint64))
    assembly, load = read_matrices({"problem": path})
    assert assembly.notes == ()
    assert (load.g == 2.0**63).all()


def test_integers_become_the_nearest_float64_and_K_the_mean_of_its_halves(tmp_path: Path) -> None:
    K = np.eye(2) * 4.0
    K[0, 1], K[1, 0] = 1.0, 1.0 + 2.0**-40
    f, g = np.array([2**60 + 129, 2**63 - 1]), np.array([2**64 - 1, 5], dtype=np.uint64)
    np.savez(tmp_path / "mine.npz", K=K, A=np.eye(2, dtype=int), f=f, g=g)
    assembly, load = read_matrices({"problem": tmp_path / "mine.npz"})
    assert (assembly.K.matrices[0][[0, 1], [1, 0]] == 1.0 + 2.0**-41).all()
    np.testing.assert_array_equal(load.f, [2.0**60 + 256, 2.0**63])
    np.testing.assert_array_equal(load.g, [2.0**64, 5.0])
    rounded, symmetrised = assembly.notes
    assert f"f, g {ROUNDED}" in rounded
    assert "asymmetric by 9.1e-13 N/mm" in symmetrised


def test_the_cache_keeps_the_notes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))
    np.savez(tmp_path / "mine.npz", **by_an_ulp(0, 1e6))
    first = prepared(read_scene(str(tmp_path / "mine.npz"))).assembly.notes
    monkeypatch.setattr(storage, "store", lambda *_: pytest.fail("read a second time"))
    assert prepared(read_scene(str(tmp_path / "mine.npz"))).assembly.notes == first != ()
