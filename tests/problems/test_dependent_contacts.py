"""Contacts that depend on one another are refused in the dense forms, and solved in the sparse one."""

import re
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from commands import harness

from harness import LoadCase, own_matrices, solve_series
from problems.build import prepared
from problems.errors import InputError
from problems.forms.dependence import refuse_dependent

N = 100


def differences(m: int) -> sp.csc_array:
    """x_j − 2x_{j+1} + x_{j+2}: one chain of contacts, λmin(AᵀA) about (π/m)⁴."""
    return sp.csc_array(sp.diags_array([1.0, -2.0, 1.0], offsets=[0, -1, -2], shape=(m + 2, m)))


def pairs(m: int) -> sp.csc_array:
    """Two parts of m nodes, in contact at each."""
    return sp.csc_array(sp.vstack([sp.eye_array(m), -sp.eye_array(m)]))


def cycle(m: int) -> sp.csc_array:
    """x_j − x_{j+1}, and back to the first: they add up to zero."""
    return sp.csc_array(sp.eye_array(m) - sp.csc_array(np.roll(np.eye(m), 1, axis=0)))


def grid(k: int) -> sp.csc_array:
    """A contact in each of k × k cells, with the mean of its corners, in a random order."""
    one = sp.diags_array([0.5, 0.5], offsets=[0, 1], shape=(k, k + 1))
    return sp.csc_array(sp.kron(one, one).T)[:, np.random.default_rng(0).permutation(k * k)]


def column_of(A: sp.csc_array) -> int | None:
    """The contact that is refused."""
    try:
        refuse_dependent(A, np.ones(A.shape[0]), "A.mtx")
    except InputError as error:
        (fault,) = error.faults
        assert (fault.where, str(fault.value)[:18]) == ("A.mtx", "dependent on A[:, ")
        assert fault.allowed.startswith("must not depend on the columns before it")
        found = re.fullmatch(r"A\[:, (\d+)\]", fault.key)
        assert found
        return int(found[1])
    return None


@pytest.mark.parametrize("A", [differences(10_000), pairs(3_000), grid(70), sp.csc_array((3, 0))])
def test_independent_contacts_are_taken(A: sp.csc_array) -> None:
    assert column_of(A) is None


@pytest.mark.parametrize(
    ("A", "factor"), [(differences(10_000), 1.0), (pairs(3_000), -3.0), (grid(70), 1e-40)]
)
def test_a_contact_that_is_there_twice_is_named(A: sp.csc_array, factor: float) -> None:
    twice = sp.csc_array(sp.hstack([A, factor * A[:, [17]]]))
    assert column_of(twice) == A.shape[1]


@pytest.mark.parametrize("m", [3, 300])
def test_a_cycle_is_dependent(m: int) -> None:
    assert column_of(cycle(m)) == m - 1


def test_nearly_dependent_contacts_are_taken_where_their_difference_is_no_rounding() -> None:
    for bits, refused in ((16, False), (19, False), (27, True)):
        beside = np.array([[1.0, 1.0], [-1.0, -1.0], [0.0, 2.0**-bits]])
        assert (column_of(sp.csc_array(beside)) == 1) == refused


def test_small_integers_are_refused_exactly_where_their_rank_says_so() -> None:
    random, refused = np.random.default_rng(1), 0
    for _ in range(200):
        n, m = random.integers(2, 9), random.integers(1, 9)
        A = random.integers(-2, 3, (n, m)) * (random.random((n, m)) < 0.5)
        A[0, ~A.any(axis=0)] = 1
        column = column_of(sp.csc_array(A * 2.0 ** random.integers(-30, 30, m)))
        rank = np.linalg.matrix_rank
        assert (column is None) == (rank(A) == m)
        if column is not None:
            assert rank(A[:, : column + 1]) == rank(A[:, :column]) == column
            refused += 1
    assert 40 < refused < 160


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize(
    ("words", "refused"),
    [
        ("solve OWN --form dual --out NEW", True),
        ("judge X OWN --form primal", True),
        ("run --scene OWN --solver newton --form dual --out NEW", True),
        ("solve OWN --out NEW", False),
        ("validate OWN", False),
        ("judge X OWN --form sparse", False),
        ("judge X OWN", False),
        ("export OWN --format npz --out NEW.npz", False),
        ("series OWN --solver newton --form sparse --gaps GAPS --out NEW", False),
        ("run --scene OWN --solver newton --form sparse --out NEW", False),
        ("import OWN --out NEW.npz", False),
    ],
)
def test_commands_refuse_them_in_dense_forms_only(words: str, refused: bool, tmp_path: Path) -> None:
    K, A, f, g = np.eye(N) * 4, np.eye(N, 3)[:, [0, 1, 0]], np.ones(N), np.zeros(3)
    np.savez(path := tmp_path / "own.npz", K=K, A=A, f=f, g=g)
    np.savez(tmp_path / "x.npz", x=np.where(np.arange(N) < 2, 0.0, 0.25))
    np.save(tmp_path / "gaps.npy", np.zeros((2, 3)))
    places = {"OWN": "own.npz", "X": "x.npz", "GAPS": "gaps.npy", "NEW": "new", "NEW.npz": "new.npz"}
    given = [str(tmp_path / places[word]) if word in places else word for word in words.split()]
    done = harness(*given)
    said = " ".join(done.output.split())
    message = f"{path}: A[:, 2] = 'dependent on A[:, 0]': must not depend on the columns before it"
    assert (done.exit_code, message in said) == ((2, True) if refused else (0, False)), done.output
    if words.startswith("solve") and not refused:
        assert "x is unique, the forces λ are one choice of many" in said


def test_contacts_that_the_rounding_of_Q_makes_dependent_are_said() -> None:
    """Apart by 2⁻¹⁹ in A, but by less than the rounding of K⁻¹ in Q: cond(K) = 10¹²."""
    basis = np.linalg.qr(np.random.default_rng(0).standard_normal((N, N)))[0]
    K = (basis * np.geomspace(1, 1e12, N)) @ basis.T
    A = np.eye(N)[:, [*range(50), *range(50)]]
    A[range(50, N), range(50, N)] += 2.0**-19
    load = LoadCase(np.ones(N), np.zeros(N))
    scene = own_matrices((K + K.T) / 2, A, load.f, load.g)
    (result,) = solve_series(scene, [load], form="dual")
    assert result.row["status"] == "failed"
    assert "Q is not positive definite" in result.row["message"]


@pytest.mark.parametrize("bits", [0, 60])
def test_the_units_of_the_unknowns_make_no_contact_dependent(bits: int) -> None:
    """K = I and A = [[1, 1], [0, 1]] with x₂ in another unit; Q is [[1, 1], [1, 2]] in all."""
    S = np.array([1.0, 2.0**-bits])
    K, A = np.diag(S**2), S[:, None] * np.array([[1.0, 1.0], [0.0, 1.0]])
    data = prepared(own_matrices(K, A, [1.0, 1.0], [0.0, 0.0]))
    assert not data.assembly.dependent
    np.testing.assert_array_equal(data.Q, [[1, 1], [1, 2]])


def test_contacts_that_only_a_rigid_unknown_tells_apart_are_dependent() -> None:
    """Q = [[1, 1], [1, 1 + 2⁻⁶⁰]] is singular in double precision, though A is [[1, 1], [0, 1]]."""
    scene = own_matrices(np.diag([1.0, 2.0**60]), [[1.0, 1.0], [0.0, 1.0]], [1.0, 0.0], [0.5, 0.5])
    with pytest.raises(InputError, match=r"A\[:, 1\] = 'dependent on A\[:, 0\]'"):
        prepared(scene)
