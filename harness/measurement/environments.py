"""Environments with other versions of a library than this one has, as `run --with piqp==0.6.2` asks for.

Each is a virtual environment in the cache, made by venv and pip, whose path ends with this interpreter's
site-packages: only the requested package and its dependencies are new.
"""

import importlib.util
import shutil
import site
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from importlib.metadata import distribution
from pathlib import Path

from problems import storage
from problems.errors import InputError
from problems.reporter import SILENT, Reporter

#: The file that adds this interpreter's folders. Its name sorts last, so that the folders of the other .pth
#: files come first.
PARENT = "zzz-parent.pth"
#: The folder of packages made by cmeel, such as proxsuite; the .pth of cmeel is read only beside cmeel.
CMEEL = "cmeel.prefix/lib/python{}.{}/site-packages".format(*sys.version_info)
COMPLETE = "complete"
LAST_LINES = 5  # of what pip prints


def interpreter(requirements: Sequence[str], reporter: Reporter = SILENT) -> str:
    """The Python that has these packages, each NAME==VERSION; without any, this one.

    The first call makes the environment, later ones find it. Raises InputError if pip fails; the next call
    tries anew.
    """
    if not requirements:
        return sys.executable
    key = f"{requirements[0]}-{storage.digest(list(requirements), sys.version, _packages())}"
    folder = storage.root() / key
    python = folder / "bin" / "python"
    with storage.lock(key):
        if not ((folder / COMPLETE).is_file() and python.exists()):  # else one was cut off, or its base moved
            shutil.rmtree(folder, ignore_errors=True)
            with reporter.step(f"installing {' '.join(requirements)}"):
                _make(folder, python, requirements)
            (folder / COMPLETE).touch()
    return str(python)


def _make(folder: Path, python: Path, requirements: Sequence[str]) -> None:
    without = ["--without-pip"] if importlib.util.find_spec("pip") else []  # it sees this interpreter's pip
    _called([sys.executable, "-m", "venv", *without, str(folder)], requirements)
    packages = sysconfig.get_path("purelib", "venv", {"base": str(folder), "platbase": str(folder)})
    lines = [f"import site; site.addsitedir({folder!r})" for folder in _packages()]
    (Path(packages) / PARENT).write_text("\n".join([CMEEL, *lines, ""]), "utf-8")
    pip = [str(python), "-I", "-m", "pip", "install", "--disable-pip-version-check", "--no-input"]
    # First the requested packages, even if this interpreter has them; then the dependencies that are missing.
    for more in (["--ignore-installed", "--no-deps"], []):
        _called([*pip, *more, *requirements], requirements)


def _packages() -> list[str]:
    """The folders of this interpreter's packages."""
    return [*site.getsitepackages(), *([site.getusersitepackages()] if site.ENABLE_USER_SITE else [])]


def refuse_other_copies(requirements: Sequence[str]) -> None:
    """Raise InputError if a package was imported from elsewhere than the environment, as by PYTHONPATH."""
    imported = [str(getattr(module, "__file__", None)) for module in sys.modules.values()]
    for requirement in requirements:
        library, _, version = requirement.partition("==")
        installed = distribution(library)
        for file in installed.files or ():
            expected = str(installed.locate_file(file))
            others = (path for path in imported if path.endswith(f"/{file}") and path != expected)
            if other := next(others, None):
                raise InputError.one("--with", library, version, f"another copy is imported: {other}")


def _called(command: Sequence[str], requirements: Sequence[str]) -> None:
    """Wait for a command. Raises InputError with the end of what it printed if it fails."""
    nothing, pipe, same = subprocess.DEVNULL, subprocess.PIPE, subprocess.STDOUT
    ended = subprocess.run(command, stdin=nothing, stdout=pipe, stderr=same, errors="replace")
    if ended.returncode:
        library, _, version = requirements[0].partition("==")
        allowed = f"pip cannot install it: `pip index versions {library}` lists all; run again to retry"
        said = [line.strip() for line in ended.stdout.splitlines() if line.strip()]
        last = [line for line in said if not line.startswith("WARNING")][-LAST_LINES:]
        raise InputError.one("--with", library, version, "\n".join([allowed, *last]))
