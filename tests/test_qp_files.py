"""Quadratic programs of others, .qps and .mat: as contact problems, or refused with the reason."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import highspy
import numpy as np
import pytest
import scipy.io
import scipy.optimize
import scipy.sparse as sp
from typer.testing import CliRunner

from harness import load_scene, solve
from harness.cli.app import app
from problems import formats
from problems.errors import InputError

# The layout of Maros and Mészáros, with the bounds of its example made one-sided.
QPS = """\
NAME          EXAMPLE
ROWS
 N  obj
 G  r1
 L  r2
COLUMNS
    c1        r1         2.0   r2       -1.0
    c1        obj        1.5
    c2        r1         1.0   r2        2.0
    c2        obj       -2.0
RHS
    rhs1      obj       -4.0   r1        2.0
    rhs1      r2         6.0
BOUNDS
{bounds}
QUADOBJ
    c1        c1         8.0
    c1        c2         2.0
    c2        c2        10.0
ENDATA
"""
FREE = " FR bnd1      c1\n FR bnd1      c2"
P, Q = np.array([[8.0, 2.0], [2.0, 10.0]]), np.array([1.5, -2.0])
C = np.array([[2.0, 1.0], [-1.0, 2.0]])
MAT: dict[str, Any] = {
    "P": sp.csc_matrix(P),
    "q": Q[:, None],
    "A": sp.csc_matrix(C),
    "l": np.array([[2.0], [-1e20]]),
    "u": np.array([[1e20], [6.0]]),
    "r": 4.0,
}


def qps(folder: Path, bounds: str = FREE, old: str = "", new: str = "") -> Path:
    path = folder / "problem.qps"
    path.write_text(QPS.format(bounds=bounds).replace(old, new) if old else QPS.format(bounds=bounds))
    return path


def mat(folder: Path, **changed: Any) -> Path:
    path = folder / "problem.mat"
    scipy.io.savemat(path, {name: value for name, value in (MAT | changed).items() if value is not None})
    return path


@pytest.mark.parametrize("write", [qps, mat])
def test_both_files_hold_the_same_problem(write: Any, tmp_path: Path) -> None:
    found = formats.read(write(tmp_path))
    np.testing.assert_array_equal(found["K"].toarray(), P)
    np.testing.assert_array_equal(found["f"], -Q)
    np.testing.assert_array_equal(found["A"].toarray().T, [[-1.0, 2.0], [-2.0, -1.0]])
    np.testing.assert_array_equal(found["g"], [6.0, -2.0])


@pytest.mark.parametrize("write", [qps, mat])
def test_an_imported_file_is_solved_as_scipy_solves_it(write: Any, tmp_path: Path) -> None:
    out = tmp_path / "scene.npz"
    result = CliRunner().invoke(app, ["import", str(write(tmp_path)), "--out", str(out)])
    assert result.exit_code == 0, result.output
    rows = [{"type": "ineq", "fun": lambda x: C[0] @ x - 2}, {"type": "ineq", "fun": lambda x: 6 - C[1] @ x}]
    theirs = scipy.optimize.minimize(
        lambda x: x @ P @ x / 2 + Q @ x, [0.0, 0.0], jac=lambda x: P @ x + Q, constraints=rows, tol=1e-12
    )
    np.testing.assert_allclose(solve(load_scene(str(out))).x, theirs.x, atol=1e-7)


def test_bounds_of_unknowns_are_contacts(tmp_path: Path) -> None:
    """MPS gives an unknown without a bound x ≥ 0, and MI none below."""
    found = formats.read(qps(tmp_path, " UP bnd1      c2        0.25\n MI bnd1      c2"))
    np.testing.assert_array_equal(found["A"].toarray().T[1:], [[0, 1], [-2, -1], [-1, 0]])
    np.testing.assert_array_equal(found["g"], [6.0, 0.25, -2.0, 0.0])


REFUSED: list[tuple[Any, dict[str, Any], str]] = [
    (qps, {"old": " L  r2", "new": " E  r2"}, "an equation"),
    (qps, {"bounds": " UP bnd1 c1 20.0\n FR bnd1 c2"}, "two finite bounds"),
    (qps, {"bounds": " LO bnd1 c1 3.0\n UP bnd1 c1 1.0\n FR bnd1 c2"}, "nothing satisfies both"),
    (qps, {"bounds": FREE + "\n LO bnd1 c1 3.0"}, "a second bound"),
    (qps, {"bounds": " UP bnd1 c1 -1.0\n FR bnd1 c2"}, "needs a lower one"),
    (qps, {"bounds": FREE + "\n BV bnd1 c1"}, "real unknowns only"),
    (qps, {"old": "ROWS", "new": "OBJSENSE\n    MAX\nROWS"}, "contact problems are minima"),
    (qps, {"old": "RHS\n", "new": "    M1  'MARKER'  'INTORG'\nRHS\n"}, "real unknowns only"),
    (qps, {"old": "ENDATA\n", "new": ""}, "truncated"),
    (qps, {"old": "8.0", "new": "8,0"}, "8,0"),
    (qps, {"old": "8.0", "new": "nan"}, "no finite number"),
    (qps, {"old": "10.0", "new": ""}, "each with a number"),
    (qps, {"old": "    c1        c2         2.0", "new": "    c1        c9         2.0"}, "c9 is no unknown"),
    (qps, {"old": "    rhs1      r2 ", "new": "    rhs1      r3 "}, "r3 is no row"),
    (qps, {"old": "ENDATA", "new": "    c2        c1         2.0\nENDATA"}, "a second value"),
    (qps, {"old": "RHS\n", "new": "SOS1\nRHS\n"}, "an unknown section"),
    (mat, {"l": np.array([[2.0], [6.0]])}, "an equation"),
    (mat, {"l": np.array([[2.0], [7.0]])}, "nothing satisfies both"),
    (mat, {"l": np.array([[2.0], [5.0]])}, "two finite bounds"),
    (mat, {"u": np.array([[1e20], [np.nan]])}, "not a number"),
    (mat, {"u": np.array([[6.0]])}, "a lower and an upper bound for each row"),
    (mat, {"q": None, "l": None}, "q, l missing"),
]


@pytest.mark.parametrize(("write", "changed", "why"), REFUSED)
def test_what_is_no_contact_problem_is_refused_with_the_reason(
    write: Any, changed: dict[str, Any], why: str, tmp_path: Path
) -> None:
    path = write(tmp_path, **changed)
    with pytest.raises(InputError, match=why) as refused:
        formats.read(path)
    assert all(fault.where == str(path) for fault in refused.value.faults)


@pytest.mark.parametrize("diagonal", [0.0, -1.0])
def test_a_singular_or_indefinite_P_is_refused(diagonal: float, tmp_path: Path) -> None:
    path = mat(tmp_path, P=sp.csc_matrix(np.diag([8.0, diagonal])))
    result = CliRunner().invoke(app, ["import", str(path), "--out", str(tmp_path / "scene.npz")])
    assert result.exit_code == 2
    assert "positive" in result.output
    assert not (tmp_path / "scene.npz").exists()


@pytest.mark.parametrize("kind", ["L", "G"])
@pytest.mark.parametrize(
    "bounds", [FREE, " LO bnd1 c1 -3.0\n MI bnd1 c2", " PL bnd1 c1\n MI c2\n UP c2 -1.0"]
)
def test_highs_reads_the_same(kind: str, bounds: str, tmp_path: Path) -> None:
    """Where the file is right; HiGHS takes 8,0 for 8 and drops small entries of P."""
    path = qps(tmp_path, bounds, " L  r2", f" {kind}  r2")
    found = formats.read(path)
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    assert highs.readModel(str(path.rename(path.with_suffix(".mps")))) == highspy.HighsStatus.kOk
    program = highs.getLp()
    lower = np.array([*program.row_lower_, *program.col_lower_])
    upper = np.array([*program.row_upper_, *program.col_upper_])
    np.testing.assert_array_equal(found["g"], [*upper[upper < np.inf], *-lower[lower > -np.inf]])
    np.testing.assert_array_equal(found["f"], -np.array(program.col_cost_))
    rows = np.vstack([C, np.eye(2)])
    np.testing.assert_array_equal(found["A"].toarray().T, [*rows[upper < np.inf], *-rows[lower > -np.inf]])
