"""A strip on a rigid tool as a scene file: 45 contacts, a random gap, three fasteners, a pressure."""

from pathlib import Path

STRIP = """
[joint]
contacts = [["a", "tool"]]
junction = { length = 400.0, width = 120.0, nodes = [9, 5] }
[[joint.part]]
name = "a"
thickness = 3.0
north = { length = 90.0, elements = 2 }
clamped = ["north"]
[[effect]]
kind = "initial_gap"
mean = 0.4
random = { sd = 0.2, correlation_length = 100.0, seed = 7 }
[[effect]]
kind = "fasteners"
preload = 60.0
points = [[50.0, 30.0], [200.0, 0.0], [350.0, 60.0]]
[[effect]]
kind = "pressure"
part = "a"
value = 1e-4
[[effect]]
kind = "ribs"
part = "a"
lines = [60.0]
I = 2e3
"""


def strip_with(*pairs: tuple[str, str], text: str = STRIP) -> str:
    """The text of the strip, some of it replaced."""
    for old, new in pairs:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


def write_strip(folder: Path, *pairs: tuple[str, str]) -> Path:
    """strip.toml in `folder`, some of its text replaced."""
    path = folder / "strip.toml"
    path.write_text(strip_with(*pairs))
    return path
