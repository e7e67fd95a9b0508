"""The origin of a row: the machine, its memory and versions; the commit of the code, and its changes."""

import hashlib
import os
import platform
import subprocess
from collections.abc import Iterable
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import psutil

from problems import ROOT, __version__

from .schema import Provenance

PACKAGES = ("rivetbench", "numpy", "scipy", "qpsolvers", "osqp", "clarabel", "proxsuite", "piqp")
#: The code that can change a row; the report only shows rows.
CODE = ("problems", "solvers", "harness", "pyproject.toml")
#: Tracked in a work tree of this project; a tree that merely contains an installed copy tracks neither.
OWN_FILES = ("pyproject.toml", "harness/results/provenance.py")
#: Set by git for its hooks, to the tree that the hook is for.
HOOK_VARIABLES = ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_COMMON_DIR")


def provenance() -> Provenance:
    """The commit of the code in these packages, and whether the code is as committed: in every row.

    In a git work tree of the project: the 40 hexadecimal digits of the last commit that touched CODE (commits
    to documents or results do not count), and whether CODE has no changes. An untracked file is a change,
    because plug-ins are found by discovery. Without such a work tree or git: the version, and None.
    """
    prefix = _git("rev-parse", "--show-prefix")  # not empty in a work tree of another project
    ours = prefix == "\n" and _git("ls-files", "--error-unmatch", "--", *OWN_FILES) is not None
    if not (ours and (digits := _git("log", "-1", "--format=%H", "--", *CODE))):
        return {"commit": __version__, "clean": None}
    changes = _git("status", "--porcelain", "--untracked-files=all", "--", *CODE)
    return {"commit": digits.strip(), "clean": None if changes is None else not changes}


def stamp() -> dict[str, Any]:
    """Machine, version, commit and time of a record."""
    origin = {"machine": machine()["machine"], "version": installed_version("rivetbench"), **provenance()}
    return origin | {"recorded_at": datetime.now(UTC).isoformat(timespec="seconds")}


def fingerprints(files: Iterable[Path]) -> dict[str, str]:
    """The SHA-256 of files by their names; of two of one name, the second by its whole path."""
    digits: dict[str, str] = {}
    for file in dict.fromkeys(file.absolute() for file in files):
        name = str(file) if file.name in digits else file.name
        with file.open("rb") as content:
            digits[name] = hashlib.file_digest(content, "sha256").hexdigest()
    return digits


def _git(*arguments: str) -> str | None:
    """The output of git about ROOT; None if git is not installed or fails."""
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


def machine() -> dict[str, Any]:
    """CPU, cores, memory, system, BLAS kernels and versions; `machine` names it in one line."""
    cpu, cores = cpu_model(), usable_cores()
    system = f"{platform.system()} {platform.release()}"
    return {
        "machine": f"{cpu}, {cores} cores, {system}",
        "cpu": cpu,
        "cores": cores,
        "memory_mib": physical_memory_mib(),
        "system": system,
        "platform": platform.platform(),
        "python": platform.python_version(),
        "blas": _blas(),
        "versions": {name: installed_version(name) for name in PACKAGES},
    }


def usable_cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def physical_memory_mib() -> int:
    return int(psutil.virtual_memory().total // 2**20)


def resident_mib(name: str) -> float | None:
    """Resident memory of this process, now (VmRSS) or at its highest (VmHWM), MiB.

    (ru_maxrss also counts the process before exec on Linux.)
    """
    try:
        status = Path("/proc/self/status").read_text()
    except OSError:
        return None
    return int(status.partition(f"{name}:")[2].split()[0]) / 1024


def installed_version(package: str) -> str:
    """The version of a package or "unknown"; rivetbench's is that of the running code."""
    if package == "rivetbench":
        return __version__
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def cpu_model() -> str:
    """The name of the CPU."""
    info = Path("/proc/cpuinfo")
    for line in info.read_text().splitlines() if info.exists() else []:
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def blas_kernels(pools: list[dict[str, Any]]) -> list[str]:
    """Library, version and architecture of the BLAS among the pools of threadpoolctl."""
    names = ("internal_api", "version", "architecture")
    blas = [pool for pool in pools if pool["user_api"] == "blas"]
    return sorted({" ".join(str(pool[name]) for name in names if pool.get(name)) for pool in blas})


def _blas() -> list[str]:
    """The BLAS libraries of numpy and scipy."""
    import scipy.linalg  # noqa: F401  loads scipy's own
    import threadpoolctl

    return blas_kernels(threadpoolctl.threadpool_info())
