"""The public interface is documented whole, by numpydoc's rules; its examples run."""

import doctest
import inspect
import re
from pathlib import Path
from typing import Any

import pytest
from numpydoc.docscrape import get_doc_object
from numpydoc.validate import validate

from harness import api

ROOT = Path(__file__).parents[2]
REFERENCE = (ROOT / "docs" / "reference.md").read_text("utf-8")
#: Codes of numpydoc that are not asked for: extended summaries, See Also, examples of classes and methods, a
#: summary below the quotes, capitals at the beginning of a description.
FREE = {"ES01", "SA01", "EX01", "GL01", "PR08", "RT04"}
FUNCTIONS = [name for name in api.__all__ if inspect.isfunction(getattr(api, name))]


def members() -> list[str]:
    """The classes and methods of the reference, and the members of classes that it names."""
    blocks = re.findall(r"^\.\. autoclass:: (\S+)\n(?: +:members: (.+)\n)?", REFERENCE, re.MULTILINE)
    methods = re.findall(r"^\.\. automethod:: (\S+)$", REFERENCE, re.MULTILINE)
    return methods + [
        each for name, some in blocks for each in (name, *(f"{name}.{m}" for m in some.split(", ") if m))
    ]


def test_the_reference_has_every_name() -> None:
    listed = set(re.findall(r"^\.\. auto(?:class|function):: harness\.api\.(\w+)$", REFERENCE, re.MULTILINE))
    assert listed == set(api.__all__)


@pytest.mark.parametrize("name", [*(f"harness.api.{name}" for name in FUNCTIONS), *members()])
def test_a_docstring_is_whole(name: str) -> None:
    """Each argument with its type; what a function returns, raises and shows."""
    wrong = [f"{code}: {text}" for code, text in validate(name)["errors"] if code not in FREE]
    assert wrong == []
    if name.rpartition(".")[2] in FUNCTIONS:
        sections: Any = get_doc_object(getattr(api, name.rpartition(".")[2]))
        assert all(sections[section] for section in ("Parameters", "Returns", "Raises", "Examples"))


@pytest.mark.parametrize("name", api.__all__)
@pytest.mark.usefixtures("without_pictures")
def test_its_examples_run(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """In an empty folder beside the examples; no report is written but by `report`."""
    if name != "report":
        request.getfixturevalue("without_report")
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    for test in doctest.DocTestFinder(recurse=False).find(
        getattr(api, name), name, globs={name: getattr(api, name)}
    ):
        said: list[str] = []
        doctest.DocTestRunner().run(test, out=said.append)
        assert said == [], "".join(said)
