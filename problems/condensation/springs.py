"""Springs between prepared parts: K + T diag(k) Tᵀ, with its factors and Q.

The parts that springs join become one block. What the parts cost to condense is not spent again.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from problems.build import (
    LARGEST_CONDITION,
    Progress,
    cache_key,
    extreme_eigenvalues,
    factor,
    indefinite,
    schur,
)
from problems.forms.assembly import Assembly, Matrix, Prepared, Vector
from problems.scene import Scene
from problems.storage import cache
from problems.storage.fingerprint import fingerprint


def tied(base: Prepared, scene: Scene, T: sp.csc_array, k: Vector, progress: Progress) -> Prepared:
    """The prepared assembly with springs in the directions T (n, r), of stiffness k (r,) in N/mm.

    From the cache where it stands there. Raises InputError where cond(K) becomes larger than 1e14.
    """
    code = fingerprint([Path(__file__)])
    key = cache.digest("ties", cache_key(scene), T.indices.tolist(), T.data.tolist(), k.tolist(), code)
    found = cache.load(key)
    if found is None:
        with cache.lock(key):
            found = cache.load(key)
            if found is None:
                progress("springs between the parts", 0.0)
                cache.store(key, *_build(base, scene, T, k))
                found = cache.load(key)
    assert found is not None
    arrays, facts = found
    names = tuple(facts["parts"])
    K, U = (tuple(arrays[f"{letter}{i}"] for i in range(len(names))) for letter in "KU")
    return Prepared(Assembly(K, base.assembly.A, base.assembly.nodes, names), U, arrays["Q"], facts)


def _build(
    base: Prepared, scene: Scene, T: sp.csc_array, k: Vector
) -> tuple[dict[str, Matrix], dict[str, object]]:
    start = time.perf_counter()
    made = _merged(base.assembly, T, k)
    factors = tuple(factor(K, name, scene) for K, name in zip(made.blocks, made.parts, strict=True))
    spectrum = [extreme_eigenvalues(K, U) for K, U in zip(made.blocks, factors, strict=True)]
    lambda_min, lambda_max = min(s[0] for s in spectrum), max(s[1] for s in spectrum)
    if lambda_max > LARGEST_CONDITION * lambda_min:
        raise indefinite(scene, "cond(K)", lambda_max / lambda_min)
    arrays = {"Q": schur(made, factors)}
    for i, (K, U) in enumerate(zip(made.blocks, factors, strict=True)):
        arrays |= {f"K{i}": K, f"U{i}": U}
    seconds = base.facts["seconds"]
    assert isinstance(seconds, dict)
    facts = base.facts | {
        "parts": made.parts,
        "cond_K": lambda_max / lambda_min,
        "lambda_min": lambda_min,
        "lambda_max": lambda_max,
        "cond_blocks": [s[1] / s[0] for s in spectrum],
        "seconds": seconds | {"ties": time.perf_counter() - start},
    }
    return arrays, facts


def _merged(assembly: Assembly, T: sp.csc_array, k: Vector) -> Assembly:
    """K + T diag(k) Tᵀ; a block reaches from the first to the last part that a spring joins."""
    ends = [s.stop for s in assembly.slices]
    block_of = np.searchsorted(ends, T.indices, side="right")
    joined = np.zeros(len(ends), dtype=bool)  # with the block before
    for column in range(T.shape[1]):
        blocks = block_of[T.indptr[column] : T.indptr[column + 1]]
        joined[blocks.min() + 1 : blocks.max() + 1] = True
    added = sp.csr_array(T @ sp.diags_array(k) @ T.T)
    groups = np.split(np.arange(len(ends)), np.flatnonzero(~joined)[1:])
    blocks, names = [], []
    for group in groups:
        span = slice(assembly.slices[group[0]].start, assembly.slices[group[-1]].stop)
        K = added[span, span].toarray(order="F")
        for i in group:
            own = assembly.slices[i]
            inside = slice(own.start - span.start, own.stop - span.start)
            K[inside, inside] += assembly.blocks[i]
        blocks.append(K)
        names.append(" + ".join(assembly.parts[i] for i in group))
    return Assembly(tuple(blocks), assembly.A, assembly.nodes, tuple(names))
