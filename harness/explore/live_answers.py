"""Answers a scene while its loads and gaps change: matrices are made once, each answer starts from the last.

The settings change effects of the scene: places and preload of its fasteners, the pressures, the mean of the
initial gap. The forces and gaps of an effect are kept as long as it stays the same.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from pydantic import ValidationError

from harness.placement.candidates import movable_fasteners
from harness.planning.form_choice import chosen_form
from harness.scene.scene_file import MOVED, of_kind, with_fasteners
from harness.scene.solution import Source, load_scene
from harness.verification.assess import GapError, assess
from harness.verification.judge import LIMIT_MM
from harness.verification.reference import proof_of
from problems.build import load_case, prepared
from problems.effects.fasteners import Fasteners
from problems.effects.initial_gap import InitialGap
from problems.effects.pressure import Pressure
from problems.errors import Fault, InputError
from problems.forms import FORMS, Form
from problems.forms.assembly import DualLoadCase, LoadCase, Vector
from problems.input.bounded_types import validation_faults
from problems.model.effect import Effect, StiffnessEffect
from problems.model.scene import JointScene, Scene
from solvers.algorithms.newton_sweeps import Sweeps
from solvers.base import DualStart

TOLERANCE_MM, PROVEN_MM = 1e-5, 1e-9  # of the first answer, and of the proven one
CHANGED = (*MOVED, "initial_gap", "pressure")
PAGE = "page"  # where a wrong value was given


@dataclass(frozen=True)
class Settings:
    """What may change of a scene while it is explored.

    Parameters
    ----------
    places : tuple of (float, float)
        Places (x, y) of the fasteners, mm.
    preload : float
        Preload of each fastener, N.
    means : tuple of float
        Means of the scene's initial gaps, in their order, mm.
    pressures : tuple of float
        The scene's pressures, in their order, N/mm².
    """

    places: tuple[tuple[float, float], ...]
    preload: float
    means: tuple[float, ...]
    pressures: tuple[float, ...]

    @classmethod
    def of(cls, scene: Scene) -> "Settings":
        """The settings of a scene. Raises InputError if it has no fasteners that can move."""
        fasteners = movable_fasteners(scene)
        assert isinstance(scene, JointScene)
        marks = np.concatenate([effect.marks(scene.joint) for effect in fasteners])
        means = tuple(effect.mean for effect in scene.effects_of(InitialGap))
        pressures = tuple(effect.value for effect in scene.effects_of(Pressure))
        places = tuple((x, y) for x, y in marks.tolist())
        return cls(places, fasteners[0].preload, means, pressures)

    def applied(self, scene: JointScene) -> tuple[Effect, ...]:
        """The scene's effects with these values. Raises InputError, as `validate` does."""
        means, pressures, faults, made = iter(self.means), iter(self.pressures), list[Fault](), list[Effect]()
        fasteners = False
        for effect in scene.effects:
            changes: dict[str, Any] = {}
            if isinstance(effect, Fasteners):
                if fasteners or not self.places:
                    continue
                fasteners, changes = True, {"points": self.places, "pattern": None, "preload": self.preload}
            elif isinstance(effect, InitialGap):
                changes = {"mean": next(means)}
            elif isinstance(effect, Pressure):
                changes = {"value": next(pressures)}
            try:
                new = type(effect).model_validate(effect.model_dump() | changes) if changes else effect
            except ValidationError as error:
                faults += validation_faults(PAGE, type(effect), error, effect.kind)
                continue
            made.append(new)
        for effect in made:
            wrong = effect.faults(scene.joint, [other for other in made if other is not effect])
            faults += [Fault(PAGE, f"{effect.kind}.{key}", value, allowed) for key, value, allowed in wrong]
        if faults:
            raise InputError(faults)
        return tuple(made)

    def write_to(self, document: Any) -> None:
        """Change the document of the scene's file."""
        with_fasteners(self.places)(document)
        of_kind(document, "fasteners")[0]["preload"] = self.preload
        for table, mean in zip(of_kind(document, "initial_gap"), self.means, strict=True):
            table["mean"] = mean
        for table, value in zip(of_kind(document, "pressure"), self.pressures, strict=True):
            table["value"] = value


@dataclass(frozen=True)
class LiveAnswer:
    """An answer to some settings of a scene.

    Parameters
    ----------
    settings : Settings
        What it answers.
    load : DualLoadCase
        Their forces f, gaps g and overlap p.
    lam : array (m,), N
        Contact forces.
    gap : array (m,), mm
        Remaining gaps.
    error_mm : float, optional
        Proven bound on the error of every gap, mm; None while nothing is proven.
    """

    settings: Settings
    load: DualLoadCase
    lam: Vector
    gap: Vector
    error_mm: float | None = None


class Explorer:
    """Answers while the fasteners, preload, gaps and pressures of a scene change; its matrices are made once.

    Parameters
    ----------
    scene : Scene, str, Path or dict
        A joint with fasteners that can move: the scene, its name, the path of its file, or its content.
    form : str, optional
        "dual" or "sparse"; by default the cheaper one.

    Raises
    ------
    InputError
        If the scene is wrong, or has no fasteners that can move.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from rivetbench import Explorer
    >>> explorer = Explorer("examples/small-joint.toml")
    >>> answer = explorer.answer(replace(explorer.settings, preload=2000.0))
    >>> explorer.proven(answer).error_mm < 1e-7
    True
    """

    def __init__(self, scene: Source, form: Form | None = None) -> None:
        joint_scene = load_scene(scene)
        self.settings = Settings.of(joint_scene)
        assert isinstance(joint_scene, JointScene)
        self.scene, self.form = joint_scene, form or chosen_form(joint_scene, FORMS, None).form
        self.data = prepared(self.scene, form=self.form)
        self.sweeps = Sweeps(self.data)
        self.proof, self.gap_error = proof_of(self.data), GapError.of(self.data.assembly)
        self.contribution = lru_cache(maxsize=256)(self._contribution)

    def answer(self, settings: Settings, near: LiveAnswer | None = None) -> LiveAnswer:
        """Solve the scene with other settings, to about 1e-5 mm.

        Parameters
        ----------
        settings : Settings
            In mm, N and N/mm².
        near : LiveAnswer, optional
            An earlier answer to start from.

        Returns
        -------
        LiveAnswer
            Contact forces and gaps, not proven yet.

        Raises
        ------
        InputError
            If a setting is wrong.
        """
        effects = settings.applied(self.scene)
        parts = [self.contribution(effect) for effect in effects if not isinstance(effect, StiffnessEffect)]
        none = self.contribution(None)
        f, g = sum((f for f, _ in parts), none[0]), sum((g for _, g in parts), none[1])
        (load,) = self.data.with_p([LoadCase(f, g)])
        return self._solved(settings, load, TOLERANCE_MM, near)

    def _solved(
        self, settings: Settings, load: DualLoadCase, tolerance: float, near: LiveAnswer | None
    ) -> LiveAnswer:
        start = None if near is None else DualStart(near.load, near.lam, near.gap)
        return LiveAnswer(settings, load, *self.sweeps.vectors(self.sweeps.solved(load, tolerance, start)))

    def proven(self, answer: LiveAnswer) -> LiveAnswer:
        """Refine an answer, and prove how far its gaps may be off.

        Parameters
        ----------
        answer : LiveAnswer
            From `answer`.

        Returns
        -------
        LiveAnswer
            The gaps, mm, to more digits, with `error_mm`.
        """
        answer = self._solved(answer.settings, answer.load, PROVEN_MM, answer)
        (assessed,) = assess(self.proof, [answer.load], [answer.lam], [None], LIMIT_MM / 2)
        error = self.gap_error(answer.load.g, assessed.x, assessed.bound_mm)
        return replace(answer, gap=assessed.gap, error_mm=float(error.max(initial=0.0)))

    def _contribution(self, effect: Effect | None) -> tuple[Vector, Vector]:
        """f and g of one effect; of None, zeros."""
        load = load_case(self.scene, self.form, [] if effect is None else [effect])
        return load.f, load.g
