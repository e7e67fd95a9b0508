"""Takes each load case of a series through the stages of its scene, a block of cases at a time.

The cases are those of the last stage, and differ in their gaps. In stage s case k has the gaps g_k + g_s − g
and the forces f_s + T(k a_k), with g of the last stage, f_s without approaches, and a_k what the fasteners of
s have locked in this case. If effects are random, the cases say what acts in s. Stages with the same K share
its factors and the state of the solver.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
import scipy.sparse as sp

from harness.verification.judge import LIMIT_MM
from problems.build import adopts_model, load_case
from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector
from problems.load_cases import REPLACED, LoadCases
from problems.model.effect import GapEffect
from problems.model.scene import JointScene, Scene
from problems.model.springs import Springs
from problems.model.stage_answers import Elongations, last_scene, locked, stage_scenes, through

from .session import BLOCK, Job, Result, SeriesSession

S = TypeVar("S")


def refuse_staged_gaps(scene: Scene) -> None:
    """Raises InputError if a gap that the cases of a series replace is not there in all stages."""
    if not isinstance(scene, JointScene):
        return
    scenes = list(stage_scenes(scene).values())
    for effect in scene.effects_of(GapEffect):
        if effect.kind in REPLACED and any(effect not in part.effects for part in scenes):
            raise InputError.one(scene.name, "stage", effect.name, f"no {effect.kind}: a series replaces it")


@dataclass(frozen=True)
class StageCases(LoadCases):
    """The load cases of one stage.

    of_last : those of the last stage. stage : this one. locking : the locked approaches, (r,) mm, and their
    forces, (n,) N, by the number of the case; none without installed fasteners.
    """

    of_last: LoadCases
    stage: "OpenStage[Any]"
    locking: dict[int, tuple[Vector, Vector]] = field(default_factory=dict)

    @property
    def key(self) -> str:
        return self.of_last.key

    @cached_property
    def drawn(self) -> LoadCases | None:
        return self.of_last.of_stage(self.stage.scene)

    def load(self, k: int) -> LoadCase:
        if self.drawn:
            load = self.drawn.load(k)
        else:
            load = LoadCase(self.stage.f, self.of_last.load(k).g + self.stage.gap_change)
        return LoadCase(load.f + self.locking[k][1], load.g) if self.locking else load

    def scene_of(self, k: int, stage: JointScene | None = None) -> JointScene | None:
        part = self.stage.scene
        return self.of_last.scene_of(k, locked(part, self.locking[k][0]) if self.locking else part)

    def parameters(self, k: int) -> dict[str, float | str]:
        return self.of_last.parameters(k)


@dataclass(frozen=True, eq=False)
class OpenStage(Generic[S]):
    """A stage as its load cases share it.

    scene : without approaches. session : of its K. f : (n,) N. gap_change : from the last stage, (m,) mm.
    springs : those of the stage.
    """

    scene: JointScene
    session: S
    f: Vector
    gap_change: Vector
    springs: Springs

    def locking(self, assembly: Assembly, approaches: Matrix) -> Matrix:
        """T(k a) (n, cases) N, the forces of approaches (r, cases) mm."""
        return assembly.from_junction(self.springs.T @ (self.springs.k[:, None] * approaches))


def shared_session(
    scene: JointScene, opened: Iterable[tuple[JointScene, S]], make: Callable[[JointScene], S]
) -> S:
    """The session of a stage: that of one with the same K, or else a new one.

    opened : the scenes of stages, each with its session. make : makes the session of a scene.
    """
    shared = (session for other, session in opened if adopts_model(scene, other))
    return next(shared, None) or make(scene)


class OpenStages(Generic[S]):
    """The stages opened so far, each once; those with the same K share a session, which `make` makes.

    last : what acts in the last stage.
    """

    def __init__(self, last: JointScene, form: Form, make: Callable[[JointScene], S]) -> None:
        self.form, self.make, self.gap = form, make, load_case(last, form).g
        self.stages: dict[tuple[object, ...], OpenStage[S]] = {}

    def of(self, part: JointScene) -> OpenStage[S]:
        """The stage in which `part` acts, a scene without stages."""
        if (key := (part.key, part.origin)) not in self.stages:
            springs = Springs.of(part)
            bare = locked(part, np.zeros(len(springs.k)))
            opened = ((one.scene, one.session) for one in self.stages.values())
            session, load = shared_session(bare, opened, self.make), load_case(bare, self.form)
            self.stages[key] = OpenStage(bare, session, load.f, load.g - self.gap, springs)
        return self.stages[key]


class StagedSession:
    """A job in this process, as `SeriesSession`, whose scene has stages."""

    def __init__(self, job: Job) -> None:
        assert isinstance(job.scene, JointScene)
        self.job, self.scene = job, job.cases.staged(job.scene)
        last = last_scene(self.scene)
        self.stages = OpenStages(last, job.form, lambda part: SeriesSession(replace(job, scene=part)))

    def solve(self, numbers: Sequence[int]) -> Iterator[list[Result]]:
        """The results of the cases with these numbers, a block at a time."""
        for start in range(0, len(numbers), BLOCK):
            yield self._through(numbers[start : start + BLOCK])

    def _through(self, block: Sequence[int]) -> list[Result]:
        unproven = np.zeros(len(block), bool)  # of each case: whether such an answer has locked fasteners

        def solved(part: JointScene, approaches: Matrix) -> tuple[Elongations, list[Result]]:
            session = self._session(part, approaches, block)
            attempts = [attempt for some in session.attempted(block) for attempt in some]
            assessed = session.assessed(attempts)
            x = np.zeros((self.scene.joint.size[0], len(block)))
            for column, case in enumerate(block):
                if case in assessed:
                    x[:, column] = session.data.assembly.at_junction(assessed[case].x)
            bounds = [assessed[case].bound_mm if case in assessed else np.inf for case in block]

            def elongations(T: sp.csc_array) -> Matrix:
                np.logical_or(unproven, np.array(bounds) > LIMIT_MM, out=unproven)
                return T.T @ x

            return elongations, session.results(attempts, assessed)

        history = [(name, results) for name, _, _, results in through(self.scene, solved, len(block))]
        of_case = ([(name, results[k]) for name, results in history] for k in range(len(block)))
        return [self._result(*both) for both in zip(of_case, unproven.tolist(), strict=True)]

    def _session(self, part: JointScene, approaches: Matrix, block: Sequence[int]) -> SeriesSession:
        """The session of K of a stage, with the load cases of the stage."""
        stage = self.stages.of(part)
        session, locking = stage.session, dict[int, tuple[Vector, Vector]]()
        if stage.springs:
            forces = np.ascontiguousarray(stage.locking(session.data.assembly, approaches).T)
            locking = dict(zip(block, zip(approaches.T, forces, strict=True), strict=True))
        session.job = replace(self.job, scene=part, cases=StageCases(self.job.cases, stage, locking))
        return session

    @staticmethod
    def _result(stages: list[tuple[str, Result]], unproven: bool) -> Result:
        """The result of the last stage, with the largest gap of each, and the verdict of the first that is
        not within.

        unproven : whether fasteners have locked what is not proven to 1e-7 mm: no later error is known.
        """
        row, gap = stages[-1][1]
        gaps = {"stages_max_gap_mm": {name: result.row.get("max_gap_mm") for name, result in stages}}
        if unproven and gap is not None:
            errors = [name for name in ("gap_error_mm", "force_error_N", "bound_mm") if name in row]
            row = row | dict.fromkeys(errors, np.inf) | {"verdict": "cannot_be_judged"}
            row = row | {"message": f"fasteners lock what is not proven to {LIMIT_MM:g} mm"}
        failed = next(((name, one.row) for name, one in stages if one.row["verdict"] != "within"), None)
        if failed is None:
            return Result(row | gaps, gap)
        name, other = failed
        if other["verdict"] == "no_answer":  # later stages have locked nothing that counts
            row, gap = other, None
        said = f"stage {name}: {other['message'] or other['verdict']}"
        return Result(row | {"verdict": other["verdict"], "message": said} | gaps, gap)


def session_of(job: Job) -> SeriesSession | StagedSession:
    """The session of a job in this process."""
    return StagedSession(job) if job.scene.stages else SeriesSession(job)
