"""Sections of a report, and their blocks: text, tables and figures."""

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
    files: ClassVar[tuple[str, ...]] = ()
    markdown: str


@dataclass(frozen=True)
class Column:
    """A column of a table as shown. show : turns a row of the data into the text of a cell."""

    heading: str
    show: Callable[[Mapping[str, Any]], str]
    align: str = "right"


def number(heading: str, name: str, style: Callable[[object], str] = significant) -> Column:
    """Numbers of the data's column `name` in a style: three significant digits, or `whole` for counts."""
    return Column(heading, lambda row: style(row[name]))


def word(heading: str, name: str) -> Column:
    """Words of the data's column `name`."""

    def show(row: Mapping[str, Any]) -> str:
        text = "" if pd.isna(row[name]) else str(row[name])
        return text.replace("|", r"\|") or MISSING

    return Column(heading, show, "left")


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows of a frame as dictionaries."""
    return frame.to_dict("records")  # type: ignore[return-value]


@dataclass(frozen=True)
class Table:
    """A table: its `columns` in the report, all of `data` with all digits in NAME.csv beside it.

    More than WIDEST columns continue in further tables; each begins with the first `keys` columns. Tables and
    figures of a report have different names. A table without a name has no CSV file.
    """

    kind: ClassVar[str] = "table"
    name: str
    caption: str
    data: pd.DataFrame
    columns: list[Column]
    keys: int = 1

    @property
    def files(self) -> tuple[str, ...]:
        """The file beside the report, if the table has a name."""
        return (f"{self.name}.csv",) if self.name else ()

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
    """A picture, saved as NAME.png; `caption` explains it. data : the values drawn, saved as NAME.csv; None
    if a table of the report shows them.
    """

    kind: ClassVar[str] = "figure"
    name: str
    caption: str
    drawing: Drawing
    data: pd.DataFrame | None = None

    @property
    def files(self) -> tuple[str, ...]:
        return (f"{self.name}.png",) + ((f"{self.name}.csv",) if self.data is not None else ())

    @property
    def alt(self) -> str:
        """The emphasised beginning of the caption, without markup."""
        return self.caption.split("*")[1].rstrip(".:") if self.caption.startswith("*") else self.name


Block = Text | Table | Figure


def facts_table(name: str, caption: str, facts: Mapping[str, object]) -> Table:
    """A table of names and values; those that are empty or None are left out."""
    lines = [(what, value) for what, value in facts.items() if value not in ("", None)]
    data = pd.DataFrame(lines, columns=["what", "value"])
    return Table(name, caption, data, [word("what", "what"), word("value", "value")])


@dataclass(frozen=True)
class Section:
    title: str
    blocks: Sequence[Block]
