"""Two scenes on one junction, such as two plans of fasteners or two meshes, solved and compared.

Where the meshes differ, gaps are compared at the contacts of the coarser one; those of the other are
interpolated there on the surface through its contacts.
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from rich.console import Console
from rich.text import Text

from harness.results.comparison import Incomparable
from harness.results.records import refuse_other_command
from harness.terminal import FAILED
from problems.build import prepared
from problems.errors import read_all
from problems.forms.assembly import Matrix
from problems.model.interface import extent
from problems.model.scene import JointScene
from problems.model.surface import surface_of
from problems.scene_files import read_scene

FOLDERS = ["first", "second"]
PAGE = "pairs.csv"  # a folder with it has a comparison of scenes
OUTPUTS = ("comparison.md", "contacts.csv", "difference.png", "fasteners.csv", "gaps.png", "index.html")
SHIFT = 0.05  # of the junction's longer side, by which the corners of two meshes of it may differ


def solve_both(sources: tuple[str, str], out: Path, solve: Callable[..., int], console: Console) -> int:
    """Solve both into DIR/first and DIR/second, write DIR/comparison.md and its files, print what changed.

    Returns the exit code of the second, or 1 if the first has no good answer. Raises InputError, also if
    DIR has such files of something else; Incomparable if they are not of one junction.
    """
    refuse_other_command(out, PAGE, OUTPUTS)
    weights = common_places(*sources)
    codes = []
    for source, folder in zip(sources, FOLDERS, strict=True):
        console.print()
        console.print(source, style="bold")
        codes.append(solve(source, out=out / folder))
    from report.document.escape import plain
    from report.document.numbers import whole
    from report.writers.two_answers_report import write

    path, pairs, said = write(out, FOLDERS, weights)
    console.print(Text(f"{sources[0]} and {sources[1]}", style="bold"))
    for line in pairs.to_dict("records"):
        console.print(
            f"{plain(str(line['contact']))}: the largest gap {line['largest_first_mm']:.4g} → "
            f"{line['largest_second_mm']:.4g} mm, mean {line['mean_first_mm']:.4g} → "
            f"{line['mean_second_mm']:.4g} mm, closed {whole(line['closed_first'])} → "
            f"{whole(line['closed_second'])}"
        )
    for sentence in said:
        console.print(plain(sentence))
    console.print(f"Comparison: {path}")
    return FAILED if codes[0] == FAILED else codes[1]


def common_places(first: str, second: str) -> list[tuple[sp.csr_array, sp.csr_array]] | None:
    """The weights of the contacts of either scene at common places, pair by pair; None if contacts are the
    same. Raises Incomparable if pairs of parts differ, the corners of the junction by more than SHIFT, or A.
    """
    one, other = read_all(read_scene, (first, second))
    if isinstance(one, JointScene) and isinstance(other, JointScene):
        a, b = one.joint, other.joint
        places, others = ([joint.places(pair) for pair in joint.pairs] for joint in (a, b))
        same = a.pairs == b.pairs and abs(a.bounds - b.bounds).max() <= SHIFT * np.ptp(a.bounds, axis=0).max()
        if same and places and all(map(np.array_equal, places, others)):
            return None
        weights = [*map(_common, places, others)] if same else []
        if not weights or not all(W.shape[0] for W, _ in weights):
            allowed = f"the contacts of {first}, at least one, on {extent(a.bounds)}"
            raise Incomparable.one(second, "contacts", [list(pair) for pair in b.pairs], allowed)
        return weights
    A, B = (prepared(scene).assembly.A for scene in (one, other))
    if A.shape != B.shape or (A != B).nnz or not A.shape[1]:
        wanted, given = (f"A of shape {M.shape} with {M.nnz} entries" for M in (A, B))
        allowed = f"those of {first}, at least one: {wanted}, entry by entry"
        raise Incomparable.one(second, "contacts", given, allowed)
    return None


def _common(places: Matrix, others: Matrix) -> tuple[sp.csr_array, sp.csr_array]:
    """The weights of two sets of contacts at those of the smaller one; no rows if the other is on a line."""
    if len(others) < len(places):
        return _common(others, places)[::-1]
    with suppress(ValueError):
        surface = surface_of(others)
        inside = surface.covers(places)
        return sp.eye_array(len(places), format="csr")[inside], surface.weights(places[inside])
    return sp.csr_array((0, len(places))), sp.csr_array((0, len(others)))
