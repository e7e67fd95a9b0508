"""Solvers by name, their options, and a user's own solver from a file."""

import doctest
import importlib
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from refusals import refusal_of
from solver_forms import TESTED

import solvers.base
from harness.cli.listing import listing
from problems.errors import InputError
from solvers.libraries.osqp import Osqp
from solvers.plugin import load_plugin
from solvers.registry import make_solver, modules, owner_of, solver_names, solver_version

ROOT = Path(__file__).parents[2]
FOLDERS = {"ours": "methods", "textbook": "textbook", "library": "libraries"}


def test_solvers_are_found_by_their_files() -> None:
    """Ours first, the textbook's, the libraries, then what qpsolvers finds."""
    by_owner = {
        owner: sorted(file.stem.replace("_", "-") for file in (ROOT / "solvers" / folder).glob("[!_]*.py"))
        for owner, folder in FOLDERS.items()
    }
    by_owner["library"].remove("qpsolvers")
    assert list(modules()) == [name for names in by_owner.values() for name in names]
    assert {"newton", "nnls", "osqp"} <= set(modules())
    assert solver_names()[: len(modules())] == list(modules())
    assert {"quadprog", "daqp", "qpalm"} <= set(solver_names())
    assert len(solver_names()) == len(set(solver_names()))
    for owner, names in by_owner.items():
        assert {owner_of(name) for name in names} == {owner}


def test_the_page_of_solvers_names_each_with_its_forms() -> None:
    page, forms = (ROOT / "docs/solvers.md").read_text("utf-8"), {}
    for names, taken in re.findall(r"^\| (`.*?) \|.*\| ([\w, ]+) \|$", page, re.MULTILINE):
        forms |= {name: set(taken.split(", ")) for name in re.findall(r"`([\w-]+)`", names)}
    for name in TESTED:
        assert forms[name] == set(make_solver(name, {}).forms), name
    assert set(modules()) <= set(forms) <= {*solver_names(), "via", "cvxopt", "kvxopt", "qtqp"}


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("osqpp", {}, ["osqpp", "did you mean osqp"]),
        ("osqp", {"polish": True, "speed": 9}, ["options.polish", "options.speed", "polishing"]),
        ("osqp", {"polishing": 1}, ["solver osqp", "options.polishing = 1", "False, True"]),
        ("clarabel", {"direct_solve_method": "mumps"}, ["'mumps'", "'faer', 'qdldl', 'auto'"]),
        ("proxqp", {"backend": "sparse"}, ["options.backend", "'automatic'"]),
        ("piqp", {"backend": "gpu"}, ["options.backend", "'dense', 'sparse'"]),
        ("osqp", {"scaling": "ten"}, ["options.scaling", "of the type of its default 10"]),
        ("osqp", {"eps_abs": 1e-3}, ["options.eps_abs", "no such option"]),
        ("clarabel", {"equilibrate_enable": 1}, ["options.equilibrate_enable", "default True"]),
        ("quadprog", {"tol": 1}, ["options.tol", "no options"]),
        ("gi", {"max_pivots": 0}, ["options.max_pivots", "takes no options"]),
        ("mprgp", {"preconditioner": "U"}, ["'band', 'face', 'none'"]),
        ("projected-gauss-seidel", {"relaxation": 2}, ["relaxation = 2", "between 0 and 2"]),
    ],
)
def test_bad_names_and_options_are_input_errors(name: str, options: dict[str, Any], words: list[str]) -> None:
    error = refusal_of(make_solver, name, options)
    assert len(error.faults) == max(1, len(options))
    for word in words:
        assert word in str(error)


@pytest.mark.parametrize("error", [ImportError("no libosqp.so"), AttributeError("no attribute 'OSQP'")])
def test_a_library_that_cannot_be_imported_is_a_line_of_the_list(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in a version that lacks what its adapter names; the others are listed as ever."""

    def failing(module: str) -> Any:
        if module.endswith(".osqp"):
            raise error
        return importlib.import_module(module)

    monkeypatch.setattr("solvers.registry.importlib", SimpleNamespace(import_module=failing))
    names, forms = (list(column.cells) for column in listing("solvers").columns[:2])
    assert dict(zip(names, forms, strict=True))["osqp"] == f"cannot be imported here ({error})"


def test_the_example_of_the_interface_runs() -> None:
    assert doctest.testmod(solvers.base) == (0, 5)


# Plugins.

GOOD = """
import numpy as np
from solvers.base import Answer, Solver

class Diagonal(Solver):
    forms = ("dual",)
    def __init__(self, *, sweeps: int = 5000):
        self.sweeps = sweeps
    def solve(self, ready, load, tolerance):
        Q, lam = ready.Q, np.zeros(len(load.p))
        for _ in range(self.sweeps):
            for i in range(len(lam)):
                lam[i] = max(0.0, lam[i] - (Q[i] @ lam - load.p[i]) / Q[i, i])
        return Answer("solved", lam)
"""
REFUSING = GOOD.replace("self.sweeps = sweeps", "raise ValueError('sweeps must be positive')")


def write(folder: Path, text: str, name: str = "mine.py") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_a_plugin_goes_by_the_name_of_its_file(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD + "Another = Diagonal\n")
    solver = make_solver("mine", {"sweeps": 3}, path)
    assert type(solver).__name__ == "Diagonal"
    assert vars(solver)["sweeps"] == 3
    assert solver_version("mine", path).startswith("sha256:")
    assert type(make_solver("osqp", {}, path)) is Osqp


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1\n", ["define a subclass of Solver"]),
        ("from solvers.base import Solver\n", ["define a subclass of Solver"]),
        (GOOD + GOOD.replace("Diagonal", "Second"), ["Diagonal, Second", "not several"]),
        (GOOD + "    ) = 3\n", ["line 15", "not Python"]),
        ("import numpy\n1 / 0\n", ["line 2", "ZeroDivisionError"]),
        ("import numpy\nnumpy.linalg.inv('')\n", ["line 2", "LinAlgError"]),
        ("from solvers.base import Solver\nclass Half(Solver):\n    pass\n", ["'Half'", "define solve("]),
    ],
)
def test_plugin_errors_are_one_clear_message(tmp_path: Path, text: str, words: list[str]) -> None:
    path = write(tmp_path, text)
    error = refusal_of(load_plugin, path)
    assert len(error.faults) == 1
    for word in [str(path), *words]:
        assert word in str(error)


@pytest.mark.parametrize(
    ("name", "options", "file", "text", "message"),
    [
        ("no", {}, "no.py", None, "existing Python file"),
        ("mine", {"sweeps": -1}, "mine.py", REFUSING, "sweeps must be positive"),
    ],
)
def test_a_plugin_that_cannot_be_made(
    name: str, options: dict[str, Any], file: str, text: str | None, message: str, tmp_path: Path
) -> None:
    path = write(tmp_path, text, file) if text else tmp_path / file
    with pytest.raises(InputError, match=message):
        make_solver(name, options, path)
