"""What given matrices will need: memory of the dense forms and of the sparse one, before the work."""

from __future__ import annotations

from dataclasses import dataclass

from harness.results.machine import physical_memory_mib
from problems.errors import InputError
from problems.forms.names import DENSE_FORMS, Form
from problems.input.stored_matrices import SMALL, holds_sparse, stored_matrices
from problems.model.scene import MadeScene, MatricesScene
from problems.stiffness.operator import dense_slices

MIB = 2**20
BYTES_PER_ENTRY = 200  # of K and its copies in sparse storage
FACTORS = 2  # at a time: to solve with, and to prove λmin


@dataclass(frozen=True)
class OwnSize:
    """n unknowns, m contacts, entries of K; MiB at the peak; operations of the first answer."""

    n: int
    m: int
    entries: int
    dense_mib: float
    sparse_mib: float
    dense_flops: float
    sparse_flops: float

    def mib(self, form: Form) -> float:
        return self.dense_mib if form in DENSE_FORMS else self.sparse_mib


def own_size(scene: MatricesScene | MadeScene) -> OwnSize | None:
    """Of matrices that are sparse; None if K is an array, which then fits, or small."""
    if isinstance(scene, MadeScene):
        if not scene.sparse or sum(scene.block_sizes) <= SMALL:
            return None
        assembly = scene.made.assembly
    else:
        files = dict(scene.files)
        if not holds_sparse(files):
            return None
        assembly = stored_matrices(files, scene.assembly_key, sparse=True)[0]
    K, m = assembly.K.matrix, assembly.m
    sizes = [rows.stop - rows.start for rows in dense_slices(K)]
    dense = 8 * (2 * sum(size**2 for size in sizes) + max(sizes) ** 2 + 2 * m**2)
    sparse = 8 * FACTORS * assembly.K.numbers + BYTES_PER_ENTRY * K.nnz
    return OwnSize(
        assembly.n,
        m,
        K.nnz,
        150 + dense / MIB,
        150 + sparse / MIB,
        float(sum(size**3 for size in sizes)) + m**3 / 3,
        2.0 * assembly.K.work,
    )


def refuse_own(scene: MatricesScene | MadeScene, form: Form) -> None:
    """Raise InputError where a form's matrices need more memory than this machine has."""
    size = own_size(scene)
    physical = physical_memory_mib()
    if size is None or size.mib(form) <= physical:
        return
    allowed = f"a {form} form needs about {size.mib(form):.0f} MiB, this machine has {physical}"
    if form in DENSE_FORMS and size.sparse_mib <= physical:
        allowed += f"; the sparse form (--form sparse) needs {size.sparse_mib:.0f}"
    raise InputError.one(scene.source_of("K"), "K", f"{size.n} unknowns, {size.entries} entries", allowed)
