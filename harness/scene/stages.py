"""The answer at the end of a stage."""

from dataclasses import dataclass, replace

from harness.verification.judge import Judgement
from problems.forms.assembly import Vector
from problems.model.effect import SpringEffect
from problems.model.fastener_forces import fastener_forces
from problems.model.scene import JointScene


@dataclass(frozen=True)
class StageAnswer:
    """The answer at the end of a stage.

    Parameters
    ----------
    name : str
        Its name.
    scene : JointScene
        What acts at its end, with the approaches that are locked: a scene of its own, without stages.
    x : array (n,), mm
        Displacements.
    lam : array (m,), N
        Contact forces.
    gap : array (m,), mm
        Remaining gaps.
    judgement : Judgement
        The judge's figures; `cannot_be_judged` where `gap_error_mm` is infinite as below.
    error_bound_mm : float
        Proven bound on max|x − x*|, mm, for the exact answer x* at the approaches that are locked.
    gap_error_mm : array (m,), mm
        How far each gap is at most from that of x*; infinite if fasteners have locked in a stage whose answer
        is not proven to within 1e-7 mm.
    """

    name: str
    scene: JointScene
    x: Vector
    lam: Vector
    gap: Vector
    judgement: Judgement
    error_bound_mm: float
    gap_error_mm: Vector

    @property
    def forces(self) -> dict[str, float]:
        """The sum of the forces in fasteners, by the name or kind of the effect, and in "contacts"; N.

        A force counts once at each place, whatever contacts it presses; a spring in each contact.
        NaN in "contacts" if the forces there are not known.
        """
        sums: dict[str, float] = {}
        for effect in self.scene.effects:
            name, alone = effect.name or effect.kind, replace(self.scene, effects=(effect,))
            forces = [fastener["force_N"] for fastener in fastener_forces(alone, self.x)]
            if not isinstance(effect, SpringEffect):
                forces = forces[: effect.element_count(self.scene.joint)]
            if forces:
                sums[name] = sums.get(name, 0.0) + sum(forces)
        return sums | {"contacts": float(self.lam.sum())}
