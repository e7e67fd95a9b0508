"""A series: the same joint with 200 random initial gaps.

K, A and Q are the joint's, g is the load case's: the mean plus a Gaussian random field. `newton` is prepared
once and solves 64 cases at a time; each answer comes with a proven bound on its error.

Prints the mean over the cases of the largest remaining gap, mm.
"""

import numpy as np

from rivetbench import load_scene, random_gaps, solve_series

SCENE = {
    "joint": {
        "junction": {"length": 600.0, "width": 150.0, "nodes": [25, 7]},
        "part": [
            {
                "name": name,
                "thickness": thickness,
                "north": {"length": 100.0, "elements": 4},
                "clamped": ["north"],
            }
            for name, thickness in (("sheet", 2.0), ("frame", 6.0))
        ],
    },
    "effect": [
        {"kind": "initial_gap", "mean": 0.4, "random": {"sd": 0.1, "correlation_length": 100.0, "seed": 1}},
        {"kind": "fasteners", "preload": 80.0, "pattern": {"columns": 5, "rows": 2, "edge": 25.0}},
    ],
}


def main() -> float:
    scene = load_scene(SCENE)
    largest = []
    for case in solve_series(scene, random_gaps(scene, 200, seed=1)):
        assert case.row["verdict"] == "within"  # of 1e-7 mm, proven
        assert case.gap is not None
        largest.append(case.gap.max())
    return float(np.mean(largest))


if __name__ == "__main__":
    print(f"{main():.6f}")
