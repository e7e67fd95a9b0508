"""The stages of an assembly: tables [[stage]] that set effects and take them out, and what acts in each.

    [[stage]]
    name = "rivet"
    on = ["rivets[0:8]", "shims"]         # names of effects; [a:b] some of the elements of one at points
    off = ["clamps"]

An effect that no stage names acts throughout. A file of points may have a column `stage`, the name of the
stage that sets the point.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from problems.input.bounded_types import Name, unknown

from .effect import Effect, SpringEffect, StiffnessEffect
from .interface import AnyJoint
from .joint import Faults, Joint, Table

#: The motions that are left to a plate, by the number of those that its supports hold.
LOOSE = ("it moves and tilts freely", "it tilts about a point", "it tilts about a line")
SLICE = re.compile(r"(.+?)\s*\[\s*(\d{0,9})\s*:\s*(\d{0,9})\s*\]")
#: Elements of effects: the number of the effect, and of the element. An effect without elements has one.
Elements = frozenset[tuple[int, int]]


class Stage(Table):
    """A [[stage]] table: the names of the effects that it sets (`on`) and takes out (`off`)."""

    name: Name
    on: tuple[str, ...] = ()
    off: tuple[str, ...] = ()


@dataclass(frozen=True)
class Acting:
    """The elements that act in a stage of that name. fresh : those that the stage sets."""

    name: str
    elements: Elements
    fresh: Elements


def of_effect(number: int, elements: Elements) -> list[int]:
    """The numbers of the elements of an effect, ascending."""
    return sorted(k for i, k in elements if i == number)


def acting_effects(effects: Sequence[Effect], elements: Elements, joint: AnyJoint) -> dict[int, Effect]:
    """The effects of some elements, by their numbers."""
    numbers = sorted({number for number, _ in elements})
    return {number: effects[number].only(of_effect(number, elements), joint) for number in numbers}


@dataclass
class StagePlan:
    """The acting elements of each stage; `wrong` lists the entries of the stages that are wrong.

    effects, stages : those of a scene. joint : its joint. steps : one without a name if there are no stages.
    """

    effects: Sequence[Effect]
    stages: Sequence[Stage]
    joint: AnyJoint
    wrong: list[tuple[str, object, str]] = field(default_factory=list)
    steps: list[Acting] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.counts = [effect.element_count(self.joint) for effect in self.effects]
        taken = [self._named(k, "off", stage.off) for k, stage in enumerate(self.stages)]
        put = [
            self._named(k, "on", stage.on) + self._of_files(stage.name) for k, stage in enumerate(self.stages)
        ]
        self.staged = {element for sets in (*taken, *put) for _, some in sets for element in some}
        everything = ((number, k) for number, count in enumerate(self.counts) for k in range(max(count, 1)))
        acting = frozenset(everything) - self.staged
        if not self.stages:
            self.steps.append(Acting("", acting, frozenset()))
        for number, (stage, off, on) in enumerate(zip(self.stages, taken, put, strict=True)):
            fresh: Elements = frozenset()
            for reference, elements in off:
                if not elements <= acting:
                    self._fault(number, "off", reference, "what acts: this is taken out before it is set")
                acting -= elements
            for reference, elements in on:
                if elements & acting:
                    self._fault(number, "on", reference, "what does not act yet: this is set twice")
                acting, fresh = acting | elements, fresh | elements
            self.steps.append(Acting(stage.name, acting, fresh))

    def _fault(self, number: int, key: str, value: str, allowed: str) -> None:
        self.wrong.append((f"stage[{number}] ({self.stages[number].name}).{key}", value, allowed))

    def _of_files(self, stage: str) -> list[tuple[str, Elements]]:
        """The elements whose row in a file names the stage, by the name or kind of the effect."""
        return [
            (
                f"column stage of {effect.name or effect.kind}",
                frozenset((number, k) for k, word in enumerate(effect._stages) if word == stage),
            )
            for number, effect in enumerate(self.effects)
            if stage in effect._stages
        ]

    def _named(self, number: int, key: str, references: Sequence[str]) -> list[tuple[str, Elements]]:
        """The elements of each entry of a stage that is right."""
        names = {effect.name: k for k, effect in enumerate(self.effects) if effect.name is not None}
        sets: list[tuple[str, Elements]] = []
        for reference in references:
            match = None if reference in names else SLICE.fullmatch(reference)
            name = match[1] if match else reference
            if name not in names:
                self._fault(number, key, reference, unknown("effect of this name", name, list(names)))
                continue
            effect, count = names[name], self.counts[names[name]]
            start, stop = (int(match[2] or 0), int(match[3] or count)) if match else (0, max(count, 1))
            if match and not start < stop <= count:
                has = f"0 <= a < b <= {count}, its points" if count else "no [a:b]: it has no points"
                self._fault(number, key, reference, f"{name} with {has}")
            else:
                sets.append((reference, frozenset((effect, k) for k in range(start, stop))))
        return sets

    def faults(self) -> Faults:
        """Yield what is wrong with the stages: key, value, what is allowed."""
        for where, tables in (("effect", self.effects), ("stage", self.stages)):
            names = [table.name for table in tables]
            for number, name in enumerate(names):
                if name is not None and name in names[:number]:
                    allowed = f"a name of its own: {where}[{names.index(name)}] has it"
                    yield f"{where}[{number}].name", name, allowed
        kinds = {effect.kind for effect in self.effects if effect.name is None}
        for number, effect in enumerate(self.effects):
            if (effect.name or effect.kind) == "contacts":
                yield f"effect[{number}].name", effect.name, "another name: the forces of contacts have it"
            elif effect.name in kinds:
                allowed = "another name: that of a kind calls its effects that have no name"
                yield f"effect[{number}].name", effect.name, allowed
        yield from self.wrong
        for number, effect in enumerate(self.effects):
            where = f"effect[{number}] ({effect.kind})"
            setting = [step.name for step in self.steps if of_effect(number, step.fresh)]
            if setting and effect.contacts:
                allowed = f"one that no stage names: a {effect.kind} makes a contact, which stays"
                yield f"{where}.name", effect.name, allowed
            if setting and isinstance(effect, SpringEffect) and "approach" in effect.model_fields_set:
                allowed = f"leave it out: stage {setting[0]} locks the approach that it has reached"
                yield f"{where}.approach", effect.approach, allowed
            if setting and effect._stages and not self.counts[number]:
                allowed = f"a file without a column stage: a {effect.kind} acts as a whole"
                yield f"{where}.file", "a column stage", allowed
            never = [k for k in range(self.counts[number]) if (number, k) not in self.staged]
            if setting and never:
                allowed = f"all of its {self.counts[number]} points in stages, or none: {never[0]} is in none"
                yield f"{where}.name", effect.name, allowed
        if self.stages and not self.wrong:
            yield from self._clashes()

    def floating(self) -> Faults:
        """Yield the plates that nothing holds in some stage, once each; none if names are wrong."""
        told: set[str] = set()
        if not isinstance(self.joint, Joint) or self.wrong:
            return
        stiff = {k for k, effect in enumerate(self.effects) if isinstance(effect, StiffnessEffect)}
        first: dict[Elements, Acting] = {}
        for step in self.steps:
            first.setdefault(frozenset(one for one in step.elements if one[0] in stiff), step)
        for elements, step in first.items():
            acting = acting_effects(self.effects, elements, self.joint).values()
            held = [effect for effect in acting if isinstance(effect, StiffnessEffect)]
            where = f" in stage {step.name}" if step.name else ""
            for part in self.joint.part:
                points = [point for one in held if one.part == part.name for point in one.held_points]
                # A rigid motion of a plate is a + bx + cy: three points off a line hold it.
                motions = np.linalg.matrix_rank([[1, x, y] for x, y in points] or [[0.0]])
                if not part.clamped and motions < 3 and part.name not in told:
                    told.add(part.name)
                    needed = f"needs a clamped edge, or supports at three points off a line{where}"
                    yield f"part.{part.name}", points or "no support", f"{needed}: {LOOSE[motions]}"

    def _clashes(self) -> Faults:
        """Yield the faults of effects that act together. A fastener may be set where a force presses."""
        if any(any(effect.faults(self.joint)) for effect in self.effects):
            return  # what is wrong with one effect is told first
        told: list[tuple[str, object, str]] = []
        for step in self.steps:
            acting = acting_effects(self.effects, step.elements, self.joint)
            for number, effect in acting.items():
                others = [other for k, other in acting.items() if k != number]
                if isinstance(effect, SpringEffect):
                    others = [other for other in others if isinstance(other, SpringEffect)]
                for fault in effect.faults(self.joint, others):
                    if fault not in told:
                        told.append(fault)
                        key, value, allowed = fault
                        where = f"effect[{number}] ({effect.kind}).{key}"
                        yield where, value, f"{allowed}, in stage {step.name}"
