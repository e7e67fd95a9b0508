"""Titles, names and messages that a hostile user wrote: text in every file and picture, and nothing else."""

import csv
import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hostile_texts import results, solution
from matplotlib.text import Text
from rich.table import Table
from rich.text import Text as Lines
from synthetic_results import row
from typer import Typer
from typer.testing import CliRunner

from harness.cli.options import error_reporting
from harness.terminal.console import PlainConsole
from report.document import escape
from report.figures import style
from report.figures.answer_maps import answer_figures
from report.writers.answer_report import write as write_solution
from report.writers.suite_report import write

FORMULAS = ["+1+1", "-2+3", "@SUM(A1)", " =1"]


def test_a_picture_takes_no_text_for_mathematics(tmp_path: Path) -> None:
    record = escape.quoted(json.loads((solution(tmp_path, "$a$ \\alpha$") / "solution.json").read_text()))
    with np.load(tmp_path / "solution.npz") as file:
        figures = answer_figures(record, dict(file))
    for drawing in figures.values():
        escape.picture(drawing)
        shown = [text for text in drawing.findobj(Text) if "alpha" in text.get_text()]
        assert shown
        for text in shown:
            words, math = text._preprocess_math(text.get_text())
            assert not math
            assert "$a$ \\alpha$" in words


def test_labels_of_ticks_and_of_legends_are_spelled_out() -> None:
    drawing = style.figure(2.0)
    axes = drawing.subplots()
    axes.plot([0, 1], [0, 1], label=escape.quoted("$p$"))
    axes.set_yticks([0, 1], [escape.quoted("$q$"), "b" * 500], fontsize=5)
    axes.set(xscale="log", xlim=(1, 100))
    drawing.legend()
    escape.picture(drawing).savefig(io.BytesIO())
    texts = [text.get_text() for text in drawing.findobj(Text)]
    assert {r"\$p\$", r"\$q\$", "b" * 79 + "…"} <= set(texts)
    assert "$\\mathdefault{10^{1}}$" in texts
    assert axes.get_yticklabels()[0].get_fontsize() == 5


@pytest.mark.usefixtures("without_pictures")
def test_a_spreadsheet_runs_no_formula(tmp_path: Path) -> None:
    formula = '=cmd|"/c calc"!A1'
    target = write(results(tmp_path, formula)).parent
    cells = [cell for path in target.glob("*.csv") for line in csv.reader(path.open()) for cell in line]
    assert f"'{formula}" in cells
    assert formula not in cells
    target = write_solution(solution(tmp_path, formula)).parent
    assert next(csv.DictReader((target / "nodes.csv").open()))["part"] == f"'{formula}"


def test_numbers_in_a_csv_file_are_untouched() -> None:
    frame = pd.DataFrame({"text": ["-1.5", "+2", "-", "–"], "number": [-1.0, 2.0, None, -4.0]})
    found = escape.csv_frame(frame)
    assert found["text"].tolist() == ["-1.5", "+2", "'-", "–"]
    pd.testing.assert_series_equal(found["number"], frame["number"])
    formulas = escape.csv_frame(pd.DataFrame({"text": FORMULAS}))["text"].tolist()
    assert formulas == [f"'{formula}" for formula in FORMULAS]


def test_a_text_comes_back_whole_from_its_quotation() -> None:
    legible = "".join(map(chr, range(0x20, 0x7F))) + "\n_a_ b_c Ünïcode"
    assert escape.plain(escape.quoted(legible)) == legible
    assert (
        escape.quoted("11308/2800 ipm-fast (dual), n_x = 1e-7: 50 %")
        == "11308/2800 ipm-fast (dual), n_x = 1e-7: 50 %"
    )


def test_long_texts_stay_distinct_and_file_names_short() -> None:
    first, second = (escape.quoted("a" * 20_000 + end) for end in "xy")
    assert first != second
    assert len(first) < 1100
    names = {escape.file_name(escape.quoted(text)) for text in ("a b", "a_b", "a|b", "../../x", "a" * 300)}
    assert len(names) == 5
    assert all(len(name) < 70 and "/" not in name for name in names)
    assert escape.file_name("4386/0052") == "4386_0052"


@pytest.mark.usefixtures("without_pictures")
def test_a_line_separator_in_a_title_does_not_tear_its_row(tmp_path: Path) -> None:
    line = json.dumps(row() | {"message": "a\u2028b\x85c"}, ensure_ascii=False)
    (tmp_path / "measurements.jsonl").write_text(line + "\n", "utf-8")
    assert "on 1 scene" in write(tmp_path).read_text("utf-8")


def test_no_control_character_and_no_line_of_its_own_reaches_the_terminal() -> None:
    screen = io.StringIO()
    console = PlainConsole(file=screen, force_terminal=True, width=80)
    table = Table("[/b]", title="\x1b]0;t\x07[/b]\nPassed: all")
    table.add_row("\x1b[2J[/b]\udcff\nPassed: all")
    console.print(table)
    console.print("a\x1b[2J\x9b2J\r[/b]\udcff\nPassed: all. Fine.", style="red")
    console.print(Lines("two lines\nof ours"))
    written = screen.getvalue()
    for sequence in ("\x1b[2J", "\x1b]0", "\x07", "\x9b", "\r", "\udcff"):
        assert sequence not in written
    assert "\x1b[31ma�[2J" in written
    assert "[/b]" in written
    assert "\nof ours" in written
    plain = re.sub(r"\x1b\[[0-9;]*m", "", written)  # the console's own colours
    assert not [line for line in plain.splitlines() if line.strip(" │").startswith("Passed")]


@pytest.mark.parametrize(
    ("does", "said"),
    [
        (lambda: "one\nscene a\udcff\nthree".encode(), "scene a�: a name that is not UTF-8"),
        (lambda: np.zeros(2**50), "Not enough memory: Unable to allocate"),
    ],
)
def test_what_no_file_or_memory_can_hold_is_named(does: Any, said: str) -> None:
    app = Typer()

    @app.command()
    def command() -> None:
        with error_reporting():
            does()

    outcome = CliRunner().invoke(app)
    assert outcome.exit_code == 2
    assert said in outcome.output
