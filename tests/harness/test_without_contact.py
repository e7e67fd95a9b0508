"""A part alone: a linear solve, which the record says, and no solver of quadratic programs is called."""

import json
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import harness, wrong_usage
from matrix_files import PATHS, files_of
from rich.console import Console

from harness import LoadCase, own_matrices, solve_series
from harness.scene.export import export
from harness.scene.import_files import import_matrices
from harness.scene.solve import solve_into
from problems import formats
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.scene_files import read_scene

QUIET = Console(file=StringIO())
#: A strip of 400 × 40 mm clamped at y = 400 and pressed at y = 0; ν = 0 makes it a beam.
SCENE = """
[joint]
junction = { length = 40.0, width = 100.0, nodes = [3, 6] }
[[joint.part]]
name = "strip"
thickness = 4.0
poisson = 0.0
north = { length = 300.0, elements = 6 }
clamped = ["north"]
[[effect]]
kind = "pressure"
part = "strip"
value = 1e-3
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "strip.toml"
    path.write_text(SCENE)
    return path


def answered(path: Path, out: Path, solver: str | None = None) -> dict[str, Any]:
    assert solve_into(str(path), solver, 1e-9, out, QUIET) == 0
    with np.load(out / "solution.npz") as arrays:
        return json.loads((out / "solution.json").read_text()) | dict(arrays)


@pytest.mark.usefixtures("blank_pictures")
def test_a_part_alone_is_a_linear_solve(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("solvers.libraries.piqp.Piqp.convert", lambda *_: pytest.fail("a QP solver was run"))
    monkeypatch.setattr(
        "problems.stiffness.dense_block.lapack.dpotri", lambda *_: pytest.fail("K was inverted for Q")
    )
    answer = answered(path, path.parent / "out", solver="piqp")
    assert (answer["n"], answer["m"], answer["qp"]) == (18, 0, False)
    assert answer["method"].startswith("linear solve")
    assert answer["error_bound_mm"] < 1e-15
    said = "the quadratic program: it was not called for. The scene has no contact; piqp was not run"
    assert said in answer["skipped"]
    # A cantilever of length L under q on its last c mm: the work of the load is Σ fᵀx = ∫ M²/EI.
    q, c, L, EI = 1e-3 * 40.0, 100.0, 400.0, 70e3 * 40.0 * 4.0**3 / 12
    work = (q**2 * c**5 / 20 + (q * c) ** 2 * ((L - c / 2) ** 3 - (c / 2) ** 3) / 3) / EI
    f = load_case(read_scene(str(path))).f
    assert f @ answer["x"] == pytest.approx(work, rel=2e-3)  # f stands on the nodes


def test_its_page_has_no_contacts(path: Path) -> None:
    out = path.parent / "out"
    answered(path, out)
    page = (out / "answer.md").read_text()
    assert "No quadratic program was needed: the scene has no contact." in page
    assert "displacement.png" in page
    assert not any(word in page for word in ("gap.png", "gap before", "closed contacts", "contacts.csv"))
    assert {file.name for file in out.iterdir()} == {
        *("answer.md", "answer.pdf", "displacement.png", "index.html", "nodes.csv"),
        *("solution.json", "solution.npz", "solution.vtu"),
    }


def test_validate_says_so_and_there_is_nothing_to_measure(path: Path) -> None:
    done = harness("validate", path)
    assert done.exit_code == 0
    assert "No contact: a linear solve" in done.output
    told = wrong_usage("run", "--scene", path, "--solver", "gi", "--out", path.parent / "run")
    assert "there is no quadratic program to measure" in told


@pytest.mark.parametrize("name", ["newton", "gi", "piqp"])
def test_a_series_says_so_too(name: str) -> None:
    scene = own_matrices([[1.0]], np.zeros((1, 0)), [1.0], [])
    with pytest.raises(InputError, match="contacts = 0: at least one, else there is no quadratic program"):
        list(solve_series(scene, [LoadCase(np.ones(1), np.zeros(0))], name))


@pytest.mark.usefixtures("blank_pictures")
@pytest.mark.parametrize("form", ["npz", "mtx"])
def test_there_and_back(form: str, path: Path) -> None:
    """And the matrices, solved by themselves, give the same displacements."""
    file, back = path.parent / PATHS[form], path.parent / "back.npz"
    export(str(path), file, format=form)
    assert file.is_dir() == formats.FORMATS[form].is_folder
    import_matrices(files_of(form, file), back)
    own, scene = read_scene(str(back)), read_scene(str(path))
    wanted, imported = prepared(scene), prepared(own)
    np.testing.assert_array_equal(imported.assembly.K.matrices[0], wanted.assembly.K.matrices[0])
    np.testing.assert_array_equal(load_case(own).f, load_case(scene).f)
    assert imported.assembly.A.shape == (18, 0)
    assert imported.Q.shape == (0, 0)
    x = answered(path, path.parent / "one")["x"]
    np.testing.assert_array_equal(answered(back, path.parent / "two")["x"], x)


def test_dmig_has_no_way_to_say_so(path: Path) -> None:
    with pytest.raises(InputError, match="no matrix without columns"):
        export(str(path), path.parent / "k.pch", format="dmig")
