"""`publish`: what is measured, what counts as this code; nothing is lost before its time."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from commands import harness
from matplotlib import colormaps
from PIL import Image

from harness.planning.suite import suite_names
from harness.results.records import MEASUREMENTS, append
from studies import publish as published

CODE = "c" * 40
SUITES = ["default", "scaling"]


def row(commit: str | None = CODE, clean: bool | None = True, minute: int = 0) -> dict[str, object]:
    when = f"2026-01-01T00:{minute:02}:00+00:00"
    about = {"scene": "4386/0107", "solver": "gi", "form": "dual", "status": "solved", "verdict": "within"}
    facts = {"machine": "m", "commit": commit, "clean": clean, "recorded_at": when, "threads": 2}
    return {"key": f"{minute}", "repeat": minute, "tolerance": 1e-9, **about, **facts}


def measured(directory: Path, *rows: dict[str, object]) -> None:
    directory.mkdir(parents=True, exist_ok=True)
    append(directory / MEASUREMENTS, *rows)


@pytest.fixture
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An earlier publication of two suites; the code is clean."""
    monkeypatch.setattr(published, "PUBLISHED", tmp_path / "published")
    monkeypatch.setattr(published, "STAGED", tmp_path / "publishing")
    monkeypatch.setattr(published, "provenance", lambda: {"commit": CODE, "clean": True})
    monkeypatch.chdir(published.ROOT)
    for name in SUITES:
        measured(tmp_path / "published" / name, row("b" * 40))
    return tmp_path / "published"


def publish(monkeypatch: pytest.MonkeyPatch, run: Callable[[Sequence[str]], int]) -> tuple[int, list[str]]:
    """Exit code, and what was measured, each by `run`, which is given the words of a command."""
    suites: list[str] = []

    def ended(words: Sequence[str]) -> int:
        suites.append(words[1])
        return run(words)

    monkeypatch.setattr(published, "ended", ended)
    return published.main(SUITES), suites


def good(words: Sequence[str]) -> int:
    measured(Path(words[-1]), row(), row(minute=1))
    return 0


def test_suites_and_series_are_published_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert set(published.NAMES) <= {*suite_names(), *published.SERIES}
    assert len(set(published.NAMES)) == len(published.NAMES)
    with pytest.raises(SystemExit, match="2"):
        published.main(["sped"])
    assert "unknown: sped" in capsys.readouterr().err


def test_what_is_whole_takes_the_place_of_the_old(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert publish(monkeypatch, good) == (0, SUITES)
    for name in SUITES:
        assert published.is_of(published.rows_of(there / name), CODE)
    lines = (there / "index.md").read_text("utf-8").splitlines()
    assert lines[2].startswith("Measured on 1 machine: m. Each row")
    assert [line.split(" | ")[0].strip("| ") for line in lines[-2:]] == [f"[{n}]({n})" for n in SUITES]
    assert all("cccccccccccc |" in line for line in lines[-2:])
    assert publish(monkeypatch, good) == (0, [])


def test_an_unfinished_suite_leaves_the_old(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(words: Sequence[str]) -> int:
        if words[1] == "scaling":
            measured(Path(words[-1]), row())
            return 130
        return good(words)

    assert publish(monkeypatch, stopped) == (130, SUITES)
    assert published.is_of(published.rows_of(there / "default"), CODE)
    assert published.is_of(published.rows_of(there / "scaling"), "b" * 40)
    assert publish(monkeypatch, good) == (0, ["scaling"])
    assert len(published.rows_of(there / "scaling")) == 3


def test_one_that_fails_is_not_published(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert publish(monkeypatch, lambda words: 1 if words[1] == "default" else good(words))[0] == 1
    assert published.is_of(published.rows_of(there / "default"), "b" * 40)
    assert published.is_of(published.rows_of(there / "scaling"), CODE)

    def changed(words: Sequence[str]) -> int:
        measured(Path(words[-1]), row(clean=False))
        return 0

    assert publish(monkeypatch, changed) == (1, ["default"])
    assert published.is_of(published.rows_of(there / "default"), "b" * 40)


def test_scenes_large_answers_and_most_logs_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(published, "PUBLISHED", tmp_path / "published")
    monkeypatch.setattr(published, "WITH_LOGS", ("large",))
    for name, size in (("small", 1000), ("large", published.KEPT_KIB * 2**10 + 1)):
        folder = tmp_path / name
        measured(folder, row(), row(minute=1) | {"solver": "osqp", "log": "logs/a.txt"})
        for file in ("answers/a.npz", "answers/.lock", ".lock", "scenes/a.npz", "logs/a.txt", "logs/b.txt"):
            (folder / file).parent.mkdir(exist_ok=True)
            (folder / file).write_bytes(bytes(10 if file == ".lock" else size))
        published.publish(name, folder)
    kept = {str(path.relative_to(tmp_path / "published")) for path in (tmp_path / "published").rglob("*.*")}
    rows = {f"small/{MEASUREMENTS}", f"large/{MEASUREMENTS}"}
    assert kept == rows | {"small/answers.zip", "large/logs/a.txt"}


@pytest.mark.parametrize("code", [(CODE, False), ("0.1.0", None)])
def test_commit_needed(there: Path, monkeypatch: pytest.MonkeyPatch, code: tuple[str, bool | None]) -> None:
    monkeypatch.setattr(published, "provenance", lambda: dict(zip(("commit", "clean"), code, strict=True)))
    with pytest.raises(SystemExit, match="2"):
        publish(monkeypatch, good)


def test_another_checkout_is_refused(there: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match="2"):
        publish(monkeypatch, good)


def test_an_interruption_is_not_counted_as_time() -> None:
    assert published.minutes([row(minute=minute) for minute in (0, 2, 7, 50)]) == 7
    assert published.minutes([row()]) is None


def test_a_picture_is_small_and_looks_the_same(tmp_path: Path) -> None:
    """A colour bar of some rows beside much white and dots of grey: each channel within 1/30 of its range."""
    random, picture = np.random.default_rng(0), np.full((200, 256, 3), 255, dtype=np.uint8)
    picture[50:150, :, :] = random.integers(0, 256, (100, 256, 1))
    picture[190:] = (255 * colormaps["viridis"](np.arange(256))[:, :3]).round()
    Image.fromarray(picture).save(path := tmp_path / "ramp.png")
    size = path.stat().st_size
    published.slim(path)
    with Image.open(path) as image:
        assert image.mode == "P"
        assert abs(np.asarray(image.convert("RGB"), dtype=int) - picture).max() <= 255 / 30
    assert path.stat().st_size < size


def test_the_commands_exist(tmp_path: Path) -> None:
    """Each is known to the command line, which then names what is missing or wrong."""
    assert published.ended(["--version"]) == 0
    assert "no-such-suite" in harness("run", "no-such-suite", "--out", tmp_path).output
    words = ["series", *published.SERIES["gaps"], "--out", tmp_path]
    assert "must be positive and finite" in harness(*words, "--tolerance", 0).output
