"""Scenes drawn at random, `drawn/<n>/<k>` with k from 0 to 99 999, on the assemblies wing-fragment-<n>.

The SHA-256 of "<version>/<n>/<k>" is eight integers u < 2³², and so is that of "<version>/<n>/<k>/1", and so
on. Each draws one integer from low to high, as low + ⌊u (high − low + 1) / 2³²⌋. So the scenes of a version
are the same on every machine, and the next version has others: nobody can have tuned on them. Those of a
version are `drawn/<n>/<k>@<version>` in every later one.

`drawn/superelements/<k>` are joints of superelements (`problems/random_superelements.py`).
"""

import itertools
import re
import struct
from collections.abc import Callable, Iterator
from hashlib import sha256
from typing import Any

from . import __version__

SIZES = (4386, 6112, 11308)
MEANS = (0.3, 0.6, 1.0)  # mm, of the gap
ROWS = (1, 2, 4)  # of fasteners
EDGE = 25.0  # mm, from the outermost fasteners to the border
SUPERELEMENTS = "superelements"
KINDS = (*map(str, SIZES), SUPERELEMENTS)
EXAMPLES = [f"drawn/{kind}/0" for kind in KINDS]
NUMBER, OF_VERSION = r"(0|[1-9][0-9]{0,4})", r"((?:@[0-9]+(?:\.[0-9]+)+)?)"
FIRST = rf"(drawn/({'|'.join(KINDS)})/){NUMBER}"
NAME, RANGE = re.compile(FIRST + OF_VERSION), re.compile(rf"{FIRST}\.\.([0-9]{{1,5}}){OF_VERSION}")


def drawn_names(pattern: str) -> list[str]:
    """The scenes of a name, or of a range such as `drawn/4386/0..59`; none if it is neither."""
    if NAME.fullmatch(pattern):
        return [pattern]
    if not (found := RANGE.fullmatch(pattern)):
        return []
    folder, _, first, last, version = found.groups()
    return [f"{folder}{k}{version}" for k in range(int(first), int(last) + 1)]


#: Draws an integer from low to high.
Draw = Callable[[int, int], int]


def draw_of(name: str) -> Draw:
    """The draws of a scene, one after another."""

    def integers() -> Iterator[int]:
        drawn, _, version = name.partition("@")
        text = f"{version or __version__}/{drawn.removeprefix('drawn/')}"
        for k in itertools.count():
            yield from struct.unpack(">8I", sha256((f"{text}/{k}" if k else text).encode()).digest())

    numbers = integers()
    return lambda low, high: low + (next(numbers) * (high - low + 1) >> 32)


def power_of_ten(draw: Draw, low: int, high: int) -> float:
    """10^(low/1000) … 10^(high/1000), uniform in the logarithm; four digits, so that no rounding can show."""
    return float(f"{10 ** (draw(low, high) / 1000):.3e}")


def drawn_table(name: str) -> dict[str, Any] | None:
    """The content of a drawn scene's file; None if the name is not that of a drawn scene with a file.

    Gap: mean 0.3, 0.6 or 1 mm, standard deviation 0.02 … 0.2 mm, correlation length 80 … 600 mm. Fasteners:
    4 … 32 columns, 1, 2 or 4 rows, 500 … 4000 N each. Pressure on both parts: 10^−6 … 10^−2.2 MPa.
    """
    if not (found := NAME.fullmatch(name)) or (n := found[2]) == SUPERELEMENTS:
        return None
    draw = draw_of(name)
    mean = MEANS[draw(0, len(MEANS) - 1)]
    sd, length, seed = draw(20, 200) / 1000, draw(80, 600), draw(0, 2**32 - 1)
    columns, rows = draw(4, 32), ROWS[draw(0, len(ROWS) - 1)]
    preload = draw(500, 4000)
    pressure = power_of_ten(draw, -6000, -2200)
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
