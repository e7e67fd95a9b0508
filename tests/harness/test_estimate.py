"""The estimates of a scene's size, memory and time, before anything is built."""

from dataclasses import replace

import pytest
from commands import harness

from harness.planning import estimate as estimates
from harness.planning.estimate import estimated_sparse, refuse_what_cannot_fit
from harness.scene import validate
from problems.build import prepared
from problems.errors import InputError
from problems.forms.names import Form
from problems.scene import read_scene
from problems.stiffness.banded import half_bandwidth

GALLERY = ("three-part-stack", "installed-fasteners", "sheet-over-former", "plate-on-frame", "padded-panel")


@pytest.mark.parametrize("name", GALLERY)
def test_the_sparse_forms_unknowns_bands_and_factors_are_known_before_they_are_made(name: str) -> None:
    scene = read_scene(f"gallery/{name}")
    estimate = estimated_sparse(scene, 1e9)
    data = prepared(scene, form="sparse")
    assert not data.assembly.K.dense
    assert (estimate.n, estimate.m) == (data.assembly.asked, data.assembly.m)
    assert estimate.unknowns == data.assembly.n
    assert estimate.half_bandwidth == max(map(half_bandwidth, data.assembly.K.matrices))
    stored = 8 * data.assembly.K.numbers
    assert estimate.stored_mib == pytest.approx(stored / 2**20)


def test_the_time_of_arithmetic_follows_the_machine() -> None:
    scene = read_scene("4386/0107")
    fast, slow = estimated_sparse(scene, 1e10), estimated_sparse(scene, 1e9)
    assert slow.answer_s == pytest.approx(10 * fast.answer_s)
    assert fast.build_s < slow.build_s < 10 * fast.build_s


def machine_of(mib: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (estimates, validate):
        monkeypatch.setattr(module, "physical_memory_mib", lambda: mib)


def test_validate_offers_the_sparse_form_where_no_dense_one_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    machine_of(24_000, monkeypatch)
    done = harness("validate", "scaling/100352")
    said = " ".join(done.output.split())
    assert done.exit_code == 0
    assert "No dense form can hold it: the process would take up to 134606 MiB" in said
    assert "--form sparse" in said
    assert "634880 unknowns, half-bandwidth 395" in said
    assert "Dense forms" not in said


def test_validate_gives_both_where_both_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    machine_of(24_000, monkeypatch)
    said = harness("validate", "4386/0107").output
    assert "Dense forms" in said
    assert "Sparse form" in said


@pytest.mark.parametrize("form", ["dual", "primal", "sparse"])
def test_each_form_is_refused_by_what_it_needs(form: Form, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = read_scene("scaling/100352")
    machine_of(24_000, monkeypatch)
    if form == "sparse":
        refuse_what_cannot_fit(scene, "here", form)
    else:
        with pytest.raises(
            InputError, match=r"or the sparse form \(--form sparse\), which takes about 4\d{3} MiB"
        ):
            refuse_what_cannot_fit(scene, "here", form)
    machine_of(2_000, monkeypatch)
    with pytest.raises(InputError, match=r"fewer nodes: 4\d{3} MiB are needed, this machine has 2000"):
        refuse_what_cannot_fit(scene, "here", form)


def test_a_wide_band_is_not_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a square grid a fill-reducing order needs far less than the band."""
    scene = read_scene("scaling/100352")
    joint = scene.joint.model_copy(
        update={"junction": scene.joint.junction.model_copy(update={"nodes": (1500, 1500)})}
    )
    estimate = estimated_sparse(replace(scene, joint=joint), 1e9)
    assert estimate.half_bandwidth > 5000
    assert estimate.stored_mib < 0.2 * 8 * estimate.unknowns * estimate.half_bandwidth / 2**20
