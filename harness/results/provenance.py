"""The code that made a row: its commit and whether it had changes, or else its version."""

from __future__ import annotations

import json
import os
import subprocess
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from problems import __version__

#: The folder that holds the project's packages.
ROOT = Path(__file__).resolve().parents[2]
#: What can change a row; what only shows rows, and results that are written meanwhile, are not part of it.
CODE = ("problems", "solvers", "harness", "pyproject.toml")
#: Tracked in a work tree of this project; a tree that merely contains an installed copy tracks neither.
OWN_FILES = ("pyproject.toml", "harness/results/provenance.py")
#: Set by git for its hooks, to the tree that the hook is for.
HOOK_VARIABLES = ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_COMMON_DIR")


def provenance() -> dict[str, str | bool | None]:
    """`commit` and `clean` as every row names them."""
    name, clean = commit()
    return {"commit": name, "clean": clean}


def commit() -> tuple[str, bool | None]:
    """The commit of the code in these packages, and whether the code is as committed.

    In a git work tree of the project, the 40 hexadecimal digits of the last commit that changed CODE, so that
    one to documents or results is no other code, and whether CODE has no changes; an untracked file is one,
    because plug-ins are found by discovery. If pip installed the packages from
    a git repository, the commit it recorded (PEP 610), which is clean. Otherwise, or if git is missing,
    the version and None, not known.
    """
    return _of_work_tree() or _of_installation() or (__version__, None)


def _of_work_tree() -> tuple[str, bool | None] | None:
    prefix = _git("rev-parse", "--show-prefix")
    if prefix is None or _git("ls-files", "--error-unmatch", "--", *OWN_FILES) is None:
        return None
    digits = _git("log", "-1", "--format=%H", "--", *CODE)
    if prefix.strip() or not digits:  # in a subfolder, the work tree is another project's; or no commit yet
        return None
    changes = _git("status", "--porcelain", "--untracked-files=all", "--", *CODE)
    return digits.strip(), None if changes is None else not changes


def _git(*arguments: str) -> str | None:
    """What git prints about ROOT; None if it is not installed or fails."""
    environment = {name: value for name, value in os.environ.items() if name not in HOOK_VARIABLES}
    try:
        done = subprocess.run(
            ["git", "-C", str(ROOT), *arguments],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            env=environment | {"GIT_OPTIONAL_LOCKS": "0"},  # never blocks a commit
        )
    except OSError:
        return None
    return done.stdout if done.returncode == 0 else None


def _of_installation() -> tuple[str, bool] | None:
    """The commit that the distribution holding these packages was installed from, if it was recorded."""
    try:
        installed = distribution("rivetbench")
        origin = json.loads(installed.read_text("direct_url.json") or "{}")
    except (PackageNotFoundError, ValueError):
        return None
    installed_here = Path(str(installed.locate_file("harness"))).resolve() == ROOT / "harness"
    digits = origin.get("vcs_info", {}).get("commit_id")
    return (digits, True) if installed_here and digits else None
