"""A console on which text from outside is only text, and a line that says what is being done."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

#: Control characters except the line break, those that reverse the direction of text, and lone surrogates,
#: as in file names that are not UTF-8.
ILLEGIBLE = re.compile("[\0-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
UNKNOWN = "\N{REPLACEMENT CHARACTER}"
QUIET_S = 2.0  # before a line says what is being done


def legible(text: str) -> str:
    return ILLEGIBLE.sub(UNKNOWN, text)


class PlainConsole(Console):
    """Without markup, emoji codes and highlighting; no control character of a text reaches the terminal."""

    def __init__(self, **options: Any) -> None:
        super().__init__(highlight=False, markup=False, emoji=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """As in rich; here already, because the widths of a table's columns are measured before `render`.

        A string is one line, so that no title or file name can pass for a line of ours.
        """
        return super().render_str(legible(text).replace("\n", UNKNOWN), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """As in rich, whose own control sequences are marked as such or made from styles afterwards."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=legible(segment.text))


@contextmanager
def waiting(console: Console) -> Iterator[Callable[[str], None]]:
    """Yields a function to call again and again with what is being done; the line goes when it is over."""
    started, status = time.monotonic(), console.status("")

    def show(text: str) -> None:
        seconds = time.monotonic() - started
        if seconds > QUIET_S and console.is_terminal:
            status.update(Text(f"{text}: {seconds:.0f} s"))
            status.start()

    try:
        yield show
    finally:
        status.stop()
