"""The command `explore`: a page on which fasteners move."""

import threading
import webbrowser
from typing import Annotated

import typer

from .options import SceneName, error_reporting, option


def explore(
    scene: SceneName,
    allow_gap: Annotated[float, option("MM", "The limit to begin with.", min=0.0)] = 0.05,
    open_browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in a browser.")
    ] = True,
) -> None:
    """Open a page on which fasteners are dragged, and the gap follows.

    Fasteners move, come and go; preload, pressures, the mean gap and the limit are sliders. The page says
    PASS or FAIL with the largest gap, its place and its proven error, after the last stage of the scene or
    another one. A plan can be kept beside the next one, and saved as a scene that `solve` answers alike. The
    page is served to this machine only; Ctrl-C ends it.

    \b
    Examples:
      python -m harness explore joint.toml
      python -m harness explore 4386/0107 --allow-gap 0.1 --no-open

    \b
    Exit codes: 2 wrong usage or bad input, 130 ended.
    """
    with error_reporting("", "Ended.") as console:
        from harness.explore.live_answers import Explorer
        from harness.explore.page import serve
        from harness.scene.allowed_gap import refuse_unusable
        from harness.terminal.console import ConsoleReporter

        refuse_unusable(allow_gap)
        with ConsoleReporter(console).step("matrices, and the first answer"):
            explorer = Explorer(scene)
            first = explorer.answer(explorer.settings)

        def ready(address: str) -> None:
            console.print(f"{address}  (Ctrl-C ends it)")
            if open_browser:
                # A browser in the terminal returns when it ends, and its page has to be served until then.
                threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

        serve(explorer, scene, allow_gap, first, ready)
