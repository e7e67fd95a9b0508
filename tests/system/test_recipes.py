"""The recipes of CONTRIBUTING.md, done in a copy of the project as they are written."""

import json
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
PLACES = [found for recipe in RECIPES.values() for found in FILE.findall(recipe)]
CODE = sorted({name for name, *_ in PLACES if name.endswith(".py") and not name.startswith("tests/")})
CACHES = (".mypy_cache", ".import_linter_cache")  # of `mypy` and `lint-imports`, where they were run
FOLDERS = ("docs", "examples", "harness", "problems", "report", "rivetbench", "solvers", "studies", "tests")
CHECKS = {
    "ruff": ["-m", "ruff", "check", "--no-cache"],
    "format": ["-m", "ruff", "format", "--check", "--no-cache"],
    "mypy": ["-m", "mypy", *CODE],
    "layers": ["-c", "from importlinter.cli import lint_imports; raise SystemExit(lint_imports())"],
}


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project with the files and lines of all recipes."""
    copy = tmp_path_factory.mktemp("recipes")
    for name in (*FOLDERS, *(cache for cache in CACHES if (ROOT / cache).is_dir())):
        shutil.copytree(ROOT / name, copy / name)
    for path in [ROOT / "results", *ROOT.glob("*.*")]:
        if path.is_file() or path.name == "results":
            (copy / path.name).symlink_to(path)
    for name, place, line, text in PLACES:
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


#: Commands one after another, up to the first that fails, each forked from what has imported what most need;
#: pictures of few pixels, as in all tests.
RUN = """
import json, os, runpy, sys
import _hypothesis_pytestplugin, bokeh.plotting, harness.api, harness.cli.app, harness.conformance.isolated
import harness.scene.solve, hypothesis, matplotlib.pyplot, pytest, report.writers.answer_report
import report.figures.style, report.writers.suite_report, solvers.registry
report.figures.style.DPI = 40
for words in json.loads(sys.argv[1]):
    print("$", *words, flush=True)
    if (pid := os.fork()) == 0:
        sys.argv = words[1:]
        runpy.run_module(words[1], run_name="__main__", alter_sys=True)
        sys.exit()
    if os.waitpid(pid, 0)[1]:
        sys.exit(1)
"""


def passes(project: Path, words: list[str]) -> None:
    env = os.environ | {"PYTEST_ADDOPTS": "-p no:cacheprovider"}
    done = subprocess.run([sys.executable, *words], cwd=project, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("check", CHECKS)
def test_the_checks_pass_with_the_recipes(project: Path, check: str) -> None:
    passes(project, CHECKS[check])


@pytest.mark.slow
def test_recipes_are_complete(project: Path) -> None:
    blocks = [re.findall(r"```sh\n(.*?)```", recipe, re.DOTALL) for recipe in RECIPES.values()]
    commands = [shlex.split(line)[1:] for (block,) in blocks for line in block.splitlines()]
    assert len(commands) >= len(RECIPES)
    passes(project, ["-c", RUN, json.dumps(commands)])
