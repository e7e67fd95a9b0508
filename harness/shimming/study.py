"""What plans of shims do in each load case: gaps by patch, what liquid shim would fill, force and stress."""

from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Any

import numpy as np

from harness.placement.candidates import Place
from harness.placement.session import CaseAnswer, Study
from harness.scene.stress import largest_of
from problems.effects.shims import Shims
from problems.forms.assembly import Indices, Mask, Matrix, Vector
from problems.model.fastener_forces import fastener_forces, force_error
from problems.model.springs import Springs
from problems.storage import digest

from .patches import Patch


@dataclass(frozen=True)
class ShimStudy(Study):
    """An item is the number of a patch, and a thickness, mm, or one at each end of its longer side.

    patches : what a plan may fill. limits : of force, N, and stress, N/mm². ends : how many thicknesses a
    shim has, 1 or 2.
    """

    patches: tuple[Patch, ...]
    limits: tuple[float, float]
    ends: int = 1

    @property
    def identity(self) -> dict[str, Any]:
        """Also the recovery matrices by which superelements have stresses: no key of a scene has these."""
        parts = getattr(self.bare.joint, "parts", ()) if self.limits[1] < inf else ()
        tables = [
            (one.places, one.side, one.S.data, one.S.indices, one.S.indptr)
            for one in (part.recovery for part in parts)
        ]
        arrays = [array.tobytes() for some in tables for array in some]
        return super().identity | ({"stresses": digest(*arrays)} if arrays else {})

    def effect(self, item: Place) -> Shims:
        k, first, last = int(item[0]), item[1], item[-1]
        thickness = (first, last) if first != last else first
        return self.patches[k].shim.model_copy(update={"thickness": thickness})

    @cached_property
    def places(self) -> Matrix:
        """The places (m, 2) of the contacts, mm."""
        return np.concatenate([self.bare.joint.places(pair) for pair in self.bare.joint.pairs])

    @cached_property
    def masks(self) -> list[Mask]:
        """The contacts of each patch, and those of none."""
        inside = [patch.shim.gap(self.bare.joint) < 0 for patch in self.patches]
        return [*inside, ~np.any(inside, axis=0)]

    @cached_property
    def halves(self) -> list[Mask]:
        """The contacts that each thickness is for: those of its patch, or of the half at its end."""
        if self.ends == 1:
            return self.masks[:-1]
        along = [patch.shim.along(self.places) for patch in self.patches]
        pairs = zip(self.masks, along, strict=False)
        return [half for mask, at in pairs for half in (mask & (at <= 0.5), mask & (at >= 0.5))]

    @cached_property
    def near(self) -> Indices:
        """(patches, patches) the numbers of all patches, to each patch the nearest first."""
        middles = np.array([self.places[mask].mean(axis=0) for mask in self.masks[:-1]])
        distances = np.linalg.norm(middles[:, None] - middles, axis=2)
        return np.argsort(distances, axis=1, kind="stable")

    @cached_property
    def areas(self) -> Vector:
        """The tributary areas (m,) of the contacts, mm²."""
        joint = self.bare.joint
        return np.concatenate([joint.contact_areas(pair) for pair in joint.pairs])

    def further(self, answer: CaseAnswer) -> tuple[float, ...]:
        """The figures of a case, no less than they can be.

        The largest gap, mm, and ∫ gap, mm³, in each patch and beyond all; the largest gap of each of
        `halves`; force, N, and stress, N/mm², if they have a limit.
        """
        gap, session, force, stress = answer.gap, answer.session, 0.0, 0.0
        gaps, halves = (
            [float(gap[at].max(initial=0.0)) for at in some] for some in (self.masks, self.halves)
        )
        volumes = [float(np.maximum(gap[mask], 0.0) @ self.areas[mask]) for mask in self.masks]
        x = answer.x() if min(self.limits) < inf else np.zeros(0)
        if self.limits[0] < inf:
            scene, at = answer.scene, session.data.assembly.at_junction(x)
            force = max(abs(fastener["force_N"]) for fastener in fastener_forces(scene, at))
            force += force_error(Springs.of(scene), scene, at, answer.bound_mm)
        if self.limits[1] < inf:
            energy = session.proof.energy_error(answer.load, x, answer.lam) if answer.bound_mm else 0.0
            stress = largest_of(self.bare, x, energy, session.sensitivities)
        return *gaps, *volumes, *halves, force, stress
