"""The documentation as a site: `sphinx-build -W -c docs . results/site`. Its pages are those of the clone."""

from typing import Any

from problems import __version__

project = "rivetbench"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc = "docs/index"
include_patterns = [
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "docs/**.md",
    "results/published/index.md",
    "results/published/gaps/report/report.md",
    "results/published/paper/study/study.md",
]
myst_heading_anchors = 4
autodoc_member_order = "bysource"
suppress_warnings = ["myst.xref_missing"]  # links to folders; a test follows every link
html_theme = "furo"
html_title = f"rivetbench {__version__}"
html_copy_source = False


def setup(app: Any) -> None:
    """Docstrings are shown as they are written."""
    app.connect("autodoc-process-docstring", as_written)


def as_written(app: Any, what: str, name: str, found: object, options: Any, lines: list[str]) -> None:
    lines[:] = ["::", "", *(f"    {line}" for line in lines)]
