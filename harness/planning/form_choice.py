"""Predicts the memory that a scene needs in each form, and chooses the form where the user names none.

The memory is counted from the entries of the matrices, before they are built. The dense forms keep K and its
factors, Σ 2 b² entries for blocks of b unknowns, and Q, m² entries. The sparse form keeps the factors of K̂,
Σ N (w + 1) entries for blocks of N unknowns and half-bandwidth w.

The form is the sparse one, unless the solver takes dense forms only, Q is in the cache, or the dense matrices
are small for the number of load cases that share them. Where contacts depend on one another, Q is singular,
and only the sparse form takes them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log2
from typing import TYPE_CHECKING

from harness.results.provenance import physical_memory_mib
from problems.build import models_of
from problems.errors import InputError
from problems.forms import DENSE_FORMS, FORMS, Form, default_form
from problems.forms.assembly import Assembly
from problems.input.bounded_types import MIB
from problems.model.effect import SpringEffect
from problems.model.joint import Joint
from problems.model.scene import JointScene, Scene
from problems.stiffness.dense_block import dense_slices

if TYPE_CHECKING:
    from problems.build import Model

SMALL_MIB = 100.0  # of dense matrices, per load case
PROCESS_MIB = 150  # without matrices
MODEL_BYTES = 1500  # while K̂ is assembled, per unknown; measured at n = 4386 and 11308
BYTES_PER_ENTRY = 200  # of a given K and its copies in sparse storage
# Where the band is wide, a fill-reducing order: 31/4 n² log₂ n entries on an n × n grid (George 1973), with 4
# unknowns per node, L and U, and their indices. Per unknown and log₂ of the nodes:
GENERAL = 31 / 4 / 2 * 4 * 2 * 1.5
FACTORS = 2  # of K̂ at a time: to solve with, and to prove λmin


@dataclass(frozen=True)
class Size:
    """n unknowns, m contacts; MiB of the stored matrices, and of the process at its peak, in either form.

    unknowns, half_bandwidth : of the finite-element model, without a condensation. stored : whether the cache
    has the dense matrices of the joint and they fit into memory.
    """

    n: int
    m: int
    dense_mib: float
    dense_peak_mib: float
    sparse_mib: float
    sparse_peak_mib: float
    unknowns: int
    half_bandwidth: int | None = None
    stored: bool = False

    def peak_mib(self, form: Form) -> float:
        return self.dense_peak_mib if form in DENSE_FORMS else self.sparse_peak_mib


def size_of(scene: Scene) -> Size | None:
    """The size of a joint of plates or of sparse matrices; None for dense arrays, already in memory."""
    return _size(scene, models_of(scene), stored=True)


def form_of_stages(scene: Scene) -> Form:
    """The form in which the stages before the last are solved: the sparse one, unless matrices are dense."""
    models = models_of(scene)
    sparse = _size(scene, models, stored=False) or any(model.dependent for model in models)
    return "sparse" if sparse else "dual"


def _size(scene: Scene, models: Sequence["Model"], stored: bool) -> Size | None:
    """stored : whether to look for the dense matrices in the cache."""
    if isinstance(scene, JointScene) and isinstance(scene.joint, Joint):
        size = _of_joint(scene, scene.joint)
    elif (assembly := models[-1].stored_sparse) is not None:
        size = _of_given(assembly)
    else:
        return None
    usable = stored and isinstance(scene, JointScene) and size.dense_peak_mib <= physical_memory_mib()
    return replace(size, stored=usable and all(model.built for model in models))


def _of_given(assembly: Assembly) -> Size:
    """The size of sparse matrices, from the number of entries of the factors of K."""
    K = assembly.K.matrix
    blocks = [rows.stop - rows.start for rows in dense_slices(K)]
    sparse = 8 * assembly.K.factor_nonzeros / MIB
    peak = PROCESS_MIB + FACTORS * sparse + BYTES_PER_ENTRY * K.nnz / MIB
    return Size(assembly.n, assembly.m, *_dense(blocks, assembly.m), sparse, peak, assembly.n)


def _dense(blocks: Sequence[int], m: int) -> tuple[float, float]:
    """MiB of K, its factors and Q; and of the process at its peak, with copies of the largest block and Q."""
    stored = 8 * (2 * sum(block**2 for block in blocks) + m**2) / MIB
    return stored, PROCESS_MIB + stored + 8 * (max(blocks) ** 2 + m**2) / MIB


def _of_joint(scene: JointScene, joint: Joint) -> Size:
    """The size of a joint, from the numbering of the full model.

    Springs between parts are assumed to join all parts to one block. An element joins a node, with 4
    unknowns, to the next one on the next line: the half-bandwidth is 4 (nodes per line + 1) + 3.
    """
    tied = any(isinstance(effect, SpringEffect) for effect in scene.effects)
    (n, m), (nx, ny) = joint.size, joint.junction.nodes
    dense = _dense([n] if tied else [joint.node_count] * len(joint.part), m)
    # The lines y = const of each part's mesh that are not clamped.
    lines = [
        ny + sum(side.elements for side in (part.south, part.north) if side) - len(set(part.clamped))
        for part in joint.part
    ]
    blocks = [lines] if tied else [[count] for count in lines]
    bands = [(4 * nx * sum(block), 4 * min(sum(block), nx * len(block)) + 7) for block in blocks]
    entries = sum(size * (min(width, GENERAL * log2(size / 4)) + 1) for size, width in bands)
    unknowns = sum(size for size, _ in bands)
    peak = PROCESS_MIB + (MODEL_BYTES * unknowns + 8 * FACTORS * entries) / MIB
    return Size(n, m, *dense, 8 * entries / MIB, peak, unknowns, max(width for _, width in bands))


def refuse_what_cannot_fit(scene: Scene, size: Size | None, form: Form) -> None:
    """Raise InputError where a form's matrices of a scene need more memory than this machine has."""
    physical = physical_memory_mib()
    if size is None or size.peak_mib(form) <= physical:
        return
    allowed = f"a {form} form needs about {size.peak_mib(form):.0f} MiB, this machine has {physical}"
    if form in DENSE_FORMS and size.sparse_peak_mib <= physical:
        allowed += f"; the sparse form (--form sparse) needs {size.sparse_peak_mib:.0f}"
    if isinstance(scene, JointScene) and isinstance(scene.joint, Joint):
        nodes = list(scene.joint.junction.nodes)
        raise InputError.one(scene.name, "junction.nodes", nodes, f"fewer nodes: {allowed}")
    raise InputError.one(scene.source_of("K"), "K", f"{size.n} unknowns", allowed)


@dataclass(frozen=True)
class Choice:
    """A form, and a sentence that says why; "" where there was no choice."""

    form: Form
    why: str = ""


def chosen_form(scene: Scene, taken: Sequence[Form], form: Form | None, cases: int = 1) -> Choice:
    """The form that the user names, else that of the rule, for a solver that takes some forms.

    Raises InputError if the solver does not take it, or if this machine's memory cannot hold it.
    """
    if form is not None and form not in taken:
        raise InputError.one("--form", "form", form, f"the solver takes {' and '.join(taken)}")
    models = models_of(scene)
    size = _size(scene, models, stored=form is None)
    if form is None and "sparse" in taken and any(model.dependent for model in models):
        choice = Choice("sparse", "contacts depend on one another")
    else:
        choice = _by_rule(size, taken, cases) if form is None else Choice(form)
    refuse_what_cannot_fit(scene, size, choice.form)
    return choice


def form_of_answer(scene: Scene, form: Form | None) -> Form:
    """The form in which an answer from elsewhere is judged: the one that is named, else primal.

    The x of given matrices is the same in every form: the sparse one is taken where `chosen_form` takes it.
    Raises InputError as that does.
    """
    if form is None and not isinstance(scene, JointScene):
        return chosen_form(scene, ("primal", "sparse"), None).form
    return chosen_form(scene, FORMS, form or "primal").form


def _by_rule(size: Size | None, taken: Sequence[Form], cases: int) -> Choice:
    dense = [form for form in taken if form in DENSE_FORMS]
    if not dense or "sparse" not in taken or size is None:
        return Choice(default_form(dense or taken))
    fits = size.dense_peak_mib <= physical_memory_mib()
    if fits and (size.stored or size.dense_mib <= SMALL_MIB * cases):
        return Choice(default_form(dense))
    return Choice("sparse", f"dense matrices would take {size.dense_mib:.0f} MiB")
