"""Runs solvers on problems, one process per measurement, and judges what they answer.

From Python: the functions of harness/api.py, imported when the first of them is asked for.
"""

import importlib
import os
from typing import TYPE_CHECKING, Any

# NumPy and SciPy bring an OpenBLAS each. Idle threads of the one spin on the processors that the other
# needs: with two threads on two cores Goldfarb–Idnani takes up to four times as long. 2⁴ cycles is the
# shortest wait before they sleep. Read when the library is loaded, so it has to stand here.
os.environ.setdefault("OPENBLAS_THREAD_TIMEOUT", "4")

if TYPE_CHECKING:
    from harness.api import *  # noqa: F403


def __getattr__(name: str) -> Any:
    if name == "__all__" or not name.startswith("_"):
        api = importlib.import_module("harness.api")
        if name in ("__all__", *api.__all__):
            return getattr(api, name)
    raise AttributeError(f"the public interface has no {name!r}")


def __dir__() -> list[str]:
    return list(__getattr__("__all__"))
