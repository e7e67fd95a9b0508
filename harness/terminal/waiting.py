"""What is being done, on a terminal, where it takes longer than two seconds."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.text import Text

QUIET_S = 2.0


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
