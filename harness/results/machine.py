"""The machine and the versions of a measurement, and the memory of this process."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import psutil

from problems import __version__

PACKAGES = ("rivetbench", "numpy", "scipy", "qpsolvers", "osqp", "clarabel", "proxsuite", "piqp")


def machine() -> dict[str, Any]:
    """CPU, cores, memory, system, BLAS kernels and versions; `machine` names it in one line."""
    cpu, cores = _cpu_model(), usable_cores()
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


def _cpu_model() -> str:
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
