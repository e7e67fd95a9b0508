"""Hostile files without end: each command ends soon with a documented exit code and words, and loses no file.

A few hundred inputs; RIVETBENCH_LONG=1 takes 20 000, RIVETBENCH_LONG=N takes N.
"""

import hashlib
import resource
import shutil
import signal
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hostile_draws import mutate
from hostile_targets import Fault, Target, all_targets, invoke
from long import draws
from matplotlib.figure import Figure

from report.figures import style

SEED = 17
TIME_LIMIT_S = 60  # per command
WORST_SHOWN = 25
DRAWN = 0.02  # of the inputs: pictures are saved, which takes a second
MEMORY = 6 * 2**30  # bytes of address space: what reads without end is a fault before the machine is full
CODES = {0, 1, 2, 3, 4, 5}


@contextmanager
def limited() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise Fault("hang", f"more than {TIME_LIMIT_S} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, TIME_LIMIT_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def contents(folder: Path, keeps: Callable[[str], bool]) -> dict[str, str]:
    """The kind or the hash of each file; pipes and devices are not read."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if keeps(name) and not (path.is_dir() and not path.is_symlink()):
            if path.is_symlink():
                found[name] = f"-> {path.readlink()}"
            elif path.is_file():
                found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
            else:
                found[name] = "special"
    return found


@pytest.fixture(scope="module")
def targets(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Target]]:
    root = tmp_path_factory.mktemp("targets")
    before = resource.getrlimit(resource.RLIMIT_AS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIVETBENCH_CACHE", str(root / "cache"))
        patch.setattr(style, "DPI", 30)
        made = all_targets(root)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, before[1]))
        yield made
    resource.setrlimit(resource.RLIMIT_AS, before)


def test_every_hostile_file_is_refused_or_right(
    targets: list[Target], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    count, start = draws(150, 20_000), time.monotonic()
    faults: Counter[str] = Counter()
    seen: Counter[str] = Counter()
    words: list[str] = []
    save = Figure.savefig
    shares = np.array([target.share for target in targets])
    for index in range(count):
        random = np.random.default_rng([SEED, index])
        drawn = random.random() < DRAWN
        monkeypatch.setattr(Figure, "savefig", save if drawn else lambda *_, **__: None)
        target = targets[random.choice(len(targets), p=shares / shares.sum())]
        try:
            seen[f"{target.name} {_exit_code(random, target, tmp_path / 'work', monkeypatch)}"] += 1
        except Fault as fault:
            faults[fault.kind] += 1
            words.append(f"{fault.kind}: draw {index}, {target.name}: {fault.what}")
            print(words[-1], flush=True)
        if index % 1000 == 999:
            print(f"{index + 1} of {count}, {time.monotonic() - start:.0f} s, {dict(faults)}", flush=True)
    print(count, f"inputs, {time.monotonic() - start:.0f} s:", dict(faults), dict(seen))
    assert not faults, "\n".join([str(dict(faults)), *words[:WORST_SHOWN]])
    for target in targets:  # else little was tried
        assert sum(seen[f"{target.name} {code}"] for code in CODES) > 0.25 * count * target.share, target.name
    assert sum(seen[f"{target.name} 0"] for target in targets) > 0.1 * count


def _exit_code(
    random: np.random.Generator, target: Target, work: Path, monkeypatch: pytest.MonkeyPatch
) -> int | None:
    """One file damaged, one command; None if the mutation does not fit the file. Raises Fault."""
    if work.exists():
        shutil.rmtree(work)
    shutil.copytree(target.folder, work, symlinks=True)
    own_cache = target.name == "cache"
    monkeypatch.setenv("RIVETBENCH_CACHE", str((work if own_cache else target.folder.parent) / "cache"))
    name = target.damaged[random.integers(len(target.damaged))]
    try:
        what = f"{name} {mutate(random, work / name)}"
    except (ValueError, TypeError, OverflowError):
        return None
    command = target.commands[random.integers(len(target.commands))]
    before = contents(work, target.keeps)
    try:
        with limited():
            code, output = invoke(work, command)
        if code not in CODES or (code and not output.strip()):
            raise Fault("words", f"exit code {code}: {output[-300:]}")
        if "Traceback" in output or "\x1b" in output:
            raise Fault("words", output[-300:])
        if contents(work, target.keeps) != before:
            raise Fault("lost", "a file")
        target.checked(work, command, code, output)
    except Exception as error:
        kind, found = (error.kind, error.what) if isinstance(error, Fault) else ("traceback", _where(error))
        raise Fault(kind, f"{what}; {' '.join(command)}: {found}") from error
    return code


def _where(error: Exception) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    mine = [f"{Path(f.filename).name}:{f.lineno}" for f in frames if "/site-packages/" not in f.filename]
    return f"{error!r:.200} at {' '.join(mine[-3:])}"
