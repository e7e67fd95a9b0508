"""What a section of the report consists of: text, tables and figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import pandas as pd
from matplotlib.figure import Figure as Drawing

from .numbers import MISSING, significant

WIDEST = 8  # columns of a table


@dataclass(frozen=True)
class Text:
    """A paragraph, list or heading in Markdown."""

    kind: ClassVar[str] = "text"
    markdown: str


@dataclass(frozen=True)
class Column:
    """A column of a table as shown. `show` turns a row of the data into the text of a cell."""

    heading: str
    show: Callable[[Mapping[str, Any]], str]
    align: str = "right"


def number(heading: str, name: str, style: Callable[[object], str] = significant) -> Column:
    return Column(heading, lambda row: style(row[name]))


def word(heading: str, name: str) -> Column:
    return Column(heading, lambda row: str(row[name] or MISSING).replace("|", r"\|"), "left")


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The lines of a frame as dictionaries."""
    return frame.to_dict("records")  # type: ignore[return-value]


@dataclass(frozen=True)
class Table:
    """A table: its `columns` in the report, all of `data` with all digits in NAME.csv beside it.

    More than WIDEST columns continue in further tables, each of which begins with the first `keys` columns.
    Without a name it has no CSV file.
    """

    kind: ClassVar[str] = "table"
    name: str
    caption: str
    data: pd.DataFrame
    columns: list[Column]
    keys: int = 1

    @property
    def markdown(self) -> str:
        keys, others = self.columns[: self.keys], self.columns[self.keys :]
        room = WIDEST - self.keys
        parts = -(-len(others) // room) or 1
        width = -(-len(others) // parts)  # of equal width
        return "\n\n".join(self._part([*keys, *others[k * width : (k + 1) * width]]) for k in range(parts))

    def _part(self, columns: list[Column]) -> str:
        lines = records(self.data)
        shown = pd.DataFrame({c.heading: [c.show(line) for line in lines] for c in columns}, dtype=object)
        align = [c.align for c in columns]
        return str(shown.to_markdown(index=False, disable_numparse=True, colalign=align))


@dataclass(frozen=True)
class Figure:
    """A picture, saved as NAME.png; `caption` explains it. data : what it shows, in NAME.csv, if no table
    has it.
    """

    kind: ClassVar[str] = "figure"
    name: str
    caption: str
    drawing: Drawing
    data: pd.DataFrame | None = None

    @property
    def alt(self) -> str:
        """What the picture shows, without markup: the emphasised beginning of its caption."""
        return self.caption.split("*")[1].rstrip(".:") if self.caption.startswith("*") else self.name


Block = Text | Table | Figure


@dataclass(frozen=True)
class Section:
    title: str
    blocks: Sequence[Block]
