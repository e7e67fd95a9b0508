"""A scene: a joint with its effects, a user's matrices, or matrices constructed for a rung of a ladder."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np

from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector
from problems.input.bounded_types import Truth
from problems.storage import digest

from .effect import Effect, StiffnessEffect
from .interface import AnyJoint
from .joint import Table
from .stages import Stage

E = TypeVar("E", bound=Effect)


class Output(Table):
    """The table [output]: what an answer has besides displacements, gaps and forces."""

    stress: Truth = False


GAPS_ALONE = Output()


@dataclass(frozen=True)
class PrintedOptimum:
    """The objective ½xᵀKx − fᵀx at the solution as a source prints it, and the number of digits."""

    value: float
    digits: int
    source: str


@dataclass(frozen=True)
class Scene(ABC):
    """A checked scene, made by `load_scene` or `own_matrices`.

    Parameters
    ----------
    name : str
        Its name, or the path of its file.
    title : str
        One line on what it is.
    on_ladder : bool
        Whether it is a rung, whose limit follows its conditioning.
    refused : str
        Text of the InputError that building this rung must raise; "" if it must not raise one.
    printed : PrintedOptimum, optional
        The optimum that the source of the problem prints.
    sources : tuple of Path
        The files that it was read from, which no output may replace.
    """

    name: str
    title: str
    _: KW_ONLY
    on_ladder: bool = False
    refused: str = ""
    printed: PrintedOptimum | None = None
    sources: tuple[Path, ...] = field(default=(), repr=False, compare=False)

    @property
    @abstractmethod
    def assembly_key(self) -> str:
        """Hash of everything that determines K and A."""

    @property
    @abstractmethod
    def key(self) -> str:
        """Hash of everything that determines K, A, f and g."""

    @property
    @abstractmethod
    def expected_size(self) -> tuple[int, int] | None:
        """Numbers (n, m) of unknowns and contacts; None if that takes reading the matrices."""

    @property
    def stages(self) -> tuple[Stage, ...]:
        """By default all effects act at once; see `stage_answers.through`."""
        return ()

    @property
    def output(self) -> Output:
        """The parts of an answer besides displacements, gaps and forces; in no key."""
        return GAPS_ALONE

    @property
    def unusual(self) -> list[str]:
        """A sentence on each parameter that is possible but rarely meant."""
        return []

    def source_of(self, matrix: str) -> object:
        """The origin of a matrix, for error messages."""
        return f"scene {self.name}"

    def marks(self) -> Matrix:
        """(k, 2) points in mm that a picture of the junction should mark."""
        return np.zeros((0, 2))


@dataclass(frozen=True)
class JointScene(Scene):
    """A joint and the effects that the scene includes.

    random : the table [random], each entry as KEY=DISTRIBUTION, in no key; `GapCases` draws them.
    origin : of each effect of a stage its number in the scene, and its elements that act; else ().
    model : see `problems.build.model_of`; neither copied nor sent to a worker.
    """

    joint: AnyJoint
    effects: tuple[Effect, ...] = ()
    stages: tuple[Stage, ...] = ()
    output: Output = GAPS_ALONE
    random: tuple[str, ...] = ()
    origin: tuple[tuple[int, tuple[int, ...]], ...] = ()
    model: Any = field(default=None, init=False, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"model": None}

    @property
    def numbers(self) -> tuple[tuple[int, tuple[int, ...]], ...]:
        """The number and the acting elements of each effect: `origin`, or if that is empty all elements."""
        counts = enumerate(effect.element_count(self.joint) for effect in self.effects)
        return self.origin or tuple((i, tuple(range(count))) for i, count in counts)

    def effects_of(self, kind: type[E]) -> Iterator[E]:
        """The effects of one class, in the scene's order."""
        return (effect for effect in self.effects if isinstance(effect, kind))

    @property
    def stiffness_effects(self) -> tuple[StiffnessEffect, ...]:
        return tuple(self.effects_of(StiffnessEffect))

    @property
    def assembly_key(self) -> str:
        return digest(self.joint.content, [plain(effect) for effect in self.stiffness_effects])

    @property
    def key(self) -> str:
        loads = [plain(effect) for effect in self.effects if not isinstance(effect, StiffnessEffect)]
        if not self.stages:
            return digest(self.assembly_key, loads)
        names = [[effect.name, effect._stages] for effect in self.effects]
        order = [stage.name for stage in self.stages] if any(words for _, words in names) else []
        return digest(self.assembly_key, loads, names + order, [plain(stage) for stage in self.stages])

    @property
    def expected_size(self) -> tuple[int, int]:
        return self.joint.size

    @cached_property
    def unusual(self) -> list[str]:
        told = [("joint", self.joint.unusual())]
        told += [(effect.kind, effect.unusual(self.joint)) for effect in self.effects]
        if not self.stages:
            usual = [("stage", "a column", "in a scene with stages; here all points act at once")]
            told += [(effect.kind, iter(usual)) for effect in self.effects if any(effect._stages)]
        usual = [("table", "that of an effect above", "another one: both act")]
        always = [one for one in self.effects if not (self.stages and (one.name or one._stages))]
        tables = [vars(one) | {"name": None} for one in always]
        told += [(one.kind, iter(usual)) for k, one in enumerate(always) if tables[k] in tables[:k]]
        return [
            f"{where}.{key} = {shown} is unusual; usual is {usual}"
            for where, some in told
            for key, value, usual in some
            for shown in [value if isinstance(value, list | str) else f"{value:g}"]
        ]

    def marks(self) -> Matrix:
        return np.concatenate([super().marks(), *(effect.marks(self.joint) for effect in self.effects)])


@dataclass(frozen=True)
class MatricesScene(Scene):
    """The files of a user's matrices: ("problem", x.npz), or one for each of K, A, f and g."""

    files: tuple[tuple[str, Path], ...]

    @property
    def assembly_key(self) -> str:
        from problems.input.user_matrices import content_key  # only for own matrices

        return content_key(dict(self.files))

    @property
    def key(self) -> str:
        return digest(self.assembly_key, [])

    @property
    def expected_size(self) -> None:
        return None

    def source_of(self, matrix: str) -> object:
        own = dict(self.files)
        return own.get("problem") or own.get(matrix)


@dataclass(frozen=True, eq=False)
class ManufacturedProblem:
    """Matrices and load case of a rung without plates, with the exact solution if it is known.

    x (n,), lam (m,) : K x + A λ = f, Aᵀx ≤ g, λ ≥ 0, λᵀ(g − Aᵀx) = 0 hold exactly for these numbers, without
        any rounding; None if the solution is unknown.
    unit_mm (n,), gap_unit_mm (m,) : the length of one unit of x and of g, mm.
    """

    assembly: Assembly
    load: LoadCase
    x: Vector | None = None
    lam: Vector | None = None
    unit_mm: Vector | float = 1.0
    gap_unit_mm: Vector | float = 1.0


@dataclass(frozen=True)
class ManufacturedScene(Scene):
    """Matrices constructed in memory: a rung of a ladder without plates, or a user's own.

    make : makes the same problem at every call. block_sizes : the number of unknowns of each block of K.
    m : the number of contacts. sparse : whether K's blocks are sparse.
    refuses_singular : whether K is refused if it is nearly singular.
    """

    make: Callable[[], ManufacturedProblem]
    block_sizes: tuple[int, ...]
    m: int
    sparse: bool = False
    refuses_singular: bool = False

    @classmethod
    def of(cls, title: str, problem: ManufacturedProblem, name: str = "", refused: str = "") -> Self:
        """The scene of a problem that is already made: a user's own, or a small rung of a ladder."""
        K, m = problem.assembly.K, problem.assembly.m
        sizes = tuple(block.size for block in K.blocks)
        return cls(
            name, title, lambda: problem, sizes, m, not K.dense, refused=refused, refuses_singular=True
        )

    @property
    def made(self) -> ManufacturedProblem:
        """The problem; only the last one made stays in memory."""
        return _made(self.make)

    @cached_property
    def assembly_key(self) -> str:
        assembly = self.made.assembly
        A = assembly.A
        arrays = (*assembly.K.arrays, A.data, A.indices, A.indptr)
        return digest([assembly.n, assembly.m], *(array.tobytes() for array in arrays))

    @property
    def key(self) -> str:
        return digest(self.assembly_key, self.made.load.f.tobytes(), self.made.load.g.tobytes())

    @property
    def expected_size(self) -> tuple[int, int]:
        return sum(self.block_sizes), self.m


@lru_cache(maxsize=1)
def _made(make: Callable[[], ManufacturedProblem]) -> ManufacturedProblem:
    return make()


def plain(table: Table) -> dict[str, Any]:
    """The table as JSON, for keys, without its name.

    `on_nodes = true` is left out, so that published keys stay valid.
    """
    data = table.model_dump(mode="json", exclude={"name"})
    if (data.get("pattern") or {}).get("on_nodes"):
        del data["pattern"]["on_nodes"]
    return data
