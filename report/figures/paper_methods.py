"""The styles of the paper's methods in every figure: the second of each kind is hollow."""

from __future__ import annotations

from typing import Any

from report.figures import style

LOOKS: dict[str, dict[str, Any]] = {
    "IPM": {"color": style.BLUE, "marker": "o", "linestyle": "-", "markerfacecolor": style.BLUE},
    "IPM, open gaps last": {
        "color": style.BLUE,
        "marker": "D",
        "linestyle": (0, (1, 1.2)),
        "markerfacecolor": "white",
    },
    "GI dual": {
        "color": style.VERMILLION,
        "marker": "s",
        "linestyle": "-",
        "markerfacecolor": style.VERMILLION,
    },
    "GI primal": {
        "color": style.VERMILLION,
        "marker": "s",
        "linestyle": (0, (4, 2)),
        "markerfacecolor": "white",
    },
}
