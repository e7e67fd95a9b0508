"""What a stage of a scene has reached."""

from dataclasses import dataclass

from harness.verification.judge import Judgement
from problems.forms.assembly import Vector
from problems.model.scene import JointScene

from .fastener_forces import fastener_forces


@dataclass(frozen=True)
class StageAnswer:
    """What a stage has reached.

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
        The judge's figures.
    error_bound_mm : float
        Proven bound on max|x − x*|, mm, for the exact answer x* to `scene`.
    """

    name: str
    scene: JointScene
    x: Vector
    lam: Vector
    gap: Vector
    judgement: Judgement
    error_bound_mm: float

    @property
    def largest(self) -> int | None:
        """The contact with the largest gap; None without contacts."""
        return int(self.gap.argmax()) if len(self.gap) else None

    @property
    def forces(self) -> dict[str, float]:
        """The sum of the forces in all fasteners of a kind, and of the contact forces as "contacts"; N."""
        sums: dict[str, float] = {}
        for fastener in fastener_forces(self.scene, self.x):
            sums[fastener["kind"]] = sums.get(fastener["kind"], 0.0) + fastener["force_N"]
        return sums | {"contacts": float(self.lam.sum())}
