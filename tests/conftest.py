"""What all tests share: a cache of their own, so that none reads or fills the user's; quick tests first; a
warning where the page was tried in no browser.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from browser import NO_BROWSER

DISTRIBUTED = "PYTEST_XDIST_WORKER" in os.environ

if DISTRIBUTED:  # a thread for each process; read when numpy is loaded
    os.environ |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@pytest.fixture(autouse=True, scope="session")
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """One for all processes of pytest-xdist, so that an assembly is built once."""
    folder = tmp_path_factory.getbasetemp()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIVETBENCH_CACHE", str((folder.parent if DISTRIBUTED else folder) / "cache"))
        yield


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Quick tests first."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is not None)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """What no test saw is said aloud: judge.js runs in a browser only."""
    reasons = [report.longrepr[2] for report in terminalreporter.getreports("skipped")]
    missing = [reason.partition(NO_BROWSER)[2] for reason in reasons if NO_BROWSER in reason]
    if missing:
        terminalreporter.write_sep("=", f"{len(missing)} browser tests SKIPPED", yellow=True, bold=True)
        terminalreporter.write_line(f"The page was not tried: {missing[0]}.", yellow=True)
