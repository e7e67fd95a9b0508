"""Hostile files without end: each command ends soon with a documented exit code and words, and loses no file.

60 inputs; RIVETBENCH_LONG=1 takes 20 000, RIVETBENCH_LONG=N takes N.
"""

import hashlib
import resource
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hostile_draws import mutate
from hostile_targets import Target, all_targets, invoke
from matplotlib.figure import Figure
from sample_size import Fault, Log, draws

SEED = 24
TIME_LIMIT_S = 60  # per command
DRAWN = 0.02  # of the inputs: pictures are saved, which takes a second
MEMORY = 6 * 2**30  # bytes of address space: what reads without end is a fault before the machine is full
CODES = {0, 1, 2, 3, 4, 5}


def contents(folder: Path, keeps: Callable[[str], bool]) -> dict[str, str]:
    """The kind or the hash of each file; pipes and devices are not read."""
    kinds = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if keeps(name) and not (path.is_dir() and not path.is_symlink()):
            if path.is_symlink():
                kinds[name] = f"-> {path.readlink()}"
            elif path.is_file():
                kinds[name] = hashlib.sha256(path.read_bytes()).hexdigest()
            else:
                kinds[name] = "special"
    return kinds


@pytest.fixture(scope="module")
def targets(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Target]]:
    root = tmp_path_factory.mktemp("targets")
    memory = resource.getrlimit(resource.RLIMIT_AS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIVETBENCH_CACHE", str(root / "cache"))
        made = all_targets(root)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, memory[1]))
        yield made
    resource.setrlimit(resource.RLIMIT_AS, memory)


def test_hostile_files(targets: list[Target], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log, count, save = Log(), draws(60, 20_000), Figure.savefig
    shares = np.array([target.share for target in targets])
    for index in range(count):
        random = np.random.default_rng([SEED, index])
        drawn = random.random() < DRAWN
        monkeypatch.setattr(Figure, "savefig", save if drawn else lambda *_, **__: None)
        target = targets[random.choice(len(targets), p=shares / shares.sum())]
        with log.contained(f"draw {index}, {target.name}", TIME_LIMIT_S):
            _tried(log, random, target, tmp_path / "work", monkeypatch)
    log.nothing_found()
    for target in targets:  # else little was tried
        ended = sum(log.seen[f"{target.name} {code}"] for code in CODES)
        assert ended > 0.25 * count * target.share, target.name
    assert sum(log.seen[f"{target.name} 0"] for target in targets) > 0.1 * count


def _tried(
    log: Log, random: np.random.Generator, target: Target, work: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One file damaged, one command; nothing if the mutation does not fit the file. Raises Fault."""
    if work.exists():
        shutil.rmtree(work)
    shutil.copytree(target.folder, work, symlinks=True)
    own_cache = target.name == "cache"
    monkeypatch.setenv("RIVETBENCH_CACHE", str((work if own_cache else target.folder.parent) / "cache"))
    name = target.damaged[random.integers(len(target.damaged))]
    try:
        done = mutate(random, work / name)
    except (ValueError, TypeError, OverflowError):
        return
    command = target.commands[random.integers(len(target.commands))]
    log.where += f": {name} {done}; {' '.join(command)}"
    files = contents(work, target.keeps)
    code, output = invoke(work, command)
    if code not in CODES or (code and not output.strip()):
        raise Fault("words", f"exit code {code}: {output[-300:]}")
    if "Traceback" in output or "\x1b" in output:
        raise Fault("words", output[-300:])
    if contents(work, target.keeps) != files:
        raise Fault("lost", "a file")
    target.checked(work, command, code, output)
    log.seen[f"{target.name} {code}"] += 1
