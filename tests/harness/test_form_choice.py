"""A scene's size and memory, before anything is built, and the form it is solved in by default."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from harness import own_matrices
from harness.planning import form_choice
from harness.planning.form_choice import chosen_form, refuse_what_cannot_fit, size_of
from harness.scene import validate
from problems.build import prepared
from problems.errors import InputError
from problems.forms import Form
from problems.input import matrix_files, user_matrices
from problems.model.joint_model import JointModel
from problems.scene_files import read_scene
from problems.stiffness.band_factor import half_bandwidth
from solvers.base import FORMS

LARGE, SMALL = read_scene("11308/4300"), read_scene("scaling/2522")
DENSE = ("dual", "primal")
GALLERY = ("three-part-stack", "installed-fasteners", "sheet-over-former", "plate-on-frame", "padded-panel")


@pytest.mark.parametrize("name", GALLERY)
def test_the_sparse_forms_unknowns_bands_and_factors_are_known_before_they_are_made(name: str) -> None:
    scene = read_scene(f"gallery/{name}")
    estimate = size_of(scene)
    assert estimate is not None
    assert estimate.half_bandwidth is not None
    data = prepared(scene, form="sparse")
    assert not data.assembly.K.dense
    assert (estimate.n, estimate.m) == (data.assembly.junction_size, data.assembly.m)
    assert estimate.unknowns == data.assembly.n
    assert estimate.half_bandwidth == max(map(half_bandwidth, data.assembly.K.matrices))
    stored = 8 * data.assembly.K.factor_nonzeros
    assert estimate.sparse_mib == pytest.approx(stored / 2**20)


def test_the_stored_matrices_of_the_dense_forms_are_known_before_they_are_made() -> None:
    scene = read_scene("gallery/three-part-stack")
    made = prepared(scene)
    stored = sum(a.nbytes for a in (*made.assembly.K.matrices, *made.assembly.K.factors, made.Q))
    estimate = size_of(scene)
    assert estimate is not None
    assert estimate.dense_mib == pytest.approx(stored / 2**20)


def test_a_dense_matrix_in_sparse_storage_is_taken_for_a_dense_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was solved in the sparse form, which refuses it."""
    monkeypatch.setattr(user_matrices, "SMALL", 10)
    monkeypatch.setattr(form_choice, "SMALL_MIB", 0.0)
    K, A = sp.csc_array(12 * np.eye(12) + 1), sp.csc_array(np.eye(12, 1))
    given: dict[str, Any] = {"K": K, "A": A, "f": np.ones(12), "g": np.ones(1)}
    matrix_files.write(tmp_path / "own.npz", given)
    for scene in (read_scene(str(tmp_path / "own.npz")), own_matrices(**given)):
        assert chosen_form(scene, FORMS, None).form == "dual"


def machine_of(mib: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (form_choice, validate):
        monkeypatch.setattr(module, "physical_memory_mib", lambda: mib)


@pytest.mark.parametrize("form", ["dual", "primal", "sparse"])
def test_each_form_is_refused_by_what_it_needs(form: Form, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = read_scene("scaling/100352")
    machine_of(24_000, monkeypatch)
    if form == "sparse":
        refuse_what_cannot_fit(scene, size_of(scene), form)
    else:
        with pytest.raises(InputError, match=r"the sparse form \(--form sparse\) needs 4\d{3}"):
            refuse_what_cannot_fit(scene, size_of(scene), form)
    machine_of(2_000, monkeypatch)
    with pytest.raises(InputError, match=r"fewer nodes: a \w+ form needs .* this machine has 2000"):
        refuse_what_cannot_fit(scene, size_of(scene), form)


def test_a_wide_band_is_not_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a square grid a fill-reducing order needs far less than the band."""
    scene = read_scene("scaling/100352")
    joint = scene.joint.model_copy(
        update={"junction": scene.joint.junction.model_copy(update={"nodes": (1500, 1500)})}
    )
    estimate = size_of(replace(scene, joint=joint))
    assert estimate is not None
    assert estimate.half_bandwidth is not None
    assert estimate.half_bandwidth > 5000
    assert estimate.sparse_mib < 0.2 * 8 * estimate.unknowns * estimate.half_bandwidth / 2**20


@pytest.mark.parametrize(
    ("scene", "taken", "cases", "cached", "mib", "form"),
    [
        (LARGE, FORMS, 1, False, 1 << 20, "sparse"),
        (LARGE, DENSE, 1, False, 1 << 20, "dual"),
        (LARGE, ("primal",), 1, False, 1 << 20, "primal"),
        (LARGE, ("sparse",), 1, True, 1 << 20, "sparse"),
        (LARGE, FORMS, 1, True, 1 << 20, "dual"),
        (LARGE, FORMS, 100, False, 1 << 20, "dual"),
        (LARGE, FORMS, 2, False, 1 << 20, "sparse"),
        (LARGE, FORMS, 100, True, 1000, "sparse"),
        (SMALL, FORMS, 1, False, 1 << 20, "dual"),
    ],
)
def test_the_rule(
    scene: Any, taken: Any, cases: int, cached: bool, mib: int, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(JointModel, "built", cached)
    machine_of(mib, monkeypatch)
    choice = chosen_form(scene, taken, None, cases)
    assert choice.form == form
    assert bool(choice.why) == (form == "sparse" and taken == FORMS)


@pytest.mark.parametrize(("taken", "asked"), [(DENSE, None), (FORMS, "dual"), (DENSE, "sparse")])
def test_a_form_that_does_not_fit_is_refused(taken: Any, asked: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    machine_of(1000, monkeypatch)
    with pytest.raises(InputError, match="--form sparse" if asked != "sparse" else "the solver takes"):
        chosen_form(LARGE, taken, asked)
