"""Which code a row is of: in a work tree, installed, or neither."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import tiny_joint
from strip_scene import write_strip
from suite_runs import rows_of, said_by

from harness.measurement.suite_run import run as run_suite
from harness.results import series_file
from harness.results.atomic_output import refuse_changed
from harness.results.provenance import HOOK_VARIABLES, ROOT, fingerprints, provenance
from harness.series.run import run as run_series
from harness.series.session import Job
from problems import __version__
from problems.errors import InputError
from problems.load_cases.random_gaps import random_gaps
from problems.scene_files import read_scene

COPIED = (
    *("problems/__init__.py", "harness/__init__.py", "harness/results/__init__.py"),
    *("harness/results/provenance.py", "harness/results/schema.py", "pyproject.toml"),
)
ASK = "from harness.results.provenance import provenance as p; import json; print(json.dumps(p()))"
NOT_KNOWN = (__version__, None)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of what tells the commit, in no repository."""
    return copied(tmp_path / "tree")


def copied(folder: Path) -> Path:
    for name in COPIED:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    return folder


def git(folder: Path, *arguments: str) -> str:
    who = ["-c", "user.name=a", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false"]
    alone = {name: value for name, value in os.environ.items() if name not in HOOK_VARIABLES}
    done = subprocess.run(
        ["git", *who, *arguments], cwd=folder, env=alone, check=True, capture_output=True, text=True
    )
    return done.stdout.strip()


def committed(folder: Path) -> str:
    git(folder, "init", "-q")
    git(folder, "add", "-A")
    git(folder, "commit", "-q", "-m", "all")
    return git(folder, "rev-parse", "HEAD")


def code_of(folder: Path, **environment: str) -> tuple[str, bool | None]:
    """What the packages in that folder say."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("harness.results.provenance.ROOT", folder)
        for name, value in environment.items():
            patch.setenv(name, value)
        return provenance()["commit"], provenance()["clean"]


def test_a_commit_of_documents_or_results_is_no_other_code(tree: Path) -> None:
    """Asked of a copy in its own process first, without compiled files: no .gitignore is copied."""
    code = committed(tree)
    assert len(code) == 40
    variables = os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    words = [sys.executable, "-P", "-c", ASK]
    done = subprocess.run(words, env=variables, capture_output=True, cwd=tree.parent)
    assert json.loads(done.stdout) == {"commit": code, "clean": True}
    (tree / "results").mkdir()
    for name in ("results/measurements.jsonl", "README.md"):
        (tree / name).write_text("said\n")
    assert code_of(tree) == (code, True)
    assert committed(tree) != code
    assert code_of(tree) == (code, True)
    with (tree / "pyproject.toml").open("a") as file:
        file.write("\n")
    assert code_of(tree) == (code, False)
    assert committed(tree) == code_of(tree)[0]


@pytest.mark.parametrize("name", ["problems/__init__.py", "solvers/new.py"])
def test_a_work_tree_with_changes(tree: Path, name: str) -> None:
    """A changed file, or one that git does not know yet."""
    head = committed(tree)
    (tree / name).parent.mkdir(exist_ok=True)
    with (tree / name).open("a") as file:
        file.write("\n# changed\n")
    assert code_of(tree) == (head, False)


def test_a_hook_of_another_repository_does_not_lead_astray(tree: Path, tmp_path: Path) -> None:
    head, other = committed(tree), tmp_path / "other"
    other.mkdir()
    (other / "file").write_text("of another project")
    committed(other)
    hook = {"GIT_DIR": str(other / ".git"), "GIT_WORK_TREE": str(other), "GIT_INDEX_FILE": "index"}
    assert code_of(tree, **hook) == (head, True)


def test_without_git_or_a_repository_the_version_is_named(tree: Path, tmp_path: Path) -> None:
    assert code_of(tree) == NOT_KNOWN
    committed(tree)
    assert code_of(tree, PATH=str(tmp_path)) == NOT_KNOWN


@pytest.mark.parametrize("tracked", [False, True])
def test_the_repository_of_another_project_is_not_ours(tmp_path: Path, tracked: bool) -> None:
    """Its environment lies in its work tree, ignored as usual; or it keeps a copy of the packages."""
    site = copied(tmp_path / "other/.venv/site-packages")
    (tmp_path / "other/pyproject.toml").write_text('[project]\nname = "other"\n')
    if not tracked:
        (tmp_path / "other/.gitignore").write_text(".venv/\n")
    committed(tmp_path / "other")
    assert code_of(site) == NOT_KNOWN


def test_two_files_of_one_name_have_a_hash_each(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the path of the second is the name of the first."""
    monkeypatch.chdir(tmp_path)
    files = [Path("parts/gaps.csv"), Path("gaps.csv")]
    files[0].parent.mkdir()
    for k, file in enumerate(files):
        file.write_text(str(k))
    assert len({*fingerprints(files).values()}) == 2
    before = fingerprints(files)
    refuse_changed(files, before)
    files[1].write_text("another")
    with pytest.raises(InputError, match="changed meanwhile"):
        refuse_changed(files, before)


def test_every_row_of_a_suite_and_of_a_series_names_its_code(tmp_path: Path) -> None:
    here = provenance()
    suite = tiny_joint.suite(tmp_path, '[[solver]]\nname = "newton"\n')
    said_by(run_suite, suite, tmp_path / "suite")
    scene = read_scene(str(write_strip(tmp_path)))
    job = Job(scene=scene, cases=random_gaps(scene, 3, 0), form="dual", check=0, threads=1)
    said_by(run_series, job, {}, tmp_path / "series")
    rows = [*rows_of(tmp_path / "suite"), *series_file.rows(tmp_path / "series")]
    assert len(rows) == 4
    for row in rows:
        assert {name: row[name] for name in here} == here
