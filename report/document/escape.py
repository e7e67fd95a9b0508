"""User text in the report: titles, names, paths, messages, which may contain anything.

What a results directory holds is quoted when it is read: characters that mean something in Markdown, HTML,
CSV or mathematical text become private ones (U+E000 …), which pass through sentences, labels and tables.
Whoever writes a file spells them out for it: `markdown`, `script_json`, `csv_cell`, `picture`, `file_name`.
"""

import json
import math
import re
from collections.abc import Iterator
from hashlib import sha256
from typing import Any

import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator

from .numbers import as_number

LONGEST = 1000  # characters of a text; what is longer ends in a fingerprint, so that it stays distinct
LONGEST_NAME = 50  # characters of a file name
LONGEST_LABEL = 80  # characters of a text in a picture
UNKNOWN = "\N{REPLACEMENT CHARACTER}"

MARKDOWN = {
    **{character: f"\\{character}" for character in "\\*_[]#!~|$"},
    **{"<": "&lt;", ">": "&gt;", "&": "&amp;", "`": "&#96;", "\n": " "},
}
QUOTED = {character: chr(0xE000 + place) for place, character in enumerate(MARKDOWN)}
#: Characters to be quoted; an underscore within a word has no meaning.
ACTIVE = re.compile(r"[\\*\[\]#!~|$<>&`\n]|(?<![^\W_])_|_(?![^\W_])")
#: Control characters, those that reverse the direction of text, lone surrogates, and the private ones.
ILLEGIBLE = re.compile(
    "[\0-\x09\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ue000-\uf8ff]"
)

TO_PLAIN = str.maketrans({private: character for character, private in QUOTED.items()})
TO_MARKDOWN = str.maketrans({QUOTED[character]: spelled for character, spelled in MARKDOWN.items()})


def quoted(value: Any) -> Any:
    """What a file of results holds, with every text in it quoted, bounded and legible."""
    match value:
        case str():
            text = ILLEGIBLE.sub(UNKNOWN, value.replace("\r\n", "\n").replace("\t", " "))
            return ACTIVE.sub(lambda found: QUOTED[found[0]], _bounded(text))
        case dict():
            return {quoted(key): quoted(item) for key, item in value.items()}
        case list():
            return [quoted(item) for item in value]
    return value


def _bounded(text: str) -> str:
    return text if len(text) <= LONGEST else f"{short(text, LONGEST)} ({_fingerprint(text)})"


def _fingerprint(text: str) -> str:
    return sha256(text.encode()).hexdigest()[:8]


def short(text: str, most: int) -> str:
    """The text, or its beginning and '…' if it has more than `most` characters."""
    return text if len(text) <= most else text[: most - 1] + "…"


def plain(text: str) -> str:
    """The text as it was, for what gives no character a meaning."""
    return text.translate(TO_PLAIN)


def markdown(page: str) -> str:
    """A page in which quoted text is literal: no HTML, link, image, table cell or line of its own."""
    return page.translate(TO_MARKDOWN)


def script_json(value: Any) -> str:
    """JSON for a script element of an HTML page: texts as they were, and nothing that could end the element.

    Non-finite numbers become null.
    """
    text = json.dumps(_unquoted(value), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.translate({ord(character): f"\\u{ord(character):04x}" for character in "<>&\u2028\u2029"})


def _unquoted(value: Any) -> Any:
    match value:
        case str():
            return plain(value)
        case float():
            return value if math.isfinite(value) else None
        case dict():
            return {plain(str(name)): _unquoted(item) for name, item in value.items()}
        case list() | tuple():
            return [_unquoted(item) for item in value]
    return value


def csv_cell(value: Any) -> Any:
    """A cell that no spreadsheet takes for a formula: text that begins like one gets an apostrophe."""
    if not isinstance(value, str):
        return value
    text = plain(value)
    return f"'{text}" if text.lstrip()[:1] in tuple("=+-@") and as_number(text) is None else text


def csv_frame(frame: pd.DataFrame) -> pd.DataFrame:
    """A table for a CSV file; numbers are untouched."""
    spelled = frame.copy()
    for name, kind in frame.dtypes.items():
        if not pd.api.types.is_numeric_dtype(kind):
            spelled[name] = pd.Series([csv_cell(cell) for cell in frame[name]], frame.index, dtype=object)
    return spelled.rename(columns=csv_cell)


def label(text: str) -> str:
    """A text in a picture: one line, bounded, without mathematics."""
    return short(plain(text.replace(QUOTED["\n"], " ")), LONGEST_LABEL).replace("$", r"\$")


def picture(drawing: Figure) -> Figure:
    """The figure with its quoted texts spelled out."""
    for axes in drawing.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if isinstance(axis.get_major_locator(), FixedLocator):
                texts = [text.get_text() for text in axis.get_ticklabels()]
                if (spelled := [_spelled(text) for text in texts]) != texts:
                    axis.set_ticks(axis.get_majorticklocs(), spelled)
    for text in _texts(drawing):
        if (words := _spelled(text.get_text())) != text.get_text():
            text.set_text(words)
    return drawing


def _texts(artist: Artist) -> Iterator[Text]:
    """All texts but those of ticks, which matplotlib makes when it draws."""
    if isinstance(artist, Text):
        yield artist
    children = [artist.label] if isinstance(artist, Axis) else artist.get_children()
    for child in children:
        yield from _texts(child)


def _spelled(text: str) -> str:
    """Only of texts that need it: what is drawn of the program's own may be mathematics, or long."""
    user = len(text) > LONGEST_LABEL or any(private in text for private in QUOTED.values())
    return label(text) if user else text


def file_name(text: str) -> str:
    """A name for a file: letters, digits, '.', '_' and '-'; distinct for distinct texts."""
    simple = plain(text).replace("/", "_")
    name = re.sub(r"[^\w.-]", "_", simple)[:LONGEST_NAME]
    return name if name == simple else f"{name}-{_fingerprint(text)}"
