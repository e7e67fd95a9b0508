"""Answers a scene while its loads and gaps change: matrices are made once, each answer starts from the last.

The settings change effects of the scene: places and preload of its fasteners, the pressures, the mean of the
initial gap; none of them changes K. The forces and gaps of an effect are kept as long as it stays the same.
An answer goes through all stages of the scene; those with the same K share its matrices.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import repeat
from typing import Any
from uuid import uuid4

import numpy as np
import scipy.sparse as sp

from harness.placement.candidates import movable_fasteners
from harness.planning.form_choice import chosen_form
from harness.scene.scene_file import MOVED, of_kind, with_fasteners
from harness.scene.solution import Source, load_scene
from harness.series.staged import shared_session
from harness.series.stiffness_session import StiffnessSession
from harness.solving.call_lock import in_turn
from harness.verification.assess import assess
from harness.verification.judge import LIMIT_MM
from problems.build import load_case
from problems.effects.fasteners import Fasteners
from problems.effects.initial_gap import InitialGap
from problems.effects.pressure import Pressure
from problems.errors import Fault, InputError
from problems.forms import FORMS, Form
from problems.forms.assembly import DualLoadCase, LoadCase, Matrix, Vector
from problems.input.bounded_types import valid_table
from problems.model.effect import Effect, StiffnessEffect
from problems.model.scene import JointScene, Scene
from problems.model.stage_answers import Elongations, locked, through
from problems.model.stages import StagePlan
from solvers.base import DualStart

TOLERANCE_MM, PROVEN_MM = 1e-5, 1e-9  # of the first answer, and of the proven one
CHANGED = (*MOVED, "initial_gap", "pressure")
PAGE = "page"  # where a wrong value was given


@dataclass(frozen=True)
class Settings:
    """The values of a scene that may change while it is explored.

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
        preload = fasteners[0].preload
        assert isinstance(preload, float)  # as is refused otherwise
        return cls(places, preload, means, pressures)

    def applied(self, scene: JointScene) -> tuple[Effect, ...]:
        """The scene's effects with these values. Raises InputError, as `validate` does."""
        own = Settings.of(scene)
        both = ("means", self.means, own.means), ("pressures", self.pressures, own.pressures)
        for name, given, there in both:
            if np.shape(given) != (len(there),):
                raise InputError.one(PAGE, name, given, f"as many as in the scene, {len(there)}")
        means, pressures, faults, made = iter(self.means), iter(self.pressures), list[Fault](), list[Effect]()
        fasteners = False
        for effect in scene.effects:
            changes: dict[str, Any] = {}
            if isinstance(effect, Fasteners):
                if fasteners or not len(self.places):
                    continue
                fasteners, changes = True, {"points": self.places, "pattern": None, "preload": self.preload}
            elif isinstance(effect, InitialGap):
                changes = {"mean": next(means)}
            elif isinstance(effect, Pressure):
                changes = {"value": next(pressures)}
            new: Effect | None = effect
            if changes:
                new = valid_table(type(effect), effect.model_dump() | changes, PAGE, faults, effect.kind)
            made += [] if new is None else [new]
        for effect in made:
            others = [other for other in made if other is not effect]
            wrong = effect.faults(scene.joint, *(() if scene.stages else (others,)))
            faults += [Fault(PAGE, f"{effect.kind}.{key}", value, allowed) for key, value, allowed in wrong]
        if not faults:
            faults = [Fault(PAGE, *fault) for fault in StagePlan(made, scene.stages, scene.joint).faults()]
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
        Proven bound on the error of every gap, mm; None while nothing is proven. In a stage it holds for the
        approaches that the stages before have locked; infinite if these are not proven to 1e-7 mm.
    stage : str
        The name of its stage; "" without stages.
    stages : tuple of LiveAnswer
        What each stage of the scene has reached; the other entries are those of the last one. Empty without
        stages.
    starts : tuple of DualStart
        Each problem that was solved on the way: those of the next answer start from them.
    explorer : str
        The key of the `Explorer` that gave it: another one has other matrices.
    """

    settings: Settings
    load: DualLoadCase
    lam: Vector
    gap: Vector
    error_mm: float | None = None
    stage: str = ""
    stages: tuple["LiveAnswer", ...] = ()
    starts: tuple[DualStart, ...] = ()
    explorer: str = ""


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

    @in_turn
    def __init__(self, scene: Source, form: Form | None = None) -> None:
        joint_scene = load_scene(scene)
        self.settings, self.key = Settings.of(joint_scene), uuid4().hex
        assert isinstance(joint_scene, JointScene)
        self.scene, self.form = joint_scene, chosen_form(joint_scene, FORMS, form).form
        self.sessions: list[_Session] = []  # of each problem that `through` solves, in its order
        for _ in through(self.scene, self._opened):
            pass
        self.data = self.sessions[-1].data

    def _opened(self, part: JointScene, approaches: Matrix) -> tuple[Elongations, None]:
        opened = ((one.scene, one) for one in self.sessions)
        self.sessions.append(shared_session(part, opened, lambda scene: _Session(scene, self.form)))
        return lambda T: np.zeros((T.shape[1], 1)), None

    @in_turn
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
            Contact forces and gaps, of the last stage and of each, not proven yet.

        Raises
        ------
        InputError
            If a setting is wrong, or `near` is of another Explorer.
        """
        return self._through(settings, near, proven=False)

    @in_turn
    def proven(self, answer: LiveAnswer) -> LiveAnswer:
        """Refine an answer, and prove how far its gaps may be off.

        Parameters
        ----------
        answer : LiveAnswer
            From `answer`.

        Returns
        -------
        LiveAnswer
            The gaps, mm, to more digits, with `error_mm`, in each stage.
        """
        return self._through(answer.settings, answer, proven=True)

    def _through(self, settings: Settings, near: LiveAnswer | None, proven: bool) -> LiveAnswer:
        if near and near.explorer != self.key:
            raise InputError.one("Explorer", "answer", "of another Explorer", "one of this")
        scene = replace(self.scene, effects=settings.applied(self.scene))
        sessions, starts = iter(self.sessions), list[DualStart]()
        earlier = iter(near.starts) if near and near.starts else repeat(None)
        locks_mm = 0.0  # the largest bound on an answer in which fasteners lock

        def solved(part: JointScene, approaches: Matrix) -> tuple[Elongations, LiveAnswer]:
            session, start = next(sessions), next(earlier)
            load = session.load(locked(part, approaches[:, 0]).effects, start)
            tolerance, sweeps = PROVEN_MM if proven else TOLERANCE_MM, session.sweeps
            lam, gap = sweeps.vectors(sweeps.solved(load, tolerance, start))
            x, error, bound_mm = np.zeros(len(load.f)), None, 0.0
            if proven:
                x, gap, error, bound_mm = session.proven(load, lam)
                error = error if locks_mm <= LIMIT_MM else np.inf
            elif scene.stages:  # else nothing is locked
                x = session.data.assembly.K.solve(load.f - session.data.assembly.A @ lam)
            starts.append(DualStart(load, lam, gap))
            answer = LiveAnswer(settings, load, lam, gap, error, explorer=self.key)

            def elongations(T: sp.csc_array) -> Matrix:
                nonlocal locks_mm
                locks_mm = max(locks_mm, bound_mm)
                return T.T @ session.data.assembly.at_junction(x)

            return elongations, answer

        stages = [replace(answer, stage=name) for name, _, _, answer in through(scene, solved)]
        return replace(stages[-1], stages=tuple(stages) if scene.stages else (), starts=tuple(starts))


class _Session(StiffnessSession):
    """Stages with the same K, and the forces and gaps of their effects. scene : one of these stages."""

    def __init__(self, scene: JointScene, form: Form) -> None:
        super().__init__(scene, form)
        self.contribution = lru_cache(maxsize=256)(self._contribution)

    def load(self, effects: Iterable[Effect], near: DualStart | None) -> DualLoadCase:
        """The sum of their forces and gaps. near : its load is the answer if they have not changed."""
        parts = [self.contribution(effect) for effect in effects if not isinstance(effect, StiffnessEffect)]
        none = self.contribution(None)
        f, g = sum((f for f, _ in parts), none[0]), sum((g for _, g in parts), none[1])
        if near and np.array_equal(f, near.load.f) and np.array_equal(g, near.load.g):
            return near.load
        (load,) = self.data.with_p([LoadCase(f, g)])
        return load

    def _contribution(self, effect: Effect | None) -> tuple[Vector, Vector]:
        """f and g of one effect; of None, zeros."""
        load = load_case(self.scene, self.form, [] if effect is None else [effect])
        return load.f, load.g

    def proven(self, load: DualLoadCase, lam: Vector) -> tuple[Vector, Vector, float, float]:
        """x and the gaps (m,) that belong to λ, mm, and the largest errors of a gap and of x, mm."""
        (assessed,) = assess(self.proof, [load], [lam], [None], LIMIT_MM / 2)
        error = self.gap_error(load.g, assessed.x, assessed.bound_mm)
        return assessed.x, assessed.gap, float(error.max(initial=0.0)), assessed.bound_mm
