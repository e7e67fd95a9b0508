"""The page of `explore` in Chromium: drag, add, slide, save; its numbers are those of `solve`."""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from small_joints import two_parts

from harness import solve
from problems.scene_files import read_scene

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
SCENE = (
    two_parts(length=200.0, nodes=(21, 4))
    + """
[[effect]]
kind = "initial_gap"
mean = 0.05
random = { sd = 0.02, correlation_length = 60.0, seed = 3 }
[[effect]]
kind = "fasteners"
preload = 40.0
points = [[20.0, 10.0], [50.0, 25.0], [160.0, 40.0]]
"""
)
#: A model by its type and place, of the page's document.
MODEL = (
    "const all = [...(window.Bokeh?.documents[0]?._all_models ?? new Map()).values()];"
    "const found = (type, k = 0) => all.filter(m => m.type == type)[k];"
)
#: Of a point of the first map, its place in the window.
PLACE = """
const view = Bokeh.index.find_one(found('Figure')), box = view.canvas_view.el.getBoundingClientRect();
const [x, y] = arguments, frame = view.frame;
return [box.left + frame.x_scale.compute(x), box.top + frame.y_scale.compute(y)];
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """The address of the page, and the folder it is served from."""
    folder = tmp_path_factory.mktemp("served")
    (folder / "joint.toml").write_text(SCENE)
    command = [sys.executable, "-m", "harness", "explore", "joint.toml", "--no-open", "--allow-gap", "0.02"]
    where = os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "200"}
    process = subprocess.Popen(command, cwd=folder, env=where, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        line = process.stdout.readline()
        found = re.search(r"http://\S+", line)
        assert found, line
        yield found[0], folder
    finally:
        process.terminate()
        process.wait(10)


def opened(driver: Any, address: str) -> None:
    driver.get(address)
    shown(driver, "proven")


def shown(driver: Any, *words: str, without: str = "\0") -> str:
    """What the page says of the gap once these words are there."""
    text = ""
    for _ in range(200):
        text = driver.execute_script(MODEL + "return found('Div')?.text ?? ''")
        if text and all(word in text for word in words) and without not in text:
            return str(text)
        time.sleep(0.05)
    raise AssertionError(text)


def said_gap(text: str) -> float:
    found = re.search(r'id="gap">([\d.e-]+)<', text)
    assert found, text
    return float(found[1])


def at(driver: Any, x: float, y: float) -> tuple[float, float]:
    return tuple(driver.execute_script(MODEL + PLACE, x, y))  # type: ignore[return-value]


def mouse(driver: Any, *path: tuple[float, float]) -> None:
    """Press at the first point, let go at the last; a click if there is one only."""
    from selenium.webdriver.common.action_chains import ActionChains

    actions = ActionChains(driver, duration=20)
    pointer = actions.w3c_actions.pointer_action
    pointer.move_to_location(*map(int, path[0]))
    pointer.pointer_down()
    for point in path[1:]:
        pointer.move_to_location(*map(int, point))
    pointer.pointer_up()
    actions.perform()


def saved(driver: Any, folder: Path, name: str) -> Path:
    driver.execute_script(MODEL + "found('TextInput').value = arguments[0]", name)
    driver.execute_script(
        MODEL
        + "const {ButtonClick} = Bokeh.require('core/bokeh_events');"
        + "found('Button', 1).trigger_event(new ButtonClick())"
    )
    for _ in range(200):
        if (folder / name).is_file():
            return folder / name
        time.sleep(0.05)
    raise AssertionError(driver.execute_script(MODEL + "return found('Div', 2).text"))


def test_fasteners_are_dragged_added_and_saved(chromium: Any, served: tuple[str, Path]) -> None:
    address, folder = served
    opened(chromium, address)
    first = shown(chromium, "3 fasteners", "proven")
    mouse(chromium, at(chromium, 160.0, 40.0), at(chromium, 140.0, 30.0), at(chromium, 120.0, 25.0))
    moved = shown(chromium, "3 fasteners", "proven", without=first)
    mouse(chromium, at(chromium, 180.0, 25.0))
    added = shown(chromium, "4 fasteners", "proven")
    path = saved(chromium, folder, "moved.toml")
    places = json.loads(json.dumps(read_scene(str(path)).marks().tolist()))
    assert len(places) == 4
    assert max(abs(a - b) for a, b in zip(places[2], (120.0, 25.0), strict=True)) < 2.0
    assert said_gap(first) != said_gap(moved) != said_gap(added)
    assert said_gap(added) == float(f"{solve(str(path)).gap.max():.6g}")


def test_sliders_move_the_gap_and_the_limit(chromium: Any, served: tuple[str, Path]) -> None:
    opened(chromium, served[0])
    first = shown(chromium, "proven", "FAIL")
    slide = (
        MODEL
        + "const s = found('Slider', arguments[0]); s.value = arguments[1]; s.value_throttled = arguments[1]"
    )
    chromium.execute_script(slide, 0, 0.2)
    shown(chromium, "PASS", "above 0.2 mm")
    chromium.execute_script(slide, 2, 0.08)
    after = shown(chromium, "proven", without=f'id="gap">{said_gap(first):g}<')
    assert said_gap(after) > said_gap(first) + 0.01


def test_only_who_knows_the_address_is_served(served: tuple[str, Path]) -> None:
    from urllib.error import HTTPError
    from urllib.request import urlopen

    address = served[0]
    with urlopen(address) as page:
        assert page.status == 200
    with pytest.raises(HTTPError, match="404"):
        urlopen(address.rsplit("/", 1)[0] + "/")
