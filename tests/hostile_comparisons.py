"""Damaged rows that are compared, held to as a baseline or looked up, and damaged answers that are judged."""

import re
from pathlib import Path

import numpy as np
import scipy.io
from hostile_targets import Fault, Target, own_matrices
from small import make_load, make_prepared, solve_by_nnls
from synthetic_results import row, write_rows

from problems import formats


def compared(root: Path) -> Target:
    """Two runs of a few rows, one of them damaged."""
    folder = root / "compared"
    rows = [row(f"20/{k}", "exact", repeat=r, scene_key="one") for k in range(3) for r in range(2)]
    for name in ("old", "new"):
        write_rows(
            folder / name, [each | {"key": f"{each['scene']} exact {each['repeat']}"} for each in rows]
        )

    def counted(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
        """What is compared adds up."""
        for total, kinds in re.findall(r"(\d+) measurements?: ([^.]*)\.", output):
            if int(total) != sum(map(int, re.findall(r"(\d+) (?:worse|better|of|new|alike)", kinds))):
                raise Fault("wrong", f"{total}: {kinds}")

    commands = (
        ("compare", "@old", "@new"),
        ("compare", "@new", "@old", "--out", "@out"),
        ("compare", "@new@1234", "@old"),
        ("compare", "@old", "@new", "--key", "20/0 exact 0"),
    )
    return Target("compared", 0.05, folder, ("new/measurements.jsonl",), commands, checked=counted)


def judged(root: Path) -> Target:
    """An exact answer in each kind of file."""
    folder = root / "judged"
    folder.mkdir()
    formats.FORMATS["npz"].write(folder / "own.npz", own_matrices())
    data = make_prepared(3, 3, tools=1)
    x, lam = solve_by_nnls(data, make_load(3, data)[0])
    np.save(folder / "x.npy", x)
    np.savez(folder / "xs.npz", x=x, lam=lam)
    np.savetxt(folder / "x.txt", x)
    scipy.io.mmwrite(folder / "x.mtx", x[:, None], precision=17)
    (folder / "x.csv").write_text("node,x\n" + "".join(f"{k},{v!r}\n" for k, v in enumerate(x.tolist())))
    files = ("x.npy", "xs.npz", "x.txt", "x.mtx", "x.csv")

    def whole(folder: Path, words: tuple[str, ...], code: int, output: str) -> None:
        if "nan" in output.lower() and code in (0, 1):
            raise Fault("wrong", output[-200:])

    commands = tuple(("judge", f"@{name}", "@own.npz") for name in files)
    return Target("judged", 0.05, folder, files, commands, checked=whole)


def comparisons(root: Path) -> list[Target]:
    return [compared(root), judged(root)]
