"""A beam on an elastic foundation that only pushes: pressed in, and lifted, against the closed forms.

The foundation is Winkler's: springs of stiffness k per length, to which the beam is not tied. With the
deflection w downwards, the weight q per length and β⁴ = k/4EI,

    EI w'''' + k w = q   where w > 0        EI w'''' = q   elsewhere,

and at an edge of the contact w = 0, with w', w'' and w''' continuous. The beam is held at its middle x = 0,
w'(0) = 0, at a given w(0); half of it is computed.

Pressed, without weight, by a force P: the contact reaches to a = π/2β, whatever P is (Y. Weitsman, J. Appl.
Mech. 37:1019–1030, 1970). For with ξ = a − x, w = θ(sinh βξ cos βξ + cosh βξ sin βξ)/2β, whose slope is zero
at βξ = π/2; so w(0) = coth(π/2) Pβ/2k, M(0) = coth(π/2) P/4β, and beyond the edge w = −θ(x − a) with
θ = P/(4EIβ² sinh(π/2)).

Lifted, long and heavy: off the foundation up to x = c. There w is a polynomial of order four, and beyond it
w = q/k + e^(−βs)(B sin βs − q/k cos βs), s = x − c. The conditions at the edge make P a rational function of
βc; c = 1/β belongs to w(0) = −8q/9k, P = 17q/6β and M(0) = −5q/6β².
"""

from dataclasses import dataclass

import numpy as np
import pytest
import scipy.sparse as sp

from harness import own_matrices, solve
from problems.scene_files import Scene

EI, BED, WEIGHT = 3.5e8, 0.01, 0.0154  # N mm², N/mm², N/mm: a steel bar of 20 mm × 10 mm on foam
BETA = (BED / (4 * EI)) ** 0.25  # 1/mm
DOWN, UP = 2.0, 8 * WEIGHT / (9 * BED)  # mm, of the middle

PRESSED_LENGTH, LIFTED_LENGTH = 2.5, 8.0  # in units of 1/β; at 8 the field of the edge is at e^(−7)
ELEMENTS = (6, 12, 24)  # along 1/β


@dataclass(frozen=True)
class Half:
    """Of a beam: the places of its nodes, mm, the deflection there, mm, and the forces of the springs, N."""

    x: np.ndarray
    w: np.ndarray
    lam: np.ndarray

    @property
    def edge(self) -> float:
        """Where w changes its sign, by the straight line between two nodes."""
        (k,) = np.flatnonzero(np.diff(self.w > 0))
        return float(self.x[k] - self.w[k] * (self.x[k + 1] - self.x[k]) / (self.w[k + 1] - self.w[k]))


def scene_of(elements: int, length: float, middle: float, q: float = 0.0) -> Scene:
    """Cubic elements, u = w − w(0); a spring per node, of stiffness kh, or kh/2 at both ends.

    A contact between each node and its spring: w(0) + u − s ≤ 0, s being how far the spring is pressed in.
    """
    h = length / elements
    one = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2]])
    one = np.vstack([one, -one[0], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]) * EI / h**3
    load = q * h * np.array([1 / 2, h / 12, 1 / 2, -h / 12])
    K, f = np.zeros((2 * elements + 2,) * 2), np.zeros(2 * elements + 2)
    for start in range(0, 2 * elements, 2):
        K[start : start + 4, start : start + 4] += one
        f[start : start + 4] += load
    beds = np.full(elements + 1, BED * h)
    beds[[0, -1]] /= 2
    rows = sp.eye_array(2 * elements + 2, format="csc")[:, ::2]
    return own_matrices(
        sp.block_diag([K[2:, 2:], np.diag(beds)], format="csc"),
        sp.vstack([rows[2:], -sp.eye_array(elements + 1)], format="csc"),
        np.concatenate([f[2:], np.zeros(elements + 1)]),
        np.full(elements + 1, -middle),
    )


def half_beam(elements: int, length: float, middle: float, q: float = 0.0) -> Half:
    """The deflection by newton, proven."""
    answer = solve(scene_of(elements, length, middle, q), "newton", tolerance=1e-11)
    assert answer.status == "solved"
    assert answer.error_bound_mm < 1e-8
    u = np.append(0.0, answer.x[: 2 * elements : 2])
    return Half(np.linspace(0, length, elements + 1), middle + u, answer.lam)


def pressed(elements: int, down: float = DOWN) -> Half:
    return half_beam(round(PRESSED_LENGTH * elements), PRESSED_LENGTH / BETA, down)


def lifted(elements: int) -> Half:
    return half_beam(round(LIFTED_LENGTH * elements), LIFTED_LENGTH / BETA, -UP, WEIGHT)


def test_the_pressed_beam_converges_to_its_closed_form() -> None:
    force = 2 * BED * DOWN * np.tanh(np.pi / 2) / BETA
    edge = np.pi / (2 * BETA)
    slope = force / (4 * EI * BETA**2 * np.sinh(np.pi / 2))
    exact = {
        "edge": edge,
        "force": force,
        "moment": force / (4 * BETA * np.tanh(np.pi / 2)),
        "free end": -slope * (PRESSED_LENGTH / BETA - edge),
    }
    beams = [pressed(elements) for elements in ELEMENTS]
    computed = [
        {"edge": beam.edge, "force": 2 * beam.lam.sum(), "moment": beam.lam @ beam.x, "free end": beam.w[-1]}
        for beam in beams
    ]
    check(computed, exact)


def test_the_lifted_beam_converges_to_its_closed_form() -> None:
    exact = {"edge": 1 / BETA, "force": 17 * WEIGHT / (6 * BETA), "moment": 5 * WEIGHT / (6 * BETA**2)}
    length = LIFTED_LENGTH / BETA
    beams = [lifted(elements) for elements in ELEMENTS]
    computed = [
        {
            "edge": beam.edge,
            "force": 2 * (WEIGHT * length - beam.lam.sum()),
            "moment": WEIGHT * length**2 / 2 - beam.lam @ beam.x,
        }
        for beam in beams
    ]
    check(computed, exact)


def check(computed: list[dict[str, float]], exact: dict[str, float]) -> None:
    """Four times the elements leave a sixteenth of the error, about, as order 2 does."""
    for name, value in exact.items():
        errors = [abs(each[name] / value - 1) for each in computed]
        assert errors == sorted(errors, reverse=True), name
        assert errors[-1] < errors[0] / 12, name
        assert errors[-1] < 3e-4, name


def test_the_contact_is_as_long_under_any_force() -> None:
    one, ten = pressed(ELEMENTS[0]), pressed(ELEMENTS[0], 10 * DOWN)
    assert one.edge == pytest.approx(ten.edge, rel=1e-9)
    assert 10 * one.lam == pytest.approx(ten.lam, rel=1e-9)


@pytest.mark.parametrize("name", ["newton", "mprgp"])
@pytest.mark.parametrize("elements", [ELEMENTS[-1], 2 * ELEMENTS[-1]])
def test_what_rounding_takes_is_not_called_solved(name: str, elements: int) -> None:
    """cond(K) is 7e9 and 1e11: x by K's factors alone can be more than 1e-7 mm off."""
    scene = scene_of(round(LIFTED_LENGTH * elements), LIFTED_LENGTH / BETA, -UP, WEIGHT)
    exact = solve(scene, "newton", form="dual", tolerance=1e-11)
    answer = solve(scene, name, form="sparse", tolerance=1e-11)
    assert exact.error_bound_mm < 1e-8
    assert answer.status == "inaccurate" or abs(answer.x - exact.x).max() <= 1e-7
