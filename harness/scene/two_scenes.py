"""Two scenes on one junction, such as two plans of fasteners, solved and compared contact by contact."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.text import Text

from harness.results.comparison import Incomparable
from harness.terminal import FAILED
from problems.build import prepared
from problems.model.scene import JointScene
from problems.scene_files import read_scene

FOLDERS = ["first", "second"]


def solve_both(
    sources: tuple[str, str], out: Path, solve: Callable[[str, Path], int], console: Console
) -> int:
    """Solve both into DIR/first and DIR/second, write DIR/comparison.md and its files, print what changed.

    Returns the exit code of the second, or 1 if the first has no good answer. Raises InputError, Incomparable
    if their contacts are not the same.
    """
    refuse_other_contacts(*sources)
    codes = []
    for source, folder in zip(sources, FOLDERS, strict=True):
        console.print()
        console.print(source, style="bold")
        codes.append(solve(source, out / folder))
    from report.document.escape import plain
    from report.writers.two_answers_report import write

    path, pairs = write(out, FOLDERS)
    console.print(Text(f"{sources[0]} and {sources[1]}", style="bold"))
    for line in pairs.to_dict("records"):
        console.print(
            f"{plain(str(line['contact']))}: the largest gap {line['largest_first_mm']:.4g} → "
            f"{line['largest_second_mm']:.4g} mm, mean {line['mean_first_mm']:.4g} → "
            f"{line['mean_second_mm']:.4g} mm, closed {line['closed_first']} → {line['closed_second']}"
        )
    console.print(f"Comparison: {path}")
    return FAILED if codes[0] == FAILED else codes[1]


def refuse_other_contacts(first: str, second: str) -> None:
    """Raise Incomparable unless both scenes have the same contacts at the same nodes."""
    one, other = read_scene(first), read_scene(second)
    if isinstance(one, JointScene) and isinstance(other, JointScene):
        places, others = ([joint.places(pair) for pair in joint.pairs] for joint in (one.joint, other.joint))
        same = one.joint.pairs == other.joint.pairs and all(map(np.array_equal, places, others))
        if not (same and places):
            allowed = f"the contacts of {first}, at least one, at the same nodes"
            raise Incomparable.one(second, "contacts", [list(pair) for pair in other.joint.pairs], allowed)
        return
    A, B = (prepared(scene).assembly.A for scene in (one, other))
    if A.shape != B.shape or (A != B).nnz or not A.shape[1]:
        wanted, given = (f"A of shape {M.shape} with {M.nnz} entries" for M in (A, B))
        allowed = f"those of {first}, at least one: {wanted}, entry by entry"
        raise Incomparable.one(second, "contacts", given, allowed)
