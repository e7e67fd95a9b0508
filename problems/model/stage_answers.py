"""Goes through the stages of a scene: the fasteners that a stage sets lock the approach that it has reached.

    stage s:    min ½xᵀ(K + T diag(k) Tᵀ)x − (f + T(preload + k a))ᵀx    subject to   Aᵀx ≤ g

K, f and g are those of the effects that act in s, and T has a column t per installed fastener. The fasteners
that s sets lock the elongation a = tᵀx of the answer to everything else that acts in s. From then on they are
springs. Without a preload they are free of force in s, whose answer is then the same with and without them.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeAlias, TypeVar, overload

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.forms.assembly import Matrix, Vector

from .effect import SpringEffect
from .scene import JointScene, Scene
from .stages import Acting, Elements, StagePlan, acting_effects, of_effect

Answer = TypeVar("Answer")
#: Of an answer x (n, k), mm: Tᵀx (r, k) for directions T (n, r).
Elongations: TypeAlias = Callable[[sp.csc_array], Matrix]


def through(
    scene: JointScene, solve: Callable[[JointScene, Matrix], tuple[Elongations, Answer]], cases: int = 1
) -> Iterator[tuple[str, JointScene, Matrix, Answer]]:
    """Go through the stages of a scene, one after another; a scene without stages is one.

    solve : answers a scene without stages whose springs have the approaches (r, cases), mm. It returns the
    function from T to Tᵀx, called if fasteners lock their approach, and the answer to hand on.
    cases : the number of load cases. Each has approaches of its own.

    Yields the name of a stage; what acts at its end, a scene without stages; the approaches of its springs,
    mm, see `locked`; and its answer. A stage is solved again with the fasteners that it sets if these have a
    preload, or if it is the last one.
    """
    joint, locks = scene.joint, _given_approaches(scene, cases)

    def assembled(step: Acting, elements: Elements) -> tuple[JointScene, Matrix]:
        rows = [at[:, of_effect(number, elements)].reshape(-1, cases) for number, at in locks.items()]
        return _scene(scene, step, elements), np.concatenate([np.zeros((0, cases)), *rows])

    def answered(step: Acting, part: JointScene, approaches: Matrix) -> tuple[Elongations, Answer]:
        try:
            return solve(part, approaches)
        except InputError as error:
            raise error.in_stage(step.name) from error

    *_, last = steps = StagePlan(scene.effects, scene.stages, joint).steps
    for step in steps:
        fresh = frozenset((number, k) for number, k in step.fresh if number in locks)
        part, approaches = assembled(step, step.elements - fresh)
        elongations, answer = answered(step, part, approaches)
        again = step is last
        for number in sorted({number for number, _ in fresh}):
            effect, elements = scene.effects[number], of_effect(number, fresh)
            assert isinstance(effect, SpringEffect)
            T, _ = effect.springs(joint)
            reached = elongations(T).reshape(locks[number].shape)
            locks[number][:, elements] = reached[:, elements]
            again = again or effect.preload != 0
        if fresh:
            part, approaches = assembled(step, step.elements)
            _, answer = answered(step, part, approaches) if again else (elongations, answer)
        yield step.name, part, approaches, answer


def locked(scene: JointScene, approaches: Vector) -> JointScene:
    """The scene without stages whose springs have the approaches (r,), mm."""
    effects, start = list(scene.effects), 0
    for number, effect in enumerate(effects):
        if isinstance(effect, SpringEffect):
            stop = start + effect.spring_count(scene.joint)
            update = {"approach": tuple(approaches[start:stop].tolist())}
            effects[number], start = effect.model_copy(update=update), stop
    return replace(scene, effects=tuple(effects))


def stage_scenes(scene: JointScene) -> dict[str, JointScene]:
    """The scene at the end of each stage, by its name, without stages and locked approaches.

    The scene itself under "" if it has no stages.
    """
    if not scene.stages:
        return {"": scene}
    steps = StagePlan(scene.effects, scene.stages, scene.joint).steps
    return {step.name: _scene(scene, step, step.elements) for step in steps}


@overload
def last_scene(scene: JointScene) -> JointScene: ...


@overload
def last_scene(scene: Scene) -> Scene: ...


def last_scene(scene: Scene) -> Scene:
    """The scene at the end of the last stage, see `stage_scenes`; the scene itself if it has no stages."""
    return [*stage_scenes(scene).values()][-1] if isinstance(scene, JointScene) else scene


def _scene(scene: JointScene, step: Acting, elements: Elements) -> JointScene:
    acting = acting_effects(scene.effects, elements, scene.joint)
    origin = tuple((number, tuple(of_effect(number, elements))) for number in acting)
    title = f"{scene.title}: {step.name}" if step.name else scene.title
    return replace(scene, title=title, effects=tuple(acting.values()), stages=(), origin=origin)


def _given_approaches(scene: JointScene, cases: int) -> dict[int, Matrix]:
    """The approaches that effects give, by the effect's number: (pairs, elements, springs, cases) mm."""
    approaches, joint = {}, scene.joint
    for number, effect in enumerate(scene.effects):
        if isinstance(effect, SpringEffect):
            count, elements = effect.spring_count(joint), max(effect.element_count(joint), 1)
            shape = len(effect.tied(joint)), elements, len(effect.marks(joint)) // elements, 1
            given = np.broadcast_to(np.array(effect.approach), count).reshape(shape)
            approaches[number] = given.repeat(cases, axis=3).astype(float)
    return approaches
