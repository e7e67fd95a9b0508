"""The model of a joint of superelements: K from their files, A from their pairing, f and g from the effects.

    min ½xᵀKx − fᵀx   subject to   Aᵀx ≤ g,    K = blockdiag(K_1, …, K_p) + T diag(k) Tᵀ

x are all unknowns that the parts kept; nothing is condensed. T and k are the springs of installed fasteners.
They must hold the free rigid motions of the parts, K_i r = 0: with N a basis of these, NᵀT diag(k) TᵀN is
positive definite.
"""

import time
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems import storage
from problems.errors import Fault, InputError
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.dependence import is_dependent, refuse_dependent
from problems.forms.preparation_stages import DensePrepared, SparsePrepared
from problems.input.matrix_entries import DENSEST
from problems.input.user_matrices import SMALL
from problems.reporter import SILENT, Reporter
from problems.stiffness import Vector, balanced_units
from problems.stiffness.operator import Stiffness

from .effect import Effect
from .interface import places_of
from .junction_terms import junction_load
from .scene import JointScene
from .springs import Springs
from .superelement_joint import SuperelementJoint

MUST_BE_HELD = "no free rigid motion: hold the part before it is reduced, or by installed_fasteners"
HELD = 1e-9  # of the stiffest motion that springs hold: a softer one is not held


@dataclass(frozen=True)
class SuperelementModel:
    """The matrices of a joint of superelements, with the methods of JointModel."""

    scene: JointScene
    joint: SuperelementJoint

    @classmethod
    def of(cls, scene: JointScene) -> "SuperelementModel":
        """The model of a scene. Raises InputError if parts are free."""
        assert isinstance(scene.joint, SuperelementJoint)
        model = cls(scene, scene.joint)
        model._refuse_free()
        return model

    @cached_property
    def A(self) -> sp.csc_array:
        return self.joint.contact_matrix()

    @cached_property
    def dependent(self) -> bool:
        """Whether contacts depend on one another, as where three parts meet at one place."""
        return is_dependent(self.A, self._units)

    @property
    def _units(self) -> Vector:
        """The units (n,) in which K is balanced."""
        parts = [part.stiffness.diagonal() for part in self.joint.parts]
        return balanced_units(np.concatenate(parts) + self.springs.added.diagonal())

    @cached_property
    def springs(self) -> Springs:
        return Springs.of(self.scene)

    @property
    def stored_sparse(self) -> Assembly | None:
        """The sparse assembly, if every large K is stored as a sparse matrix and there is one."""
        large = [part.sparse for part in self.joint.parts if part.size > SMALL]
        return self.sparse().assembly if large and all(large) else None

    def sparse(self) -> SparsePrepared:
        """K and A as sparse matrices. Raises InputError if a large K is dense."""
        start = time.perf_counter()
        for part in self.joint.parts:
            if part.size > SMALL and not part.sparse and not self.dependent:
                allowed = f"at most {DENSEST:.0%} of its entries nonzero: use --form dual or primal"
                raise InputError.one(part.file, "K", "dense", allowed)
        matrices = [sp.csc_array(part.stiffness) for part in self.joint.parts]
        added, blocks = self.springs.added, []
        for group in self.springs.ranges:
            rows = self.springs.rows(group)
            K = sp.block_diag([matrices[part] for part in group], format="csc")
            blocks.append(sp.csc_array(K + added[rows, rows] if self.springs else K))
        seconds = time.perf_counter() - start
        source_of = self.scene.source_of
        return SparsePrepared(self._assembly(blocks), seconds, source_of, refuses_singular=True)

    def dense(self, reporter: Reporter = SILENT) -> DensePrepared:
        """K with dense blocks. Raises InputError if contacts depend on one another."""
        refuse_dependent(self.A, self._units, self.scene.source_of("A"), self.joint.contact_name)
        start = time.perf_counter()
        matrices = [part.stiffness for part in self.joint.parts]
        blocks = [K.toarray(order="F") if sp.issparse(K) else K for K in matrices]
        before = {"condensation": time.perf_counter() - start}
        if self.springs:
            blocks, before["ties"] = self.springs.blocks(self._key, blocks, reporter)
        return DensePrepared(self._assembly(blocks), self._key, before, self.scene.source_of, reporter)

    @property
    def built(self) -> bool:
        return (not self.springs or storage.load(self._key) is not None) and self.dense().built

    def load_case(self, sparse: bool, effects: Iterable[Effect] | None = None) -> LoadCase:
        """f (n,), N and N·mm, and g (m,) mm."""
        return LoadCase(*junction_load(self.scene.effects if effects is None else effects, self.joint))

    @property
    def _key(self) -> str:
        key = storage.digest("superelements", [part.key for part in self.joint.parts])
        return self.springs.key(key) if self.springs else key

    def _assembly(self, blocks: list[Any]) -> Assembly:
        joint = self.joint
        inplane = [(part.nodes.xyz @ joint.axes.T)[part.node, :2] for part in joint.parts]
        nodes = np.concatenate(inplane)
        names = tuple(" + ".join(joint.names[part] for part in group) for group in self.springs.ranges)
        notes = tuple(note for part in joint.parts for note in part.notes)
        places = places_of(joint, joint.pairs)
        return Assembly(Stiffness.of(*blocks, nodes=nodes), self.A, nodes, names, notes, places=places)

    def _refuse_free(self) -> None:
        joint, motions = self.joint, [part.free for part in self.joint.parts]
        owner = np.repeat(np.arange(len(motions)), [N.shape[1] for N in motions])
        if not len(owner):
            return
        held = self.springs.T.T @ sp.block_diag(motions, format="csr")
        S = (held.T @ sp.diags_array(self.springs.k) @ held).toarray()
        w, V = np.linalg.eigh((S + S.T) / 2)
        loose = V[:, w <= HELD * max(w[-1], 0.0)]
        faults = []
        for k, (part, N) in enumerate(zip(joint.parts, motions, strict=True)):
            shares = loose[owner == k]
            Q, s, _ = np.linalg.svd(shares, full_matrices=False)
            if shares.size and (s > HELD).any():
                motion = part.named(N @ Q[:, s > HELD])
                faults.append(Fault(str(part.file), f"part.{part.name}", motion, MUST_BE_HELD))
        if faults:
            raise InputError(faults)
