"""What reading alters of a user's numbers counts in every bound, against the numbers that were given."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from harness.verification.batched.assess import assess
from harness.verification.batched.bound import Bound, independence
from harness.verification.batched.bound import gaps as batched_gaps
from harness.verification.batched.residual import refined, residual, split
from harness.verification.certificate import certify
from harness.verification.exact_residual import DoubleDouble, forces, gaps
from springs import diagonal

from harness.verification.reference import UNPROVEN, best_of_candidates
from problems.build import load_case, prepared
from problems.forms.alteration import Alteration
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.input.user_matrices import read_matrices
from problems.scene import read_scene
from problems.stiffness.operator import Stiffness
from problems.storage import cache

EXTENDED = np.finfo(np.longdouble).nmant > 53
N = 4


def rational(values: Any) -> list[Any]:
    """Nested lists of the same numbers as fractions."""
    if np.ndim(values):
        return [rational(row) for row in values]
    return Fraction(*values.as_integer_ratio()) if isinstance(values, np.floating) else Fraction(int(values))


def solution(K: list[Any], A: list[Any], f: list[Any], g: list[Any]) -> list[Fraction]:
    """x of Kx + Aλ = f, Aᵀx ≤ g, λ ≥ 0, λᵀ(g − Aᵀx) = 0, exactly, by trying the contact sets."""
    n, m = len(f), len(g)
    for closed in product([False, True], repeat=m):
        C = [j for j in range(m) if closed[j]]
        rows = [[*K[i], *(A[i][j] for j in C), f[i]] for i in range(n)]
        rows += [[*(A[i][j] for i in range(n)), *(Fraction(0) for _ in C), g[j]] for j in C]
        found = eliminated(rows)
        x, lam = found[:n], found[n:]
        s = [g[j] - sum(A[i][j] * x[i] for i in range(n)) for j in range(m)]
        if min([*s, *lam]) >= 0:
            return x
    raise AssertionError("a positive definite problem has an answer")


def eliminated(rows: list[list[Fraction]]) -> list[Fraction]:
    size = len(rows)
    for k in range(size):
        pivot = next(i for i in range(k, size) if rows[i][k] != 0)
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(size):
            if i != k and rows[i][k] != 0:
                factor = rows[i][k] / rows[k][k]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return [row[-1] / row[k] for k, row in enumerate(rows)]


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
MAKERS = [
    by_an_ulp,
    whole,
    pytest.param(extended, marks=pytest.mark.skipif(not EXTENDED, reason="no long double")),
]


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("condition", [4e6, 4e9, 4e12])
def test_the_bounds_hold_for_what_was_given(tmp_path: Path, make: Make, condition: float) -> None:
    """For K as given, its transpose and its symmetric part, by the certificate and for a block of cases."""
    wide = 0
    for seed in range(6):
        data = make(seed, condition)
        path = tmp_path / f"{seed}.npz"
        np.savez(path, **data)
        made, load = prepared(read_scene(str(path))), load_case(read_scene(str(path)))
        assert made.assembly.altered
        known = best_of_candidates(made, load)
        load = LoadCase(load.f, load.g, made.dual_load(load))
        (vouched,) = assess(Bound.of(made), [load], [known.lam], [None])
        K, A, f, g = (rational(data[key]) for key in "KAfg")
        transposed = [list(row) for row in zip(*K, strict=True)]
        mean = [[(a + b) / 2 for a, b in zip(u, v, strict=True)] for u, v in zip(K, transposed, strict=True)]
        for stiffness in (K, transposed, mean):
            exact = solution(stiffness, A, f, g)
            for x, bound in ((known.x, known.bound_mm), (vouched.x, vouched.bound_mm)):
                error = max(abs(Fraction(float(a)) - b) for a, b in zip(x, exact, strict=True))
                assert bound == np.inf or error <= Fraction(bound)
                wide += error > Fraction(1, 10**17) * 1000
        if condition < 1e9:
            assert known.bound_mm < 1e-5
            assert vouched.bound_mm < 1e-5
            assert known.route.startswith("proven; ")
    assert wide or condition < 1e9


def test_what_fits_is_not_altered(tmp_path: Path) -> None:
    data = conditioned(0, 1e3)
    for dtype in (np.float64, np.float32, np.longdouble):
        np.savez(
            tmp_path / "same.npz",
            **{key: value.astype(np.float32).astype(dtype) for key, value in data.items()},
        )
        assert read_matrices({"problem": tmp_path / "same.npz"})[0].altered is None
    large = {
        "K": np.eye(N, dtype=np.int64) * 2**60,
        "A": np.eye(N, dtype=bool),
        "f": np.arange(N),
        "g": np.arange(N),
    }
    np.savez(tmp_path / "same.npz", **large)
    assert read_matrices({"problem": tmp_path / "same.npz"})[0].altered is None


def test_how_much_was_altered(tmp_path: Path) -> None:
    """2⁶⁰ + 128 is read as 2⁶⁰, 2⁶³ − 1 as 2⁶³; the mean of two halves is off by half of what they differ."""
    K = np.eye(2) * 4.0
    K[0, 1], K[1, 0] = 1.0, 1.0 + 2.0**-40
    f, g = np.array([2**60 + 128, 2**60]), np.array([2**63 - 1, 5], dtype=np.uint64)
    np.savez(tmp_path / "mine.npz", K=K, A=np.eye(2, dtype=int), f=f, g=g)
    assembly, load = read_matrices({"problem": tmp_path / "mine.npz"})
    altered = assembly.altered
    assert altered is not None
    np.testing.assert_allclose(altered.K, 2.0**-41, rtol=1e-12)
    assert (altered.K >= 2.0**-41).all()
    assert altered.f[0] >= 128
    assert altered.g[0] >= 1
    assert altered.f[1] == altered.g[1] == 0
    assert not altered.A_rows.any()
    assert not altered.A_columns.any()
    np.testing.assert_array_equal(load.f, [2.0**60, 2.0**60])


def test_rounding_and_asymmetry_add_up(tmp_path: Path) -> None:
    K = np.array([[2**60 + 1, 5], [6, 2**60]])
    np.savez(tmp_path / "mine.npz", K=K, A=np.eye(2), f=np.ones(2), g=np.ones(2))
    altered = read_matrices({"problem": tmp_path / "mine.npz"})[0].altered
    assert altered is not None
    assert altered.K[0] >= 1.5
    assert 0.5 <= altered.K[1] <= 0.51


@pytest.mark.skipif(not EXTENDED, reason="no long double here")
def test_extended_precision_is_altered_by_what_it_loses(tmp_path: Path) -> None:
    data: dict[str, Any] = {"K": np.eye(2) * 4.0, "A": np.eye(2), "f": np.ones(2), "g": np.ones(2)}
    lost = np.longdouble(2.0**-60)
    for key in "KAfg":
        changed = data[key].astype(np.longdouble)
        changed.flat[0] += lost
        np.savez(tmp_path / "mine.npz", **data | {key: changed})
        altered = read_matrices({"problem": tmp_path / "mine.npz"})[0].altered
        assert altered is not None
        for name in {"A": ("A_rows", "A_columns")}.get(key, (key,)):
            found = getattr(altered, name)
            assert 2.0**-60 <= found[0] <= 1.001 * 2.0**-60
            assert found[1] == 0.0
    data["f"] = np.array([np.longdouble("1e-4900"), 1])
    np.savez(tmp_path / "mine.npz", **data)
    altered = read_matrices({"problem": tmp_path / "mine.npz"})[0].altered
    assert altered is not None
    assert altered.f[0] > 0


def test_entries_given_twice_are_added_and_the_sum_is_rounded(tmp_path: Path) -> None:
    """0.1 + 0.2 is not 0.3: an assembled K, element by element."""
    K = sp.coo_array((np.array([0.1, 0.2, 4.0]), (np.array([0, 0, 1]), np.array([0, 0, 1]))), shape=(2, 2))
    scipy.io.mmwrite(tmp_path / "K.mtx", K, precision=17, symmetry="general")
    scipy.io.mmwrite(tmp_path / "A.mtx", sp.coo_array(np.eye(2)), symmetry="general")
    for key in "fg":
        scipy.io.mmwrite(tmp_path / f"{key}.mtx", np.ones((2, 1)))
    files = {key: tmp_path / f"{key}.mtx" for key in "KAfg"}
    altered = read_matrices(files)[0].altered
    assert altered is not None
    lost = abs(Fraction(0.1) + Fraction(0.2) - Fraction(0.1 + 0.2))
    assert Fraction(float(altered.K[0])) >= lost > 0
    assert altered.K[1] == 0.0


def test_the_cache_keeps_what_was_altered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))
    np.savez(tmp_path / "mine.npz", **by_an_ulp(0, 1e6))
    first = prepared(read_scene(str(tmp_path / "mine.npz"))).assembly.altered
    monkeypatch.setattr(cache, "store", lambda *_: pytest.fail("read a second time"))
    second = prepared(read_scene(str(tmp_path / "mine.npz"))).assembly.altered
    assert first is not None
    assert second is not None
    for name in vars(first):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert first.norm_K > 0


# Each part of an alteration, alone: it is attained.


def altered(n: int = 1, m: int = 1, **parts: float) -> Alteration:
    sizes = {"K": n, "A_rows": n, "A_columns": m, "f": n, "g": m}
    return Alteration(**{name: np.full(size, parts.get(name, 0.0)) for name, size in sizes.items()})


def off_by(part: Alteration, x: float, lam: float, f: float, g: float) -> float:
    """The certificate's bound for one spring of 1 N/mm against a tool."""
    made = Assembly(diagonal(1.0).K, diagonal(1.0).A, altered=part)
    zero = np.zeros(1)
    at, forced = DoubleDouble(np.array([x]), zero), DoubleDouble(np.array([lam]), zero)
    return certify(
        made, LoadCase(np.array([f]), np.array([g])), at, forced, np.zeros(1, dtype=bool), 1.0
    ).bound_mm


def test_certificate_each_alteration_counts() -> None:
    e = 2.0**-20
    assert e <= off_by(altered(f=e), 1.0, 0.0, 1.0, 10.0) <= 1.02 * e
    # (1 − e) x = 1
    assert e / (1 - e) <= off_by(altered(K=e), 1.0, 0.0, 1.0, 10.0) <= 1.02 * e
    # x* = 2/(1 − e/2) instead of 2, the stiffness halved by an alteration of half of it
    assert 2 <= off_by(altered(K=0.5), 2.0, 0.0, 2.0, 10.0) <= 4.1
    assert off_by(altered(K=1.0), 2.0, 0.0, 2.0, 10.0) == np.inf
    # pressed with 1 N at g = 1: the gap that may be there, times the force, is the bound's square
    for part in (altered(g=e), altered(A_columns=e)):
        assert np.sqrt(e) <= off_by(part, 1.0 - 2 * e, 1.0, 2.0 - 2 * e, 1.0) <= 4 * np.sqrt(e)
    # a gap that is known to half an e only is moved open by more than that
    assert off_by(altered(g=e), 1.0, 1.0, 2.0, 1.0) >= e
    assert off_by(altered(A_rows=e), 0.0, 1.0, 1.0, 10.0) >= e


def test_residuals_are_off_by_each_alteration() -> None:
    rng, zero = np.random.default_rng(0), np.zeros(2)
    x, lam = DoubleDouble(rng.standard_normal(2), zero), DoubleDouble(rng.random(2), zero)
    for name in ("K", "A_rows", "A_columns", "f", "g"):
        part = altered(2, 2, **{name: 0.25})
        made = Assembly(diagonal(1.0, 2.0).K, diagonal(1.0, 2.0).A, altered=part)
        wanted_r = {"K": 0.25 * abs(x.hi).max(), "A_rows": 0.25 * lam.hi.max(), "f": 0.25}.get(name, 0.0)
        wanted_s = {"A_columns": 0.25 * abs(x.hi).max(), "g": 0.25}.get(name, 0.0)
        at = split(made, x.hi[:, None])
        found = residual(made, np.zeros((2, 1)), at, lam.hi[:, None])[1]
        for error, wanted in (
            (forces(made, zero, x, lam).error, wanted_r),
            (found[:, 0], wanted_r),
            (gaps(made, zero, x).error, wanted_s),
            (batched_gaps(made, np.zeros((2, 1)), at)[1][:, 0], wanted_s),
        ):
            np.testing.assert_allclose(error, wanted, rtol=0.02, atol=1e-14)
            assert (error >= wanted).all()
        step = np.full((2, 1), 4.0)
        after = refined(made, at, np.zeros((2, 1)), np.zeros((2, 1)), step, 2.0)[2]
        assert (after >= (1.0 if name == "K" else 0.0)).all()


def test_block_each_alteration_of_the_constants_counts() -> None:
    """‖ΔK‖ = κ/2 doubles the bound; ‖ΔA‖ takes its part of σ; ΔAᵀz is missed by the translation."""
    zero, one = np.zeros((1, 1)), np.ones((1, 1))

    def bound(part: Alteration | None) -> Bound:
        made = Assembly(diagonal(1.0).K, diagonal(1.0).A, altered=part)
        return Bound(Prepared(made), 1.0, 1.0, 1.0, 1.0, np.eye(1))

    def found(part: Alteration | None) -> float:
        return bound(part).bound(one, zero, one, zero, zero)[0]

    assert 1.98 <= found(altered(K=0.5)) / found(None) <= 2.05
    assert found(altered(K=1.0)) == np.inf
    missed = bound(altered(A_columns=0.25))._translation(one, np.zeros(1))[0]
    assert 1.25 <= missed <= 1.26
    for part, least in ((altered(A_columns=0.25), 0.75), (altered(A_rows=0.25), 0.75)):
        made = Assembly(diagonal(1.0).K, diagonal(1.0).A, altered=part)
        assert 0 < independence(made) <= least**2
    assert independence(Assembly(diagonal(1.0).K, diagonal(1.0).A, altered=altered(A_rows=2.0))) == 0.0


# What cannot be proven is said so.


@pytest.mark.parametrize("f", [1.7e308, 1e308])
def test_a_load_that_overflows_is_not_called_proven(f: float) -> None:
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    made = Prepared(Assembly(Stiffness.of(np.asfortranarray(K)), sp.csc_array(np.eye(2))))
    found = best_of_candidates(made, LoadCase(np.full(2, f), np.zeros(2)))
    assert found.bound_mm == np.inf
    assert found.route == UNPROVEN
