"""Condenses a part statically onto its junction nodes, by nested dissection; the cache keeps the result.

With kept unknowns j and the others i, S = K_jj − K_ji K_ii⁻¹ K_ij. Mesh lines across a part couple only to
their neighbours, so that a line separates its two sides. A stretch of the part is halved at its middle line.
Each half is condensed onto its kept unknowns and its end lines. The halves meet at the middle line, whose
other unknowns a Cholesky factorisation eliminates (George, SIAM J. Numer. Anal. 10:345–363, 1973). For w
unknowns per line and k kept ones these are about 2wk² operations, all in products of matrices. A front that
travels along the part takes wk² operations per line.
"""

import itertools
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.linalg import blas, lapack

from problems import storage
from problems.forms.assembly import Indices, Mask, Matrix, Vector
from problems.reporter import SILENT, Reporter, Stage
from problems.stiffness.block import NotPositiveDefinite, SparseBlock
from problems.stiffness.dense_block import mirrored
from problems.storage import fingerprint

from .banded_numbering import lines_across
from .effect import code_of
from .part import CODE, PartLoadEffect, PartModel


def condense(
    K: sp.csr_array,
    lines: Sequence[Indices],
    keep: Mask,
    reporter: Reporter = SILENT,
    part: str = "",
) -> Matrix:
    """Schur complement (k, k) of a block-tridiagonal K (N, N) on the unknowns to keep (N,).

    K couples only within a line and to the next. lines : the unknowns of each line. part : the part's name
    for the reporter. S is dense, by columns, symmetric to the last bit, and in the order of `lines`.

    Raises NotPositiveDefinite if some motion costs no energy.
    """
    nothing = np.zeros(0, dtype=np.intp)
    split = [np.concatenate([line[keep[line]], line[~keep[line]]]) for line in (nothing, *lines, nothing)]
    counts = [int(keep[line].sum()) for line in split]
    done = itertools.count(1)

    def stretch(first: int, last: int) -> Matrix:
        """The lower triangle of S of a stretch: its first line, the kept unknowns between, its last line.

        It lacks the entries of K within these two lines.
        """
        if last == first + 1:
            a, b = split[first], split[last]
            S = np.zeros((len(a) + len(b),) * 2, order="F")
            S[len(a) :, : len(a)] = K[b][:, a].toarray()
            return S
        middle = (first + last) // 2
        south, north = stretch(first, middle), stretch(middle, last)
        line_dofs, j = split[middle], counts[middle]
        line = K[line_dofs][:, line_dofs].toarray() + north[: len(line_dofs), : len(line_dofs)]
        stop = len(south) - len(line_dofs) + j  # of the unknowns up to the middle line's kept ones
        begin = stop - j

        S = np.empty((stop + len(north) - len(line_dofs),) * 2, order="F")  # nothing reads above the diagonal
        S[:stop, :stop] = south[:stop, :stop]
        S[begin:stop, begin:stop] += line[:j, :j]
        S[stop:, :begin] = 0.0
        S[stop:, begin:stop] = north[len(line_dofs) :, :j]
        S[stop:, stop:] = north[len(line_dofs) :, len(line_dofs) :]

        # W = L⁻¹ K_i·; then K_·· −= WᵀW
        L, info = lapack.dpotrf(line[j:, j:] + south[stop:, stop:], lower=1, overwrite_a=1)
        if info:
            raise NotPositiveDefinite(int(line_dofs[j + info - 1]))
        rows = np.empty((len(line_dofs) - j, len(S)), order="F")
        rows[:, :stop] = south[stop:, :stop]
        rows[:, begin:stop] += line[j:, :j]
        rows[:, stop:] = north[len(line_dofs) :, j : len(line_dofs)].T
        del south, north
        W = blas.dtrsm(1.0, L, rows, lower=1, overwrite_b=1)
        S = blas.dsyrk(-1.0, W, beta=1.0, c=S, trans=1, lower=1, overwrite_c=1)
        reporter.building(Stage.CONDENSATION, next(done) / len(lines), part)
        return S

    return mirrored(stretch(0, len(split) - 1))


def part_key(part: PartModel) -> str:
    """The hash of the code and data of a part's stiffness; its name does not count."""
    code = fingerprint([*code_of(part.effects), Path(__file__)], within=CODE)
    data = [effect.model_dump(mode="json", exclude={"part", "name"}) for effect in part.effects]
    return storage.digest("part", part.geometry, data, code)


def condensed_stiffness(key: str, part: PartModel, reporter: Reporter, name: str) -> tuple[Matrix, float]:
    """The part's stiffness on the junction nodes, (node_count, node_count) N/mm, x running fastest.

    key : `part_key` of the part. name : the part's name for the reporter. Also returns the seconds taken.
    Raises NotPositiveDefinite if some motion of the part costs no energy.
    """

    def made() -> storage.Entry:
        start = time.perf_counter()
        K = condensed_onto(part.deflections, part, reporter, name)
        return {"K": K}, {"seconds": time.perf_counter() - start}

    arrays, facts = storage.load_or_make(key, made)
    return arrays["K"], facts["seconds"]


def condensed_onto(kept: Indices, part: PartModel, reporter: Reporter = SILENT, name: str = "") -> Matrix:
    """The part's stiffness on the unknowns `kept` (k,) of its plate, in their order: (k, k) by columns.

    Symmetric to the last bit. Raises NotPositiveDefinite as `condense` does.
    """
    keep, lines = np.zeros(part.plate.size, dtype=bool), lines_across(part)
    keep[kept] = True
    S = condense(part.stiffness(), lines, keep, reporter, name)
    ordered = np.concatenate(lines)
    place = np.empty(part.plate.size, dtype=np.intp)
    place[ordered[keep[ordered]]] = np.arange(len(S))
    return S.T.take(place[kept], axis=0).take(place[kept], axis=1).T


def condensed_load(
    effect: PartLoadEffect,
    part: PartModel,
    interior: Callable[[], tuple[Indices, SparseBlock, sp.csr_array]],
    kept: bool,
) -> Vector:
    """(node_count,) forces in N on the junction nodes: f_j − K_ji K_ii⁻¹ f_i, j the deflections there.

    The condensed load moves the junction as the load on the whole part does: f_j gains the work of f_i on
    the motions that the junction imposes, and the rest of f_i moves interior nodes alone.
    interior : returns i, K_ii and K_ji; called if the load is not in the cache. kept : whether the cache
    keeps it: not one of many load cases.
    """

    def force() -> Vector:
        f, (i, K_ii, K_ji) = effect.load(part), interior()
        u = K_ii.solve(f[i])
        u += K_ii.solve(f[i] - K_ii.multiply(u))
        return np.asarray(f[part.deflections] - K_ji @ u)

    if not kept:
        return force()
    code = fingerprint([*code_of([effect]), Path(__file__)], within=CODE)
    key = storage.digest(
        "load", part_key(part), effect.model_dump(mode="json", exclude={"part", "name"}), code
    )
    return np.array(storage.load_or_make(key, lambda: ({"force": force()}, {}))[0]["force"])
