"""The recipes of CONTRIBUTING.md, done in a copy of the project as they are written."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
RECIPES = dict(re.findall(r"^### (An? .+?)\n(.*?)(?=^###? )", PAGE, re.MULTILINE | re.DOTALL))
FILE = re.compile(r"```\w+\n# ([\w/.-]+)(?:, (after|instead of) ([^\n]+))?\n(.*?)```", re.DOTALL)
FOLDERS = ("docs", "examples", "harness", "problems", "report", "rivetbench", "solvers", "studies", "tests")
CHECKS = {
    "ruff": ["-m", "ruff", "check", "--no-cache"],
    "format": ["-m", "ruff", "format", "--check", "--no-cache"],
    "mypy": ["-m", "mypy"],
    "layers": ["-c", "from importlinter.cli import lint_imports; raise SystemExit(lint_imports())"],
}


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project with the files and lines of all recipes."""
    copy = tmp_path_factory.mktemp("recipes")
    for folder in (ROOT / name for name in (*FOLDERS, ".mypy_cache") if (ROOT / name).is_dir()):
        shutil.copytree(folder, copy / folder.name, ignore=shutil.ignore_patterns("__pycache__"))
    for path in [ROOT / "results", *ROOT.glob("*.*")]:
        if path.is_file() or path.name == "results":
            (copy / path.name).symlink_to(path)
    for name, place, line, text in (found for recipe in RECIPES.values() for found in FILE.findall(recipe)):
        path = copy / name
        if not place:
            assert not path.exists(), name
            path.write_text(f"# {name}\n{text}" if path.suffix == ".toml" else text, "utf-8")
            continue
        lines = path.read_text("utf-8").splitlines(keepends=True)
        places = [k for k, old in enumerate(lines) if old.startswith(line)]
        assert len(places) == 1, (name, line)
        (at,) = places
        lines[at : at + 1] = [lines[at], text] if place == "after" else [text]
        path.write_text("".join(lines), "utf-8")
    return copy


def passes(project: Path, words: list[str]) -> None:
    env = os.environ | {"PYTEST_ADDOPTS": "-p no:cacheprovider"}
    done = subprocess.run([sys.executable, *words], cwd=project, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("check", CHECKS)
def test_the_checks_pass_with_the_recipes(project: Path, check: str) -> None:
    passes(project, CHECKS[check])


@pytest.mark.slow
@pytest.mark.parametrize("recipe", RECIPES)
def test_a_recipe_is_complete(project: Path, recipe: str) -> None:
    (commands,) = re.findall(r"```sh\n(.*?)```", RECIPES[recipe], re.DOTALL)
    for command in commands.splitlines():
        passes(project, shlex.split(command.removeprefix("python ")))
