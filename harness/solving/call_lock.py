"""One call at a time in a process: BLAS has one number of threads for all, which a factorisation changes and
rounding depends on, and threads may share a scene whose factors are made when first needed. Several calls at
once need a process each. A call from within a call goes ahead if it comes from the same thread.
"""

import os
import threading
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import threadpoolctl

P = ParamSpec("P")
R = TypeVar("R")

TURN = threading.RLock()
if hasattr(os, "register_at_fork"):  # a child has none of the other threads, which could not end their turn
    os.register_at_fork(after_in_child=TURN._at_fork_reinit)  # type: ignore[attr-defined]


def in_turn(function: Callable[P, R]) -> Callable[P, R]:
    """The function, which waits until no other thread is in one of these."""

    @wraps(function)
    def call(*args: P.args, **options: P.kwargs) -> R:
        with TURN:
            return function(*args, **options)

    return call


def keeps_threads(function: Callable[P, R]) -> Callable[P, R]:
    """The function, after which linear algebra has as many threads as before."""

    @wraps(function)
    def call(*args: P.args, **options: P.kwargs) -> R:
        with threadpoolctl.threadpool_limits():
            return function(*args, **options)

    return call
