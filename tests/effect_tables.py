"""The table of each effect in a scene, as small as it can be."""

from pathlib import Path

from small_joints import two_parts

JOINT = two_parts()
#: Each kind by itself, as small as it can be.
TABLES = {
    "clamps": "clamping_force = 5.0\npoints = [[10.0, 10.0]]",
    "fasteners": "preload = 5.0\npoints = [[10.0, 10.0]]",
    "initial_gap": "mean = 0.1\nrandom = { sd = 0.1, correlation_length = 20.0, seed = 1 }",
    "installed_fasteners": "points = [[10.0, 10.0]]",
    "local_thickness": 'part = "a"\nthickness = 3.0\nx = [0.0, 50.0]\ny = [0.0, 50.0]',
    "measured_gap": "points = [[0.0, 0.0, 0.1], [100.0, 0.0, 0.2], [0.0, 50.0, 0.3]]",
    "part_position": 'part = "a"\nshift = 0.1\nslope_x = 1e-3\nslope_y = -2e-3',
    "pressure": 'part = "a"\nvalue = 1e-3',
    "ribs": 'part = "a"\nlines = [20.0]\nI = 100.0',
    "rigid_tool": 'part = "b"\ndistance = 0.3',
    "self_weight": 'part = "b"',
    "shims": "thickness = 0.1\nx = [0.0, 40.0]\ny = [0.0, 50.0]",
    "stringers": 'part = "a"\npitch = 50.0\nstart = 0.0\nstop = 50.0\nI = 100.0',
    "supports": 'part = "a"\npoints = [[0.0, 0.0]]',
    "support_shift": 'part = "a"\npoints = [[0.0, 0.0]]\nshift = 0.1',
    "thermal_bending": 'part = "a"\ndifference = 10.0',
}


def scene_of(folder: Path, *kinds: str) -> Path:
    path = folder / f"{'-'.join(kinds)}.toml"
    path.write_text("".join(f'[[effect]]\nkind = "{kind}"\n{TABLES[kind]}\n' for kind in kinds) + JOINT)
    return path
