"""A K that falls apart into thousands of bodies: few arrays, no loop over them, a form that suits it."""

import os
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from harness.api import own_matrices, solve
from harness.planning.form_choice import chosen_form
from problems import storage
from problems.build import load_case, prepared
from problems.forms import FORMS
from problems.input import matrix_files
from problems.scene import read_scene


def liswet(n: int) -> dict[str, sp.csc_array | np.ndarray]:
    """As LISWET1 of Maros and Mészáros: K = I, and rows of second differences."""
    t = np.linspace(0, 1, n)
    A = -sp.diags_array([1.0, -2.0, 1.0], offsets=[0, -1, -2], shape=(n, n - 2), format="csc")
    return {
        "K": sp.eye_array(n, format="csc"),
        "A": A,
        "f": np.sqrt(t) + 0.1 * np.sin(40 * t),
        "g": np.zeros(n - 2),
    }


@pytest.fixture
def scene_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))
    matrix_files.write(tmp_path / "liswet.npz", liswet(10_002))
    return str(tmp_path / "liswet.npz")


def test_ten_thousand_bodies_take_a_fixed_number_of_files(scene_file: str) -> None:
    scene = read_scene(scene_file)
    assert chosen_form(scene, FORMS, None).form == "sparse"
    data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
    assert len(data.assembly.K.blocks) == 1
    assert data.assembly.K.numbers == 10_002  # half-bandwidth 0
    np.testing.assert_array_equal(data.recover(np.zeros(10_000), load), load.f)
    files = [len(names) for _, _, names in os.walk(storage.root())]
    assert max(files) < 16


def test_a_dense_form_of_ten_thousand_bodies_has_few_blocks(scene_file: str) -> None:
    data = prepared(read_scene(scene_file))
    assert [block.size for block in data.assembly.K.blocks] == [512] * 19 + [274]
    assert data.assembly.K.norm == 1.0
    np.testing.assert_array_equal(data.assembly.K.solve(np.arange(10_002.0)), np.arange(10_002.0))


def test_a_hundred_thousand_separate_unknowns_are_solved() -> None:
    """Half of them against stops at 1 mm: x = min(f, 1) there."""
    n, m = 100_000, 50_000
    f = np.linspace(0, 3, n)
    found = solve(
        own_matrices(sp.eye_array(n, format="csc"), sp.eye_array(n, m, format="csc"), f, np.ones(m))
    )
    assert found.judgement.verdict == "within"
    assert (
        abs(found.x - np.where(np.arange(n) < m, np.minimum(f, 1), f)).max() <= found.error_bound_mm <= 1e-12
    )
