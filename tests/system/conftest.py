"""A browser without a window or a network, one for all tests of pages; a cache of a test's own."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from suite_runs import all_end

FLAGS = (
    *("headless", "no-sandbox", "disable-gpu", "disable-quic", "no-first-run", "disable-sync"),
    *("disable-background-networking", "disable-component-update", "window-size=1400,1000"),
)


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Its driver; where none is installed, the tests skip."""
    driver = shutil.which("chromedriver")
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if not (driver and chromium):
        pytest.skip("no Chromium with its driver is installed (apt install chromium-driver)")
    webdriver = pytest.importorskip("selenium.webdriver")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for flag in (*FLAGS, f"user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(f"--{flag}")
    started = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    started.execute_cdp_cmd("Emulation.setFocusEmulationEnabled", {"enabled": True})  # else no event of focus
    try:
        yield started
    finally:
        started.quit()


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A cache that marks the processes of a test, which are to end."""
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))
    yield
    assert all_end(tmp_path / "cache")
