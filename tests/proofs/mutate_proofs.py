"""Takes the terms of every proof out, one at a time, and sees whether the tests notice.

    python tests/proofs/mutate_proofs.py            all mutants, a few minutes
    python tests/proofs/mutate_proofs.py batched    those whose file or text contains a word

Each mutant of `mutants.py` is made in a copy of the tree, where its tests are run until one fails: it is
killed. If it survives, a term of a bound is not tested. Exits with 1 if one survives, or if a text is not
found exactly once, which `test_mutants.py` checks too.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from mutants import MUTANTS, TESTS, Mutant

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("rivetbench", "harness", "problems", "solvers", "report", "tests", "examples")
LIMIT_S = 300.0


def run(mutant: Mutant, tree: Path) -> str:
    """Either killed or survived, or what went wrong; the tree is left as it was."""
    path = tree / mutant.file
    source = path.read_text("utf-8")
    if source.count(mutant.old) != 1:
        return f"the text occurs {source.count(mutant.old)} times"
    try:
        path.write_text(source.replace(mutant.old, mutant.new), "utf-8")
        return tested(tree, TESTS[mutant.file])
    finally:
        path.write_text(source, "utf-8")


def tested(tree: Path, names: Iterable[str]) -> str:
    options = ["-x", "-q", "--no-header", "--tb=no", "-p", "no:cacheprovider", "--hypothesis-seed=0"]
    command = [sys.executable, "-m", "pytest", *options]
    env = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(tree)}
    for name in names:  # most are killed by the first
        try:
            done = subprocess.run(
                [*command, f"tests/{name}"], cwd=tree, env=env, capture_output=True, timeout=LIMIT_S
            )
        except subprocess.TimeoutExpired:
            return "killed"
        if done.returncode:
            return "killed" if done.returncode == 1 else f"pytest ended with {done.returncode}"
    return "survived"


def main(word: str = "") -> int:
    chosen = [each for each in MUTANTS if word in each.file or word in each.old]
    names = {name for mutant in chosen for name in TESTS[mutant.file]}
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder)
        for package in PACKAGES:
            shutil.copytree(ROOT / package, tree / package, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(ROOT / "pyproject.toml", tree)
        if tested(tree, sorted(names)) != "survived":
            print("The tests fail without any mutant.")
            return 1
        outcomes = []
        for mutant in chosen:
            outcomes.append(run(mutant, tree))
            change = f"{mutant.old.strip()} → {mutant.new.strip()}".replace("\n", "⏎")
            print(f"{outcomes[-1]:10} {mutant.file}: {change}", flush=True)
    killed = outcomes.count("killed")
    print(f"{killed} of {len(chosen)} mutants killed.")
    return 0 if killed == len(chosen) else 1


if __name__ == "__main__":
    raise SystemExit(main(*sys.argv[1:2]))
