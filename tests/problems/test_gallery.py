"""The gallery: for each scene a number of independent origin: beam or plate theory, statics, symmetry."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp
from numpy.typing import NDArray
from small_problems import solve_by_nnls

from harness.scene.solution import solve
from harness.verification.reference import reference
from problems.build import load_case, prepared
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.model.joint import Joint
from problems.model.scene import JointScene
from problems.scene_files import Scene, read_scene, scene_names
from problems.stiffness.operator import Stiffness

GALLERY = [name for name in scene_names() if name.startswith("gallery/")]
Array = NDArray[np.float64]
G = 9.80665  # m/s²


def opened(name: str) -> tuple[Scene, Joint, Prepared, LoadCase]:
    scene = read_scene(f"gallery/{name}")
    assert scene.joint is not None
    data = prepared(scene)
    return scene, scene.joint, data, load_case(scene)


def solved(name: str) -> tuple[Joint, Array, Array]:
    """Displacements and contact forces."""
    _, joint, data, load = opened(name)
    found = reference(data, load)
    assert found.bound_mm < 1e-9
    return joint, found.x, found.lam


def along(joint: Joint, field: Array) -> Array:
    """The field on the line in the middle of the junction along y."""
    nx, ny = joint.junction.nodes
    return field.reshape(ny, nx)[:, nx // 2]


def test_heavy_sheet_on_tool() -> None:
    """Clamped strip, lift-off length a = (72 EI g/q)^¼ at each end, reaction q (L − 2a) + 2qa/3."""
    joint, _, lam = solved("heavy-sheet-on-tool")
    q, EI, L, gap = 2700e-9 * G * 2.0, 70e3 * 2.0**3 / 12, 2000.0, 0.5
    a = (72 * EI * gap / q) ** 0.25
    assert lam.sum() == pytest.approx(100.0 * (q * (L - 2 * a) + 2 * q * a / 3), rel=2e-3)
    closed = joint.y[along(joint, lam) > 0]
    assert closed.min() == pytest.approx(a - 200.0, abs=25.0)  # a node spacing


def test_plate_on_frame() -> None:
    """Simply supported square plate: 0.00406235 q a⁴/D in the middle."""
    joint, x, lam = solved("plate-on-frame")
    D = 70e3 * 5.0**3 / (12 * (1 - 0.3**2))
    w = 0.00406235 * 2700e-9 * G * 5.0 * 1000.0**4 / D
    assert not lam.any()
    assert along(joint, x)[8] == pytest.approx(w, rel=2e-3)


def test_warm_panel() -> None:
    """Curvature −αΔT/t of a free plate; the sag between two supports 1200 mm apart is κ 1200²/8."""
    joint, x, lam = solved("warm-panel")
    kappa = 23e-6 * 5.0 / 4.0
    assert lam.size == 0
    edge = x[: joint.junction.nodes[0]]
    assert edge[12] == pytest.approx(kappa * 1200.0**2 / 8, rel=1e-7)
    np.testing.assert_allclose(np.diff(edge, 2), -kappa * 50.0**2, rtol=1e-6)


def test_spring_back() -> None:
    """Built-in strips, pressed together at the middle by P, held at both quarters once P is gone.

    Deflections in L³/EI: 1/192 and 1/384 at the middle and the quarters of P there, 5/1536 at a quarter of
    forces at both. The rivets hold P/384 with 4/5 P each, and the middle goes back from 1/192 to 4/5 of that.
    """
    answer = solve("gallery/spring-back")
    joint, (tacked, riveted, released) = answer.scene.joint, answer.stages  # type: ignore[attr-defined]
    f = sum(400.0**3 / (70e3 * 60.0 * t**3 / 12) for t in (2.0, 4.0))
    held = 1.0 * 192 / 384 / (5 / 1536 * f + 1 / 5e5)  # five rivets of 1e5 N/mm each in a row
    opened = 1.0 - held * f / 192
    middle = joint.nodes[:, 1] == 100.0
    assert tacked.gap[middle].max() < 1e-9
    assert tacked.forces["contacts"] == pytest.approx(20.0 - 192 / f, rel=2e-3)
    assert riveted.forces["rivets"] == pytest.approx(0.0, abs=1e-6)
    assert released.gap[middle] == pytest.approx(opened, rel=1e-3)
    assert opened == pytest.approx(0.2, rel=1e-3)
    assert released.forces["rivets"] == pytest.approx(2 * held, rel=1e-3)


@pytest.mark.parametrize(("name", "largest"), [("outwards", 0.00849), ("from-one-end", 0.109)])
def test_riveted(name: str, largest: float) -> None:
    """Rivet after rivet by another solver: what it finds at t is the approach a of f = k a t from then on."""
    scene = read_scene(f"gallery/riveted-{name}")
    assert isinstance(scene, JointScene)
    plain = replace(scene, effects=scene.effects[:1], stages=())
    data, g = prepared(plain), load_case(plain).g
    K, A = sla.block_diag(*data.assembly.K.matrices), data.assembly.A
    weights = sp.csr_array(scene.joint.weights(scene.effects[2].marks(scene.joint)))  # type: ignore[attr-defined]
    f = np.zeros(len(K))
    for t in sp.hstack([weights, -weights]).toarray():
        x, _ = solve_by_nnls(Prepared(Assembly(Stiffness.of(K), A)), LoadCase(f + 30.0 * t, g))
        K, f = K + 1e5 * np.outer(t, t), f + 1e5 * (t @ x) * t
    x, _ = solve_by_nnls(Prepared(Assembly(Stiffness.of(K), A)), LoadCase(f, g))
    answer = solve(scene)
    np.testing.assert_allclose(answer.x, x, atol=1e-7)
    assert answer.gap.max() == pytest.approx(largest, rel=2e-3)


def test_shimmed_strip() -> None:
    """Built in at both ends, moved by d = 1 − 0.6 mm in the middle: 192 EI d/L³ of the clamps' 80 N bend it,
    the shim bears the rest; at the quarters it moves by d/2.
    """
    answer = solve("gallery/shimmed-strip")
    bending = 192 * 70e3 * 60.0 * 4.0**3 / 12 * 0.4 / 400.0**3
    assert answer.lam.sum() == pytest.approx(80.0 - bending, rel=2e-3)
    gap = answer.gap.reshape(21, 3)
    np.testing.assert_allclose(gap[[0, -1]], 1.0 - 0.2, rtol=1e-3)
    assert abs(gap[10]).max() < 1e-9


def test_shifted_support() -> None:
    """Pure twist w = c x y: each corner bears 2 D (1 − ν) c, and c a b = shift − 4 R/k."""
    _, x, lam = solved("shifted-support")
    D = 70e3 * 6.0**3 / (12 * (1 - 0.33**2))
    twist = 2 * D * (1 - 0.33)
    c = 2.0 / (800.0 * 500.0 + 4 * twist / 100.0)
    assert lam.size == 0
    corners = x[[0, 16, 170, 186]]
    shifts = np.array([0.0, 0.0, 0.0, 2.0])
    np.testing.assert_allclose(100.0 * (shifts - corners), twist * c * np.array([1, -1, -1, 1]), rtol=1e-8)


def test_sheet_over_former() -> None:
    """It lies on the former up to s, where the moment P (500 − s) has fallen to EI κ, then leaves it:
    w = κs²/2 + κsc + Pc³/3EI at the tip, c = 500 − s, and the former bears P at s."""
    joint, x, lam = solved("sheet-over-former")
    P, EI, kappa = 4 * 4.0, 70e3 * 60.0 * 4.0**3 / 12, 1e-4
    c = EI * kappa / P
    s = 500.0 - c
    assert 50 < s < 450
    tip = kappa * s**2 / 2 + kappa * s * c + P * c**3 / (3 * EI)
    assert along(joint, x)[-1] == pytest.approx(tip, rel=1e-3)
    forces = lam.reshape(51, 3).sum(axis=1)
    beyond_clamp = joint.y > 50.0
    assert forces[beyond_clamp].sum() == pytest.approx(P, rel=1e-2)
    assert np.average(joint.y[beyond_clamp], weights=forces[beyond_clamp]) == pytest.approx(s, abs=10.0)


def test_measured_gap() -> None:
    """Two equal parts with the gap 2g are one part on an obstacle at g, node for node."""
    _, joint, _, load = opened("measured-gap")
    half = joint.model_copy(update={"part": joint.part[:1], "contacts": (("upper", "tool"),)})
    one = prepared(JointScene("half", "half", half))
    n = half.size[0]
    x, _ = solve_by_nnls(one, LoadCase(load.f[:n], load.g / 2))
    _, both, lam = solved("measured-gap")
    assert 20 < (lam > 0).sum() < 300
    np.testing.assert_allclose(both[:n], x, atol=1e-8)
    np.testing.assert_allclose(both[n:], -x, atol=1e-8)


def test_three_part_stack() -> None:
    """By symmetry the middle plate stays where it is, and each skin is a skin on a rigid tool."""
    _, joint, _, load = opened("three-part-stack")
    skin = joint.model_copy(update={"part": joint.part[:1], "contacts": (("upper", "tool"),)})
    n = skin.size[0]
    x, force = solve_by_nnls(prepared(JointScene("skin", "skin", skin)), LoadCase(load.f[:n], load.g[:n]))
    _, stack, lam = solved("three-part-stack")
    assert set(np.round(load.g, 12)) == {0.3, 0.8}
    assert (force > 0).sum() > 10
    np.testing.assert_allclose(stack[:n], x, atol=1e-9)
    np.testing.assert_allclose(stack[n : 2 * n], 0.0, atol=1e-9)
    np.testing.assert_allclose(stack[2 * n :], -x, atol=1e-9)
    np.testing.assert_allclose(lam[:n], lam[n:], atol=1e-5)


def test_installed_fasteners() -> None:
    """Cantilevers of compliance c = L³/3EI each: the springs, k in all, pull with k d / (1 + 2 c k)."""
    _, x, lam = solved("installed-fasteners")
    c = 400.0**3 / (3 * 70e3 * 20.0 * 10.0**3 / 12)
    k, d = 2 * 5.0, 0.5
    assert not lam.any()
    tips = x[[48, 50]], x[[99, 101]]
    np.testing.assert_allclose(tips[0], c * k * d / (1 + 2 * c * k), rtol=1e-3)
    np.testing.assert_allclose(tips[1], -tips[0], rtol=1e-9)


def test_padded_panel() -> None:
    """The supports bear the weight of sheet and pad, and its moment."""
    _, x, lam = solved("padded-panel")
    sheet, pad = (2780e-9 * G * volume for volume in (1000.0 * 700.0 * 3.0, 500.0 * 200.0 * 6.0))
    assert lam.size == 0
    reactions = 500.0 * x[[0, 32, 264, 296]]
    # The rounding of K's entries acts like springs to the ground: Σ ε|K||x| is 7e-8 of the weight.
    assert reactions.sum() == pytest.approx(sheet + pad, rel=7e-8)
    far = reactions[2:].sum()
    assert far * 200.0 == pytest.approx(sheet * -150.0 + pad * 100.0, rel=7e-8)
