"""Which costs less: condensing onto the junction once, or the whole sparse model for each load case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from harness.results.machine import physical_memory_mib
from problems.build import model_of
from problems.errors import InputError
from problems.forms.names import DENSE_FORMS, Form, default_form
from problems.model.scene import JointScene, MadeScene, MatricesScene, Scene

from .estimate import estimated, estimated_sparse, refuse_what_cannot_fit
from .own_matrices import own_size, refuse_own

FLOPS_PER_S = 2e10  # the comparison hardly depends on it
WORTH_S = 1.0  # a smaller saving is not worth another road
SWEEPS, PRODUCTS = 12, 10  # with Q and with K, per load case of a series on dense matrices


@dataclass(frozen=True)
class Choice:
    """A form, and a sentence that says why; "" where there was no choice."""

    form: Form
    why: str = ""


def chosen_form(
    scene: Scene, taken: Sequence[Form], asked: Form | None, cases: int = 1, in_house: bool = True
) -> Choice:
    """The form asked for, else the cheaper one of those that a solver takes. Raises InputError.

    in_house : whether the estimates hold for the solver; a library takes the sparse form if no other fits.
    """
    if asked is None:
        return cheaper(scene, taken, cases, in_house)
    if asked not in taken:
        raise InputError.one("--form", "form", asked, f"the solver takes {' and '.join(taken)}")
    if isinstance(scene, MatricesScene | MadeScene):
        refuse_own(scene, asked)
    elif asked in DENSE_FORMS:
        refuse_what_cannot_fit(scene, scene.name)
    return Choice(asked)


def cheaper(scene: Scene, taken: Sequence[Form], cases: int = 1, in_house: bool = True) -> Choice:
    """The form for some load cases, of those that a solver takes; estimated, from the scene alone.

    Raises InputError if the only form that this machine's memory could hold is not among them.
    """
    usual = default_form([form for form in taken if form in DENSE_FORMS] or taken)
    if not isinstance(scene, JointScene):
        assert isinstance(scene, MatricesScene | MadeScene)
        return _own(scene, taken, usual, in_house)
    condensed, sparse = estimated(scene, FLOPS_PER_S), estimated_sparse(scene, FLOPS_PER_S)
    physical = physical_memory_mib()
    if condensed.peak_mib > physical:
        why = f"its condensed matrices would take {condensed.peak_mib:.0f} MiB"
        if "sparse" in taken and sparse.peak_mib <= physical:
            return Choice("sparse", f"{why}, the sparse model takes {sparse.peak_mib:.0f} MiB")
        refuse_what_cannot_fit(scene, scene.name)
    if not in_house or "sparse" not in taken or usual == "sparse" or sparse.peak_mib > physical:
        return Choice(usual)
    build_s = 0.0 if model_of(scene).built else condensed.build_s
    per_case = (2 * SWEEPS * condensed.m**2 + 2 * PRODUCTS * condensed.n**2) / FLOPS_PER_S
    dense_s = build_s + (condensed.answer_s if cases == 1 else cases * per_case)
    # Load cases share their solutions, but for the first, whose answer the others start from.
    sparse_s = sparse.build_s + sparse.answer_s + (cases - 1) * sparse.case_s
    if sparse_s + WORTH_S > dense_s:
        return Choice(usual)
    return Choice("sparse", f"about {sparse_s:.0f} s, where condensing first would take {dense_s:.0f} s")


def _own(scene: MatricesScene | MadeScene, taken: Sequence[Form], usual: Form, in_house: bool) -> Choice:
    """The sparse form of a user's sparse K where the dense one does not fit or takes longer."""
    size = own_size(scene)
    if size is None or usual == "sparse" or "sparse" not in taken:
        refuse_own(scene, usual)
        return Choice(usual)
    if size.dense_mib > physical_memory_mib():
        refuse_own(scene, "sparse")
        dense, sparse = size.dense_mib, size.sparse_mib
        return Choice(
            "sparse", f"dense matrices would take {dense:.0f} MiB, the sparse ones {sparse:.0f} MiB"
        )
    if not in_house or size.sparse_mib > physical_memory_mib():
        return Choice(usual)
    dense_s, sparse_s = size.dense_flops / FLOPS_PER_S, size.sparse_flops / FLOPS_PER_S
    if sparse_s + WORTH_S > dense_s:
        return Choice(usual)
    return Choice("sparse", f"about {sparse_s:.0f} s, where dense factors would take {dense_s:.0f} s")
