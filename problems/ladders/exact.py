"""Two parts with an exact solution: spectra, contacts that hardly count, nearly equal contacts, units.

conditioning    ever wider spectra: cond(K) from 1e6 to 1e14
degeneracy      ever more weakly active contacts: λᵢ = yᵢ = 0 in the solution
duplicates      nearly equal columns of A, in the end exact copies: a duplicate touches the second part
                slightly beside the node of the original. At 2⁻¹⁶ a pivot of Q would be within the rounding of
                the 3184 contacts of n = 6112
coincident      two nodes of a part that nearly coincide: a spring between them, ever stiffer than the part
units           the same problem in other units, and with a unit for each unknown and contact. Powers of two
                replace the thousands (1024 mm for a metre), so that nothing is rounded
contact_scale   columns of A and gaps multiplied by 2^−k to 2^k, so that 1 mm is 2^±k in g: the meaning of a
                solver's tolerance then differs from contact to contact; the answer in mm and N does not
together        cond(K) grows, a quarter of the contacts are weakly active, each has its own unit
"""

from dataclasses import replace
from functools import partial

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import LoadCase, Vector
from problems.model.scene import ManufacturedProblem
from problems.stiffness.operator import Stiffness

from . import Ladder, Scene, matrices
from .manufactured import contacts, deferred, exact_assembly, spectrum, two_parts

Units = Vector | float
KILO, MEGA = 2.0**10, 2.0**20


def _conditioned(n: int, seed: int, condition: float) -> Scene:
    return deferred(f"Two parts, cond(K) = {condition:g}", n, condition, seed)


def _beyond(condition: float) -> Scene:
    """A rung that is refused, so that K need not be exact."""
    d = spectrum(64, condition)
    problem = ManufacturedProblem(exact_assembly(d, d), two_parts(1, 1.0, seed=1).load)
    return matrices(f"Two parts, cond(K) = {condition:g}", problem, refused="K must be positive definite")


def _degenerate(n: int, percent: int) -> Scene:
    weak, title = percent / 100, f"Two parts, {percent} % of the contacts touch without a force"
    return deferred(title, n, 1e6, seed=2, closed=min(0.4, 1 - weak), weak=weak)


def _duplicated(n: int, duplicated: int, tilt: float) -> Scene:
    how = f", {tilt:.0e} apart" if tilt else " exactly"
    refused = "" if tilt else "must not depend on the columns before it"
    A = contacts(n // 2, duplicated, tilt)
    return deferred(f"Two parts, {duplicated} contacts duplicated{how}", n, 1e4, 3, A, refused)


def _coincident(bits: int) -> Scene:
    """K += k bbᵀ and f += k b(bᵀx) with b = e₀ − e₁: the same solution, still without rounding."""
    made, spring = two_parts(64, 1e4, seed=4), 2.0**bits  # N/mm; the part's largest eigenvalue is 64e4
    assert made.x is not None
    first, *others = made.assembly.K.matrices
    b = np.zeros(len(first))
    b[:2] = 1.0, -1.0
    K = Stiffness.of(np.asfortranarray(first + spring * np.outer(b, b)), *others)
    f = made.load.f.copy()
    f[: b.size] += spring * b * (b @ made.x[: b.size])
    tied = replace(made, assembly=replace(made.assembly, K=K), load=LoadCase(f, made.load.g))
    return matrices(f"Two parts, two nodes tied by {spring:.0e} N/mm", tied)


def _in_units(title: str, S: Units = 1.0, C: Units = 1.0, v: float = 1.0) -> Scene:
    return matrices(f"Two parts, {title}", rescaled(two_parts(64, 1e6, seed=5), S, C, v))


def _random_units(title: str, unknowns: int, contacts: int) -> Scene:
    """Scalings from 2^−k to 2^k."""
    random = np.random.default_rng(6)
    S = np.exp2(random.integers(-unknowns, unknowns + 1, 128))
    return _in_units(title, S, np.exp2(random.integers(-contacts, contacts + 1, 64)))


def _contact_scale(k: int) -> Scene:
    C = np.exp2(np.random.default_rng(9).integers(-k, k + 1, 64))
    title = f"Two parts, each contact in a unit of its own, 2^−{k} to 2^{k} mm"
    return matrices(title, rescaled(two_parts(64, 1e4, seed=9), 1.0, C))


def _together(condition: float) -> Scene:
    made = two_parts(64, condition, seed=14, weak=0.25)
    C = np.exp2(np.random.default_rng(15).integers(-5, 6, made.assembly.m))
    title = f"Two parts, cond(K) = {condition:g}, contacts without a force, each in its own unit"
    return matrices(title, rescaled(made, 1.0, C))


def rescaled(made: ManufacturedProblem, S: Units, C: Units, v: float = 1.0) -> ManufacturedProblem:
    """The problem in x' = S⁻¹x and λ' = C⁻¹λ/v, with S, C and v powers of two: K' = SKS/v, A' = SAC,
    f' = Sf/v and g' = Cg.
    """
    assert made.x is not None
    assert made.lam is not None
    K, A = made.assembly.K, made.assembly.A
    S, C = np.broadcast_to(S, A.shape[0]), np.broadcast_to(C, A.shape[1])
    parts = zip(K.matrices, K.slices, strict=True)
    blocks = [np.asfortranarray(S[rows, None] * block * S[rows] / v) for block, rows in parts]
    A = sp.csc_array(sp.diags_array(S) @ A @ sp.diags_array(C))
    load = LoadCase(S * made.load.f / v, C * made.load.g)
    assembly = replace(made.assembly, K=Stiffness.of(*blocks), A=A)
    return ManufacturedProblem(assembly, load, made.x / S, made.lam / (C * v), S.copy(), 1 / C)


RUNGS: dict[str, Ladder] = {
    "conditioning": {
        **{f"{c:.0e}": partial(_conditioned, 128, 1, c) for c in (1e6, 1e8, 1e10, 1e12, 1e13, 9e13)},
        "1e+16": partial(_beyond, 1e16),
    },
    "degeneracy": {f"{k:03d}": partial(_degenerate, 128, k) for k in (5, 10, 25, 50, 75, 100)},
    "duplicates": {
        **{f"{2.0**-bits:.0e}": partial(_duplicated, 128, 8, 2.0**-bits) for bits in (4, 8, 12, 16)},
        "copies": partial(_duplicated, 128, 8, 0.0),
    },
    "coincident": {f"{2.0**bits:.0e}": partial(_coincident, bits) for bits in (22, 27, 32, 37, 42, 45)},
    "units": {
        "mm-N": partial(_in_units, "mm and N"),
        "mm-kN": partial(_in_units, "mm and 1024 N", v=KILO),
        "mm-MN": partial(_in_units, "mm and 1024² N", v=MEGA),
        "m-N": partial(_in_units, "1024 mm and N", S=KILO, C=1 / KILO, v=KILO),
        "um-N": partial(_in_units, "1/1024 mm and N", S=1 / KILO, C=KILO, v=1 / KILO),
        "unknowns": partial(_random_units, "each unknown in its own unit, 1/16 to 16 mm", 4, 0),
        "contacts": partial(_random_units, "each contact in its own unit, 1/1024 to 1024 mm", 0, 10),
        "both": partial(_random_units, "each unknown and contact in its own unit", 4, 10),
    },
    "contact_scale": {f"{k:02d}-bits": partial(_contact_scale, k) for k in (5, 10, 20, 30, 40)},
    "together": {f"{c:.0e}": partial(_together, c) for c in (1e4, 1e6, 1e8, 1e10, 1e12)},
}
FULL_SIZE: dict[str, Ladder] = {
    "conditioning": {f"4386-{c:.0e}": partial(_conditioned, 4386, 2, c) for c in (1e8, 1e10, 1e11, 1e12)},
    "degeneracy": {
        f"{n}-{k:03d}": partial(_degenerate, n, k)
        for n, k in ((4386, 25), (4386, 50), (4386, 75), (4386, 100), (11308, 50))
    },
    "duplicates": {
        f"{n}-{2.0**-bits:.0e}": partial(_duplicated, n, 128, 2.0**-bits)
        for n, bits in ((6112, 4), (6112, 8), (6112, 10), (6112, 12), (11308, 12))
    },
}
