"""A scene built in Python: a sheet is drawn onto a rigid tool by a row of fasteners.

    min ½ xᵀK x − fᵀx   subject to   x ≤ g

K is the stiffness of the sheet (one part, condensed onto 25 × 7 junction nodes, n = m = 175), g = 0.3 mm the
gap to the tool, f the preload of three fasteners, 80 N each. The tool carries Σλ, the clamped edge the rest.

Prints Σλ, N, from the certified reference.
"""

from rivetbench import load_scene, solve

SHEET = {
    "junction": {"length": 600.0, "width": 150.0, "nodes": [25, 7]},
    "part": [
        {
            "name": "sheet",
            "thickness": 2.0,
            "north": {"length": 100.0, "elements": 4},
            "clamped": ["north"],
        }
    ],
    "contacts": [["sheet", "tool"]],
}
EFFECTS = [
    {"kind": "initial_gap", "mean": 0.3},
    {"kind": "fasteners", "preload": 80.0, "points": [[100.0, 50.0], [300.0, 50.0], [500.0, 50.0]]},
]


def main() -> float:
    scene = load_scene({"title": "A sheet on a tool", "joint": SHEET, "effect": EFFECTS})
    answer = solve(scene)
    assert answer.error_bound_mm < 1e-10  # proven
    return float(answer.lam.sum())


if __name__ == "__main__":
    print(f"{main():.6f}")
