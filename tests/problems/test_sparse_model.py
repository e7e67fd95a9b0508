"""The uncondensed model against the condensed one, whose code for K, loads and springs is another; both made
once.
"""

import gc
import weakref
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from commands import harness
from effect_tables import TABLES, scene_of
from scipy.sparse.linalg import splu
from small_joints import make_joint, make_scene

from problems import scene_files as reading
from problems.build import load_case, model_of, prepared
from problems.effects.installed_fasteners import InstalledFasteners
from problems.effects.self_weight import SelfWeight
from problems.forms import Form
from problems.forms.assembly import Assembly, Matrix
from problems.model.condensation import NotPositiveDefinite, condense
from problems.model.effect import GapEffect
from problems.model.effect_tables import effect_class
from problems.model.joint_model import JointModel
from problems.model.scene import JointScene
from problems.scene_files import read_scene, scene_names
from problems.stiffness.band_factor import half_bandwidth

GALLERY = [name for name in scene_names() if name.startswith("gallery/")]
END = {"length": 90.0, "elements": 2}
HELD = {"north": END, "clamped": ["north"]}


def condensed(model: Assembly, V: Matrix) -> Matrix:
    """SV, V (n, k), S the Schur complement of K̂ on the junction: the other unknowns go by SuperLU."""
    K = sp.csc_array(sp.block_diag(model.K.matrices))
    inner = np.setdiff1d(np.arange(model.n), model.junction)
    K_jj, K_ij = K[model.junction][:, model.junction], sp.csc_array(K[inner][:, model.junction])
    eliminated: Matrix = K_jj @ V - K_ij.T @ splu(sp.csc_array(K[inner][:, inner])).solve(K_ij @ V)
    return eliminated


def check_same(scene: JointScene) -> None:
    """K, A, p, Qv and K⁻¹f of both."""
    dense, whole = prepared(scene), prepared(scene, form="sparse")
    assert not whole.assembly.K.dense
    case, load = load_case(scene), load_case(scene, "sparse")
    random, model, K = np.random.default_rng(1), whole.assembly, sp.block_diag(dense.assembly.K.matrices)
    junction = model.junction
    assert (model.junction_size, model.m) == (dense.assembly.n, dense.assembly.m)
    assert not any((block != block.T).nnz for block in model.K.matrices)  # to the last bit: proofs rely on it
    V = np.eye(model.junction_size) if model.n < 3000 else random.standard_normal((model.junction_size, 9))
    np.testing.assert_allclose(condensed(model, V), K @ V, rtol=0, atol=1e-9 * abs(K).max())
    np.testing.assert_array_equal(model.at_junction(model.A.toarray()), dense.assembly.A.toarray())
    assert abs(model.A).sum() == abs(dense.assembly.A).sum()
    np.testing.assert_array_equal(load.g, case.g)
    force = random.standard_normal(dense.assembly.n)
    whole_force = np.zeros(model.n)
    whole_force[junction] = force
    lam = random.standard_normal(model.m)
    for value, expected in (
        (model.at_junction(whole.assembly.K.solve(load.f)), dense.assembly.K.solve(case.f)),
        (model.at_junction(whole.assembly.K.solve(whole_force)), dense.assembly.K.solve(force)),
        (whole.overlap(load), dense.overlap(case)),
        (whole.compliance @ lam, dense.Q @ lam),
    ):
        np.testing.assert_allclose(value, expected, rtol=0, atol=2e-9 * abs(expected).max(initial=0.0))


@pytest.mark.parametrize("kind", sorted(TABLES))
def test_every_effect(kind: str, tmp_path: Path) -> None:
    scene = read_scene(str(scene_of(tmp_path, *{kind, "supports"} if kind == "support_shift" else {kind})))
    check_same(scene)
    without = replace(scene, effects=())
    if not isinstance(scene.effects[-1], GapEffect):
        K, f = (prepared(scene, form="sparse").assembly.K.matrices, load_case(scene, "sparse").f)
        K0, f0 = (prepared(without, form="sparse").assembly.K.matrices, load_case(without, "sparse").f)
        assert len(K) != len(K0) or (f != f0).any() or any((a != b).nnz for a, b in zip(K, K0, strict=True))


def test_springs_past_a_part_in_between_and_loads_beyond_the_junction() -> None:
    """The first and the third of three parts are one block, the second another: blocks out of order."""
    parts = [HELD | {"name": name, "thickness": 3.0 + k, "south": END} for k, name in enumerate("abc")]
    pairs = [("a", "b"), ("b", "c"), ("a", "c")]
    scene = make_scene(
        make_joint(*parts, contacts=pairs, nodes=(6, 4)),
        InstalledFasteners.model_validate(
            {"kind": "installed_fasteners", "between": ["a", "c"], "points": [[10.0, 10.0], [300.0, 90.0]]}
        ),
        SelfWeight.model_validate({"kind": "self_weight", "part": "c"}),
    )
    check_same(scene)
    assert prepared(scene, form="sparse").assembly.parts == ("a + c", "b")
    f = load_case(scene, "sparse").f
    beyond = np.delete(f, JointModel.of(scene).junction)
    assert np.count_nonzero(beyond) > len(beyond) / 4


@pytest.mark.parametrize("name", GALLERY)
def test_the_numbering_is_narrow(name: str) -> None:
    """The band is that of a line of nodes, and two nodes, across."""
    model = JointModel.of(read_scene(name))
    for parts, K in zip(model.springs.groups, model.assembly().K.matrices, strict=True):
        along = sum(len(model.parts[part].plate.x) for part in parts)
        across = sum(len(model.parts[part].free_lines) for part in parts)
        assert half_bandwidth(K) <= 4 * (min(along, across) + 2) - 1


SHORT, LONG = {"length": 90.0, "elements": 2}, {"length": 250.0, "elements": 4}
SHAPES: list[dict[str, Any]] = [
    {"south": SHORT, "clamped": ["south"]},
    {"south": LONG, "north": SHORT, "clamped": ["north"]},
    {"south": SHORT, "north": LONG, "clamped": ["south", "north"]},
    {"south": LONG},
    {},
]


@pytest.mark.parametrize("part", SHAPES, ids=str)
def test_parts_of_any_shape(part: dict[str, Any]) -> None:
    points = [(30.0, 20.0), (350.0, 35.0), (170.0, 110.0), (399.0, 3.0)]
    tables = {
        "supports": {"points": points, "stiffness_per_point": 4e3},
        "stringers": {"pitch": 130.0, "start": -50.0, "stop": 95.0, "I": 2e4, "J": 3e3},
        "local_thickness": {"thickness": 8.0, "x": (11.0, 120.0), "y": (30.0, 101.0)},
        "thermal_bending": {"difference": 12.0},
        "self_weight": {},
        **({"ribs": {"lines": (-15.0,), "I": 1e5, "J": 1e4}} if "south" in part else {}),
    }
    effects = [
        effect_class(kind).model_validate({"kind": kind, "part": "a"} | table)
        for kind, table in tables.items()
    ]
    check_same(make_scene(make_joint(part, contacts=[("a", "tool")]), *effects))


def test_a_motion_without_energy_is_refused() -> None:
    spring = np.array([[1.0, -1.0], [-1.0, 1.0]])
    K = sp.csr_array(sp.block_diag([spring, np.eye(2)]))
    with pytest.raises(NotPositiveDefinite):
        condense(K, [np.array([0, 1]), np.array([2, 3])], np.array([False, False, False, True]))


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("form", ["dual", "primal", "sparse"])
def test_one_solve_makes_one_model_and_reads_its_scene_once(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, read = [], []
    of, toml = JointModel.of.__func__, reading.read_toml  # type: ignore[attr-defined]

    def counted(cls: Any, scene: Any) -> Any:
        made.append(scene)
        return of(cls, scene)

    def counted_read(path: Path) -> Any:
        read.append(path)
        return toml(path)

    monkeypatch.setattr(JointModel, "of", classmethod(counted))
    monkeypatch.setattr(reading, "read_toml", counted_read)
    path = scene_of(tmp_path, "initial_gap", "pressure", "self_weight")
    done = harness("solve", path, "--form", form, "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    grids = [scene.joint.junction.nodes for scene in made]
    assert (len(set(grids)), len(grids), read) == (2, 2, [path])  # one, and one for the error of the grid


def test_load_cases_of_some_effects_add_up_to_that_of_all() -> None:
    weight = SelfWeight(kind="self_weight", part="a")
    tie = InstalledFasteners(kind="installed_fasteners", points=((200.0, 40.0),), approach=0.5)
    scene = make_scene(make_joint(HELD, HELD | {"name": "b"}), weight, tie)
    for form in ("dual", "sparse"):
        whole = load_case(scene, form)
        alone = [load_case(scene, form, [effect]) for effect in (weight, tie)]
        assert abs(whole.f).max() > 0
        assert abs(whole.f - sum(each.f for each in alone)).max() <= 1e-12 * abs(whole.f).max()
    assert model_of(scene) is model_of(scene)
    assert prepared(scene).assembly.parts == prepared(scene, form="sparse").assembly.parts == ("a + b",)


@pytest.mark.parametrize("form", ["sparse", "dual"])
def test_factors_go_with_the_last_that_needs_them(form: Form) -> None:
    """Without the garbage collector: gigabytes would wait for it in a cycle."""
    data = prepared(read_scene("scaling/1170"), form=form)
    data.assembly.K.ensure_factored()
    _ = data.approximate_inverse
    K = weakref.ref(data.assembly.K)
    gc.disable()
    try:
        del data
        assert K() is None
    finally:
        gc.enable()
