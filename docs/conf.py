"""The documentation as a site: `sphinx-build -W -c docs . results/site`. Its pages are those of the clone."""

from problems import __version__

project = "rivetbench"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
napoleon_google_docstring = False
napoleon_use_rtype = False
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
