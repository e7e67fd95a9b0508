"""Takes each load case of a series through the stages of its scene, a block of cases at a time.

The cases are those of the last stage. In stage s case k has the forces f_k + f_s − f + T(k a_k) and the gaps
g_k + g_s − g, with f and g of the last stage, f_s without approaches, and a_k what the fasteners of s have
locked in this case. Stages with the same K share its factors and the state of the solver.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from problems.build import load_case, shares_stiffness
from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.load_cases import LoadCases
from problems.model.effect import GapEffect
from problems.model.scene import JointScene, Scene
from problems.model.springs import Springs
from problems.model.stage_answers import locked, stage_scenes, through

from .session import BLOCK, Attempt, Job, Result, SeriesSession

RANDOM = ("initial_gap", "measured_gap")  # what the cases of a series replace


def last_scene(scene: Scene) -> Scene:
    """The scene that the load cases of a series are made of: of one with stages, what acts in the last.

    Raises InputError if the gap that they replace is not there in all stages.
    """
    if not (isinstance(scene, JointScene) and scene.stages):
        return scene
    *_, last = scenes = list(stage_scenes(scene).values())
    for effect in scene.effects_of(GapEffect):
        if effect.kind in RANDOM and any(effect not in part.effects for part in scenes):
            raise InputError.one(scene.name, "stage", effect.name, f"no {effect.kind}: a series replaces it")
    return last


@dataclass(frozen=True)
class StageCases(LoadCases):
    """The load cases of one stage.

    of_last : those of the last stage. change : of f and g from the last stage to this one. locking : the
    forces of the locked approaches, (n,) N by the number of the case; none without installed fasteners.
    """

    of_last: LoadCases
    change: LoadCase
    locking: dict[int, Vector]

    @property
    def key(self) -> str:
        return self.of_last.key

    def load(self, k: int) -> LoadCase:
        load = self.of_last.load(k)
        f = load.f + self.change.f if self.change.f.any() else load.f
        return LoadCase(f + self.locking[k] if self.locking else f, load.g + self.change.g)

    def parameters(self, k: int) -> dict[str, float | str]:
        return self.of_last.parameters(k)


class StagedSession:
    """A job in this process, as `SeriesSession`, whose scene has stages."""

    def __init__(self, job: Job) -> None:
        assert isinstance(job.scene, JointScene)
        self.job, self.scene = job, job.scene
        self.sessions: list[SeriesSession] = []
        self.last = load_case(last_scene(job.scene), job.form)

    @staticmethod
    def _load(scene: Scene, form: Form) -> LoadCase:
        """f and g of a scene without stages whose springs have no approach."""
        assert isinstance(scene, JointScene)
        return load_case(locked(scene, np.zeros(len(Springs.of(scene).k))), form)

    def solve(self, numbers: Sequence[int]) -> Iterator[list[Result]]:
        """The results of the cases with these numbers, a block at a time."""
        for start in range(0, len(numbers), BLOCK):
            yield self._through(numbers[start : start + BLOCK])

    def _through(self, block: Sequence[int]) -> list[Result]:
        def solved(part: JointScene, approaches: Matrix) -> tuple[Matrix, tuple[list[Attempt], list[Result]]]:
            session = self._session(part, approaches, block)
            attempts = [attempt for some in session.attempted(block) for attempt in some]
            assessed = session.assessed(attempts)
            x = np.zeros((self.scene.joint.size[0], len(block)))
            for column, case in enumerate(block):
                if case in assessed:
                    x[:, column] = session.data.assembly.at_junction(assessed[case].x)
            return x, (attempts, session.results(attempts, assessed))

        history = [(name, results) for name, _, _, (_, results) in through(self.scene, solved, len(block))]
        return [self._result([(name, results[k]) for name, results in history]) for k in range(len(block))]

    def _session(self, part: JointScene, approaches: Matrix, block: Sequence[int]) -> SeriesSession:
        """The session of K of a stage, with the load cases of the stage."""
        shared = (one for one in self.sessions if shares_stiffness(part, one.job.scene))
        session = next(shared, None)
        if session is None:
            session = SeriesSession(replace(self.job, scene=part))
            self.sessions.append(session)
        here, springs, junction = (
            self._load(part, self.job.form),
            Springs.of(part),
            session.data.assembly.junction,
        )
        locking = np.zeros((len(here.f), len(block)))
        locking[slice(None) if junction is None else junction] = springs.T @ (springs.k[:, None] * approaches)
        forces = dict(zip(block, np.ascontiguousarray(locking.T), strict=True)) if springs else {}
        change = LoadCase(here.f - self.last.f, here.g - self.last.g)
        cases = StageCases(self.job.cases, change, forces)
        session.job = replace(self.job, scene=part, cases=cases)
        return session

    @staticmethod
    def _result(stages: list[tuple[str, Result]]) -> Result:
        """The result of the last stage, with the largest gap of each, and the verdict of the first that is
        not within.
        """
        row, gap = stages[-1][1]
        gaps = {name: result.row.get("max_gap_mm") for name, result in stages}
        failed = next(((name, one.row) for name, one in stages if one.row["verdict"] != "within"), None)
        if failed is None:
            return Result(row | {"stages_max_gap_mm": gaps}, gap)
        name, other = failed
        said = f"stage {name}: {other['message'] or other['verdict']}"
        if other["verdict"] == "no_answer":  # later stages have locked nothing that counts
            row, gap = other, None
        return Result(row | {"verdict": other["verdict"], "message": said, "stages_max_gap_mm": gaps}, gap)


def session_of(job: Job) -> SeriesSession | StagedSession:
    """The session of a job in this process."""
    return StagedSession(job) if job.scene.stages else SeriesSession(job)
