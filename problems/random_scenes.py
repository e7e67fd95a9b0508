"""Scenes drawn at random, `drawn/<n>/<k>` with k from 0 to 99 999, on the assemblies wing-fragment-<n>.

The SHA-256 of "<version>/<n>/<k>" is eight integers u < 2³². Each draws one integer from low to high, as
low + ⌊u (high − low + 1) / 2³²⌋. So the scenes of a version are the same on every machine, and the next
version has others: nobody can have tuned on them.
"""

import re
import struct
from hashlib import sha256
from typing import Any

from . import __version__

SIZES = (4386, 6112, 11308)
MEANS = (0.3, 0.6, 1.0)  # mm, of the gap
ROWS = (1, 2, 4)  # of fasteners
EDGE = 25.0  # mm, from the outermost fasteners to the border
EXAMPLES = [f"drawn/{n}/0" for n in SIZES]
NAME = re.compile(rf"(drawn/({'|'.join(map(str, SIZES))})/)(0|[1-9][0-9]{{0,4}})")
RANGE = re.compile(rf"{NAME.pattern}\.\.([0-9]{{1,5}})")


def drawn_names(pattern: str) -> list[str]:
    """The scenes of a name, or of a range such as `drawn/4386/0..59`; none if it is neither."""
    if NAME.fullmatch(pattern):
        return [pattern]
    if not (found := RANGE.fullmatch(pattern)):
        return []
    folder, _, first, last = found.groups()
    return [f"{folder}{k}" for k in range(int(first), int(last) + 1)]


def drawn_table(name: str) -> dict[str, Any] | None:
    """The content of a drawn scene's file; None if the name is not that of a drawn scene.

    Gap: mean 0.3, 0.6 or 1 mm, standard deviation 0.02 … 0.2 mm, correlation length 80 … 600 mm. Fasteners:
    4 … 32 columns, 1, 2 or 4 rows, 500 … 4000 N each. Pressure on both parts: 10^−6 … 10^−2.2 MPa, uniform in
    its logarithm, to four digits, so that no rounding of 10^x can show.
    """
    if not (found := NAME.fullmatch(name)):
        return None
    n, k = found.group(2, 3)
    draws = iter(struct.unpack(">8I", sha256(f"{__version__}/{n}/{k}".encode()).digest()))

    def draw(low: int, high: int) -> int:
        return low + (next(draws) * (high - low + 1) >> 32)

    mean = MEANS[draw(0, len(MEANS) - 1)]
    sd, length, seed = draw(20, 200) / 1000, draw(80, 600), draw(0, 2**32 - 1)
    columns, rows = draw(4, 32), ROWS[draw(0, len(ROWS) - 1)]
    preload = draw(500, 4000)
    pressure = float(f"{10 ** (draw(-6000, -2200) / 1000):.3e}")
    gap = f"gap {mean:g} mm (sd {sd:g}, correlation length {length})"
    random = {"sd": sd, "correlation_length": length, "seed": seed}
    pattern = {"columns": columns, "rows": rows, "edge": EDGE}
    return {
        "title": f"Drawn: {columns * rows} fasteners of {preload} N, {gap}, pressure {pressure:.3e} MPa",
        "assembly": f"wing-fragment-{n}",
        "effect": [
            {"kind": "initial_gap", "mean": mean, "random": random},
            {"kind": "fasteners", "preload": preload, "pattern": pattern},
            {"kind": "pressure", "part": "wing", "value": pressure},
            {"kind": "pressure", "part": "fragment", "value": -pressure},
        ],
    }
