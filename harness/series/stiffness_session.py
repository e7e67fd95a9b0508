"""The session of stages with the same K, whose load cases Newton's method solves in sweeps."""

from harness.verification.assess import GapError
from harness.verification.reference import proof_of
from problems.build import prepared
from problems.forms import Form
from problems.model.scene import JointScene
from solvers.algorithms.newton_sweeps import Sweeps


class StiffnessSession:
    """The matrices and proof that stages with the same K share. scene : one of these stages."""

    def __init__(self, scene: JointScene, form: Form) -> None:
        self.scene, self.form = scene, form
        self.data = prepared(scene, form=form)
        self.sweeps = Sweeps(self.data)
        self.proof, self.gap_error = proof_of(self.data), GapError.of(self.data.assembly)
