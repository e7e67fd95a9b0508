"""A console on which text from outside is only text; a line that says what is being done; and the output of a
run: each row as it is finished, above a progress bar.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from harness.results.records import Row
from problems.reporter import Reporter, Stage
from report.document.verdict_colours import FAIL, PASS

from . import DONE, GAP_EXCEEDED, NOTHING_JUDGED, READER_GONE

#: Control characters except the line break, those that reverse the direction of text, lone surrogates, as in
#: file names that are not UTF-8, and what is no character, which XML has no way to write.
ILLEGIBLE = re.compile(
    "[\0-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff]"
)
UNKNOWN = "\N{REPLACEMENT CHARACTER}"


def legible(text: str) -> str:
    return ILLEGIBLE.sub(UNKNOWN, text)


class PlainConsole(Console):
    """Without markup, emoji codes and highlighting; no control character of a text reaches the terminal."""

    def __init__(self, **options: Any) -> None:
        super().__init__(highlight=False, markup=False, emoji=False, **options)

    def on_broken_pipe(self) -> None:
        """End as a command does whose reader has gone: rich would end with 1, which is a verdict here."""
        with suppress(SystemExit):
            super().on_broken_pipe()
        raise SystemExit(READER_GONE)

    def render_str(self, text: str, **options: Any) -> Text:
        """Make a string one line, so that no title or file name can pass for a line of ours.

        Here, too, because the widths of a table's columns are measured before `render`.
        """
        return super().render_str(legible(text).replace("\n", UNKNOWN), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Replace control characters; those of rich are marked as such, or made from styles afterwards."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=legible(segment.text))


class ConsoleReporter(Reporter):
    """Shows the step, its progress and its seconds in a line, gone when the step is over; sentences stay.

    Parameters
    ----------
    console : rich.console.Console
        Where they are shown.
    plain : bool, optional
        Without a terminal, each progress is a line that stays.
    """

    def __init__(self, console: Console, plain: bool = False) -> None:
        self.console, self.plain = console, plain and not console.is_terminal
        self.stages = set[Stage]()
        text = TextColumn("{task.fields[name]}{task.description}", markup=False)
        columns = SpinnerColumn(), text, TimeElapsedColumn()
        hidden = not console.is_terminal
        self.line = Progress(*columns, console=console, transient=True, disable=hidden)

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        task = self.line.add_task("", name=name)
        try:
            with self.line:
                yield
        finally:
            self.line.remove_task(task)

    def progress(self, text: str, fraction: float = 0.0) -> None:
        if self.plain:
            self.console.print(text)
        for task in self.line.task_ids:
            self.line.update(task, description=f": {_with_share(text, fraction)}")

    def building(self, stage: Stage, fraction: float = 0.0, part: str = "") -> None:
        self.stages.add(stage)
        super().building(stage, fraction, part)

    def say(self, sentence: str) -> None:
        self.console.print(f"{sentence}.", style="yellow", soft_wrap=True)


def console_of(reporter: Reporter) -> Console:
    """The console of a reporter; of one that has none, a console that shows nothing."""
    return reporter.console if isinstance(reporter, ConsoleReporter) else PlainConsole(quiet=True)


def _with_share(text: str, fraction: float) -> str:
    return f"{text} {fraction:.0%}" if fraction else text


#: The exit code and colour of a verdict on an allowed gap, by its kind; "" where it cannot be told.
VERDICTS = {"pass": (DONE, PASS), "fail": (GAP_EXCEEDED, FAIL), "": (NOTHING_JUDGED, "yellow")}


def table_of(lines: Iterable[Sequence[str]], caption: str | None = None) -> Table:
    """A table of lines, the first of which is its headings."""
    heads, *rows = lines
    table = Table(*heads, caption=caption)
    for row in rows:
        table.add_row(*row)
    return table


def show_verdict(kind: str, sentences: Sequence[str], console: Console) -> int:
    """Print the sentences, the last one in the colour of the verdict; returns the exit code."""
    code, style = VERDICTS[kind]
    for sentence in sentences[:-1]:
        console.print(sentence)
    console.print(sentences[-1], style=style, soft_wrap=True)
    return code


STYLES = {"within": "green", "outside": "red", "cannot_be_judged": "yellow", "no_answer": "red"}

#: Heading, width (negative: left-aligned), content.
COLUMNS = [
    ("scene", -23, lambda row: row["scene"]),
    ("solver", -16, lambda row: f"{row['solver']} {row['variant']}".strip()),
    ("form", -6, lambda row: row["form"]),
    ("tol", 6, lambda row: f"{row['tolerance']:.0e}"),
    ("thr", 3, lambda row: str(row["threads_asked"])),
    ("status", -15, lambda row: row["status"]),
    ("iter", 6, lambda row: _figure(row["iterations"], "d")),
    ("prepare s", 9, lambda row: _figure(_sum(row, "convert_s", "prepare_s"), ".2f")),
    ("solve s", 8, lambda row: _solve_time(row)),
    ("error mm", 8, lambda row: _figure(row["displacement_error_mm"], ".1e")),
    ("verdict", -16, lambda row: row["verdict"]),
]


def _figure(value: float | None, spec: str) -> str:
    return "–" if value is None else format(value, spec)


def _sum(row: Row, *names: str) -> float | None:
    known = [row[name] for name in names if row[name] is not None]
    return sum(known) if known else None


def _solve_time(row: Row) -> str:
    if row["solve_s"] is None:
        return f"> {row['time_limit_s']:g}" if row["status"] == "time_limit" else "–"
    return _figure(_sum(row, "setup_s", "solve_s", "form_s"), ".2f")


def _line(cells: list[str]) -> str:
    widths = [width for _, width, _ in COLUMNS]
    aligned = (c.ljust(-w) if w < 0 else c.rjust(w) for c, w in zip(cells, widths, strict=True))
    return "  ".join(aligned).rstrip()


def row_text(row: Row) -> Text:
    """One line of the table; below it the reason, if there is no answer."""
    text = Text(_line([cell(row) for *_, cell in COLUMNS]), style=STYLES[row["verdict"]])
    if row["message"] and row["verdict"] == "no_answer":
        text.append(f"\n    {row['message'].splitlines()[0][:150]}", style="dim")
    return text


class Display(Reporter):
    """Rows scroll above a progress bar; without a terminal only the rows are printed."""

    def __init__(self, console: Console, remaining: int, done: int) -> None:
        self.console = console
        self.bar = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self.task: TaskID = self.bar.add_task("", total=remaining + done, completed=done)
        self.heading = ""

    def __enter__(self) -> "Display":
        self.console.print(_line([heading for heading, *_ in COLUMNS]), style="bold", soft_wrap=True)
        self.bar.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self.bar.stop()

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        self.heading = f"{name}: "
        yield
        self.heading = ""

    def progress(self, text: str, fraction: float = 0.0) -> None:
        """Show the current activity beside the bar."""
        self.bar.update(self.task, description=self.heading + _with_share(text, fraction))

    def finished(self, row: Row) -> None:
        """Print the row of a measurement that is done."""
        self.console.print(row_text(row), soft_wrap=True)
        self.advance(1)

    def added(self, count: int) -> None:
        """Note that so many more measurements are made."""
        self.bar.update(self.task, total=(self.bar.tasks[self.task].total or 0) + count)

    def advance(self, count: int) -> None:
        """Advance the bar by so many measurements, made or no longer needed."""
        self.bar.update(self.task, advance=count)
