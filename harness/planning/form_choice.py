"""The form in which a scene is solved, where none is asked for.

The sparse form, unless the solver takes dense forms only, Q is in the cache, its dense matrices are small, or
it is solved for so many load cases that condensing pays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from harness.results.machine import physical_memory_mib
from problems.build import model_of
from problems.errors import InputError
from problems.forms.names import DENSE_FORMS, Form, default_form
from problems.model.scene import JointScene, Scene

from .memory import Size, refuse_what_cannot_fit, size_of

SMALL_MIB = 100.0  # of dense matrices
MANY = 100  # load cases


@dataclass(frozen=True)
class Choice:
    """A form, and a sentence that says why; "" where there was no choice."""

    form: Form
    why: str = ""


def chosen_form(scene: Scene, taken: Sequence[Form], asked: Form | None, cases: int = 1) -> Choice:
    """The form asked for, else by the rule, of those that a solver takes.

    Raises InputError if it is not among these, or if this machine's memory cannot hold it.
    """
    if asked is not None and asked not in taken:
        raise InputError.one("--form", "form", asked, f"the solver takes {' and '.join(taken)}")
    size = size_of(scene)
    choice = _by_rule(scene, size, taken, cases) if asked is None else Choice(asked)
    refuse_what_cannot_fit(scene, size, choice.form)
    return choice


def _by_rule(scene: Scene, size: Size | None, taken: Sequence[Form], cases: int) -> Choice:
    dense = [form for form in taken if form in DENSE_FORMS]
    if not dense or "sparse" not in taken or size is None:
        return Choice(default_form(dense or taken))
    fits = size.dense_peak_mib <= physical_memory_mib()
    cached = isinstance(scene, JointScene) and model_of(scene).built
    if fits and (cached or cases >= MANY or size.dense_mib <= SMALL_MIB):
        return Choice(default_form(dense))
    return Choice("sparse", f"dense matrices would take {size.dense_mib:.0f} MiB")
