"""What is installed: every file of the packages that is not code, versions within the bounds."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

import rivetbench

ROOT = Path(__file__).parents[2]
SUFFIXES = {".toml", ".j2", ".js", ".css", ".csv"}
LINTERS = {"ruff", "mypy", "import-linter", "pandas-stubs", "types-psutil", "numpydoc"}


def test_every_file_beside_the_code_is_in_a_package_that_is_installed() -> None:
    """The build takes whole folders, and leaves out what git ignores: no data may be ignored."""
    folders = ["harness", "problems", "report"]
    data = [path for folder in folders for path in (ROOT / folder).rglob("*.*") if path.suffix in SUFFIXES]
    assert {path.suffix for path in data} == SUFFIXES
    names = "\n".join(str(path.relative_to(ROOT)) for path in data)
    ignored = subprocess.run(
        ["git", "check-ignore", "--stdin"], cwd=ROOT, input=names, capture_output=True, text=True
    )
    assert ignored.stdout == ""


def test_the_command_is_the_module() -> None:
    said = [
        subprocess.run([*command, "--version"], capture_output=True, text=True, check=True).stdout
        for command in (
            [str(Path(sys.executable).with_name("rivetbench"))],
            [sys.executable, "-m", "harness"],
            [sys.executable, "-m", "rivetbench"],
        )
    ]
    assert len(set(said)) == 1
    assert said[0].startswith(f"rivetbench {rivetbench.__version__}, commit ")


def test_the_package_is_imported_without_numpy() -> None:
    """The version is there at once; the rest comes with the first name asked for."""
    code = "import sys, rivetbench; print(rivetbench.__version__, 'numpy' in sys.modules)"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said == f"{rivetbench.__version__} False\n"


def lower_bounds(*without: str) -> dict[str, Version]:
    """Of the requirements and of the extras but those named."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = project["optional-dependencies"].items()
    stated = [
        *project["dependencies"],
        *(line for name, lines in extras if name not in without for line in lines),
    ]
    bounds = {}
    for requirement in map(Requirement, stated):
        if requirement.name != "rivetbench":
            (bound,) = requirement.specifier
            assert bound.operator == ">="
            bounds[canonicalize_name(requirement.name)] = Version(bound.version)
    return bounds


def pinned(file: str) -> dict[str, Version]:
    lines = re.findall(r"^([\w.-]+)==(\S+)$", (ROOT / file).read_text("utf-8"), re.MULTILINE)
    return {canonicalize_name(name): Version(version) for name, version in lines}


def test_the_oldest_versions_are_the_lower_bounds() -> None:
    bounds = lower_bounds("more-solvers", "docs")
    assert pinned("constraints-oldest.txt") == {name: bounds[name] for name in bounds.keys() - LINTERS}


def test_the_versions_measured_with_are_within_the_bounds() -> None:
    versions = pinned("constraints.txt")
    for name, bound in lower_bounds("more-solvers").items():
        assert versions[name] >= bound, name
