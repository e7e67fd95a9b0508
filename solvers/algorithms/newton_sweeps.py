"""Active-set Newton in sweeps: contact sets with a banded M ≈ Q⁻¹, corrected by one product with Q each.

    λ ≥ 0,   y = Qλ − p ≥ 0,   λᵀy = 0

From (λ, y), y exact, the next point solves the problem with Q replaced by M⁻¹, y⁺ = y + M⁻¹(λ⁺ − λ), or

    λ⁺ = (λ − My) + My⁺ ≥ 0,   y⁺ ≥ 0,   λ⁺ᵀy⁺ = 0,

by a few contact sets of block principal pivoting, each a band factorisation, and takes y = Qλ⁺ − p, for all
load cases in one product. A sweep reduces the error by max|1 − eig(MQ)|, about 0.1 on a joint of plates. On a
set that no longer changes, sweeps are steps of the conjugate gradient method preconditioned with M, and y
follows by its change Q(λ⁺ − λ), whose rounding shrinks with the step. The rounding of a fresh Qλ⁺ − p would
return in every sweep, amplified in soft modes by up to √cond(Q). `doubt` bounds
the rounding that y has accumulated; above twice that of a fresh Qλ − p, y is recomputed.

A case starts from λ + αw, w = D⁻¹Aᵀδf, D = diag(AᵀA), where δf is the change of the load since the solved
case, or the whole load. The forces of fasteners on two parts are a sum of columns of A: then δf = Aw,
Qw = δp + δg takes no product, and α = 1 leaves x as it was. The sweeps correct what contacts cannot carry.
α in [0, 1] minimises ½λᵀQλ − pᵀλ.

An edge of contact creeps by about a row of contacts per set. If the first sets creep, the set of yielding
contacts (`contact_sets.yielding_set`), whose edges move further, or that of an interior point
(`interior_set`) where there is no banded M, replaces them. Far from the solution a product corrects more
than further sets, so the limit on the sets of a sweep grows from sweep to sweep.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from problems.forms.assembly import Mask, Vector
from problems.forms.prepared import Prepared
from solvers.base import Answer, DualLoadCase, DualStart, Status
from solvers.kkt import EPS, dual_answer, is_small, kkt_errors, rounding_bound, rounding_of

from .block_pivoting import ROUNDING_FACTOR, TrialSolution, block_pivoting, wrong_signs
from .closed_sets import ClosedSets
from .contact_sets import ContactSprings, OpenFactor, banded_set, yielding_set

MAX_SWEEPS = 200
FIRST_SETS, GROWTH = 5, 1.1  # contact sets in the first sweep, and their growth per sweep
LATE = 6  # the sweep before which sets of a dense Q, bordered from one to the next, may creep
PATIENCE = 3  # contact sets of the first sweep before creeping edges change the method
TARGET = 0.02  # of the tolerance: the |y_C| of a settled case; x can be off by some hundred times that
STALLED, STALLED_MM = 3, 1e-8  # sweeps that do not halve a residual below the second number: rounding
SMALL = 2.0  # largest doubt, in units of the rounding of a fresh y
STEP_RANGE = 0.5, 2.0  # allowed factors of a step on an unchanged set; beyond them it is rounding


@dataclass
class Case:
    """A load case during the sweeps, its vectors in the order of M.

    C : its contact set. trial : λ (m,) N, y (m,) mm, and |y_C|. factor : of M on the open contacts.
    last_step : the last step and Q times it, if it left the set unchanged. residual : max(|y_C|, max(−y)).
    stalled : sweeps in succession that did not halve it. settled : whether every sign is right and the
    residual small enough. doubt : a bound of the rounding that y has accumulated since it was last computed
    from λ, mm, of each contact; infinite if y is not known. products : with Q, not with parts of it.
    """

    load: DualLoadCase
    C: Mask
    trial: TrialSolution
    factor: OpenFactor | None = None
    last_step: tuple[Vector, Vector] | None = None
    residual: float = np.inf
    doubt: float | Vector = np.inf
    stalled: int = 0
    settled: bool = False
    sweeps: int = 0
    sets: int = 0
    products: int = 0


@dataclass
class Sweeps:
    """Solves load cases of one assembly with M ≈ Q⁻¹, or with factors of Q_CC or K where there is no M.

    diagonal : of Q, or about that, (m,) mm/N. order : of the contacts in M. compliance : the diagonal in this
    order. last : the cases solved last, from which the next ones start. most : the limit on sweeps. log :
    takes the figures of each sweep.

    A case is settled when no q_ii λ_i on C and no y_i off it is below −max(10 |y_C|, ρ_i), ρ the rounding of
    Qλ − p (`kkt.rounding_bound`), and |y_i| on C and −y_i off it are at most 0.02 tolerance; or at most
    max(tolerance, 10ρ_i) where the largest does not halve any more, or 1e-8 mm where it has not for three
    sweeps.
    """

    prepared: Prepared
    last: list[Case] = field(default_factory=list)
    most: int = MAX_SWEEPS
    log: Callable[..., None] = lambda **figures: None

    def __post_init__(self) -> None:
        near = self.prepared.approximate_inverse
        self.M, self.diagonal, self.gaps = near.M, near.diagonal, self.prepared.gaps
        self.order = np.arange(len(near.diagonal)) if near.M is None else near.M.order
        self.compliance = near.diagonal[self.order]
        self.A = self.prepared.assembly.A
        self.squares = np.asarray(self.A.power(2).sum(axis=0)).ravel()

    @cached_property
    def sets(self) -> ClosedSets | ContactSprings:
        """The replacement of M where there is none: Q, or factors of K with springs."""
        Q = self.prepared.Q_of_sets
        if Q is None:
            return ContactSprings(self.prepared)
        return ClosedSets(Q, self.prepared.assembly.contact_nodes)

    def __call__(self, loads: Sequence[DualLoadCase], tolerance: float) -> list[Answer]:
        """The answers to several loads, solved together, each from the nearest of the last cases."""
        nearest = [min(self.last, key=partial(_distance, load)) for load in loads if self.last]
        self.last = self.together(loads, tolerance, nearest)
        return [self.answer(case, tolerance) for case in self.last]

    def together(
        self, loads: Sequence[DualLoadCase], tolerance: float, starts: Sequence[Case] = ()
    ) -> list[Case]:
        """The cases of several loads, solved together. starts : a solved case for each load; by default all
        start from the solution of the first load.
        """
        first = [] if starts else [self.solved(loads[0], tolerance)]
        cases = self._sweep(self._begun(starts or first * len(loads), loads), tolerance)
        cases[0].products += sum(case.products for case in first)
        for case in cases:
            case.factor = None  # as large as M for each; the next cases have other sets
        return cases

    def solved(
        self, load: DualLoadCase, tolerance: float, start: DualStart | None = None, C: Mask | None = None
    ) -> Case:
        """The solved case of a load. start : the case it starts from. C : its first contact set."""
        order = self.order
        if start is None:
            zero = np.zeros(len(order))
            nothing = Case(load - load, zero > 0, TrialSolution(zero, zero, 0.0), doubt=0.0)
            (case,) = self._begun([nothing], [load])
            with self._counted(case):
                case.C = case.C | (case.trial.y < 0) if self.M is not None else self.sets.first_set(load)
        else:
            lam, y = start.lam[order], start.gap[order]
            solved = Case(start.load, self.compliance * lam > y, TrialSolution(lam, y, 0.0))
            (case,) = self._begun([solved], [load])
        if C is not None:
            case.C = C[order]
        return self._sweep([case], tolerance)[0]

    @contextmanager
    def _counted(self, case: Case) -> Iterator[None]:
        """Count the products with Q of the sets meanwhile."""
        before = self.sets.products.made if self.M is None else 0
        yield
        case.products += self.sets.products.made - before if self.M is None else 0

    def answer(self, case: Case, tolerance: float) -> Answer:
        """The answer of a solved case. Iterations are sweeps, inner iterations sets tried with M; details
        count the products with Q.

        "solved" if the errors, −y and |y| where λ > 0, are at most max(tolerance, `kkt.rounding_bound`) mm. y
        is recomputed from λ if they and `doubt` exceed the tolerance, or if a force was below zero.
        """
        lam, y = self.vectors(case)
        errors = kkt_errors(lam, y)
        errors[self.order] += case.doubt
        if (errors > tolerance).any() or (case.trial.lam < 0).any():
            errors = kkt_errors(lam, self.gaps(lam[:, None], [case.load])[:, 0])
            case.products += 1
        enough = is_small(errors, tolerance, rounding_bound(self.diagonal, case.load.p, lam))
        limit = "" if case.settled else f"{self.most} sweeps"
        status: Status = "solved" if enough else "inaccurate"
        details, counts = {"closed": int(case.C.sum()), "products": case.products}, (case.sweeps, case.sets)
        return dual_answer(status, lam, float(errors.max(initial=0.0)), details, counts, limit)

    def vectors(self, case: Case) -> tuple[Vector, Vector]:
        """λ ≥ 0 (m,) N and y (m,) mm, in the order of A."""
        lam, y = np.empty(len(self.order)), np.empty(len(self.order))
        lam[self.order], y[self.order] = np.maximum(case.trial.lam, 0.0), case.trial.y
        return lam, y

    def _begun(self, solved: Sequence[Case], loads: Sequence[DualLoadCase]) -> list[Case]:
        """Load cases that start from solved ones plus the forces αw of the change of f."""
        changes = [load - case.load for case, load in zip(solved, loads, strict=True)]
        w = np.column_stack([self.A.T @ change.f / self.squares for change in changes])
        uncarried = np.column_stack([change.f for change in changes]) - self.A @ w
        Qw = np.column_stack([change.p + change.g for change in changes])  # where δf = Aw
        some = np.flatnonzero(uncarried.any(axis=0) & w.any(axis=0))
        if len(some):
            Qw[:, some] = self.gaps(np.asfortranarray(w[:, some]), [changes[k] - changes[k] for k in some])
        begun = []
        for k, (case, load) in enumerate(zip(solved, loads, strict=True)):
            force, moved, y = w[self.order, k], Qw[self.order, k], case.trial.y - changes[k].p[self.order]
            share = float(np.clip(-force @ y / (force @ moved or 1.0), 0.0, 1.0))
            force, y = share * force, y + share * moved
            lam = case.trial.lam + force
            C = np.where(force == 0, case.C, lam > 0)
            factor = case.factor and replace(case.factor, room=None)
            trial = TrialSolution(lam, y, float(abs(y).max(initial=0.0)))
            doubt = case.doubt + rounding_bound(self.compliance, load.p[self.order], lam)
            begun.append(Case(load, C, trial, factor, doubt=doubt, products=int(k in some)))
        return begun

    def _sweep(self, cases: list[Case], tolerance: float) -> list[Case]:
        order = self.order
        active = cases
        if self.M is None:
            self.sets.begin()
        for _ in range(self.most):
            steps = []  # λ, whether the set is unchanged, and whether y follows by its change
            for case in active:
                with self._counted(case):
                    lam, same = self._step(case)
                case.products += 1  # of the gaps below
                rounding = rounding_bound(self.compliance, case.load.p[order], lam)
                steps.append((case, lam, same, same and bool((case.doubt <= SMALL * rounding).all())))
            moved = np.empty((len(order), len(active)), order="F")
            moved[order] = np.column_stack(
                [lam - case.trial.lam if change else lam for case, lam, _, change in steps]
            )
            loads = [case.load - case.load if change else case.load for case, _, _, change in steps]
            y = self.gaps(moved, loads)[order].T
            for (case, lam, same, change), gap in zip(steps, y, strict=True):
                # A part of a step would leave λ off C, or keep a part of a y that is not that of its λ.
                whole = same and change and not case.trial.lam[~case.C].any()
                if not change:
                    case.doubt = rounding_of(case.load.p[order], gap)
                self._take(case, lam, case.trial.y + gap if change else gap, whole, tolerance)
                self.log(sweep=case.sweeps, sets=case.sets, closed=case.C.sum(), residual_mm=case.residual)
            active = [case for case in active if not case.settled]
            if not active:
                break
        return cases

    def _step(self, case: Case) -> tuple[Vector, bool]:
        """λ (m,) of the case with Q replaced by M⁻¹, and whether the contact set is unchanged.

        On an unchanged set the step is made conjugate to the last one.
        """
        at: Callable[[Mask], TrialSolution]
        if self.M is None:
            if case.stalled:
                self.sets.begin()  # a border on a set of almost dependent contacts has lost digits
            at = partial(self.sets.set, case.trial)
        else:
            case.factor = case.factor or OpenFactor(self.M)
            at = partial(banded_set, case.factor, case.trial)
        order = self.order
        floor = self._floor(case, case.trial)
        most = int(FIRST_SETS * GROWTH**case.sweeps)
        begins = case.sweeps == (LATE if self.M is None and isinstance(self.sets, ClosedSets) else 0)
        result = block_pivoting(at, case.C, self.compliance, floor, most, PATIENCE if begins else None)
        if begins and result.creeps:
            if self.M is None:
                C, lam, factorisations = self.sets.interior_set(case.load)
                C, lam = C[order], np.where(C, lam, 0.0)
                y = self.gaps(lam[:, None], [case.load])[order, 0]
                case.products += 1
                case.trial = TrialSolution(lam[order], y, float(abs(y[C]).max(initial=0.0)))
                at = partial(self.sets.set, case.trial)
            else:
                C, factorisations = yielding_set(self.M, self.compliance, case.trial), 0
            case.sets += result.passes + factorisations
            result = block_pivoting(at, C, self.compliance, floor, PATIENCE)
        unchanged = not (case.C ^ result.C).any()
        case.C, case.sets = result.C, case.sets + result.passes
        lam = result.trial.lam
        if unchanged and case.last_step is not None:
            step, change = case.last_step
            lam = lam - ((lam - case.trial.lam) @ change / (step @ change)) * step
        return lam, unchanged

    def _floor(self, case: Case, trial: TrialSolution) -> Vector:
        """The rounding of y, mm, below which no sign is wrong: a bound; for products with K⁻¹ an estimate, as
        the bound adds the forces of contacts that are far from each other.
        """
        p = case.load.p[self.order]
        if self.M is None and not self.prepared.assembly.K.dense:
            return rounding_of(p, trial.y)
        return rounding_bound(self.compliance, p, trial.lam)

    def _take(self, case: Case, lam: Vector, y: Vector, unchanged: bool, tolerance: float) -> None:
        """Take λ and y, or a part of the step to them, and decide whether the case is settled."""
        step, change = lam - case.trial.lam, y - case.trial.y
        slope, curvature = float(step @ case.trial.y), float(step @ change)
        case.last_step = None
        if unchanged and curvature > 0:
            share = float(np.clip(-slope / curvature, *STEP_RANGE))
            case.doubt = np.maximum(case.doubt, 4 * EPS * abs(case.trial.y))
            lam, y = case.trial.lam + share * step, case.trial.y + share * change
            case.last_step = step, change
        missed = float(abs(y[case.C]).max(initial=0.0))
        errors = np.where(case.C, abs(y), -y)
        residual = float(errors.max(initial=0.0))
        case.stalled = case.stalled + 1 if residual > case.residual / 2 else 0
        case.trial, case.sweeps = TrialSolution(lam, y, missed), case.sweeps + 1
        case.residual = residual
        floor = self._floor(case, case.trial)
        right = not wrong_signs(case.C, case.trial, self.compliance, floor).any()
        enough, rounding = TARGET * tolerance, np.zeros_like(y)
        if case.stalled:
            enough, rounding = tolerance, ROUNDING_FACTOR * floor
        if case.stalled >= STALLED:
            enough = max(enough, STALLED_MM / case.load.length)
        case.settled = right and is_small(errors, enough, rounding)


def _distance(load: DualLoadCase, case: Case) -> float:
    """‖p − p'‖₂, mm."""
    return float(np.linalg.norm(case.load.p - load.p))
