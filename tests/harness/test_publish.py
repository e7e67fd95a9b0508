"""`publish`: what is measured, what counts as this code; nothing is lost before its time."""

from collections.abc import Callable
from pathlib import Path

import pytest
from commands import harness

from harness.cli import publish as command
from harness.planning.suite import suite_names
from harness.results import published
from harness.results.records import MEASUREMENTS, append
from problems.errors import InputError

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
    monkeypatch.setattr(published, "commit", lambda: (CODE, True))
    monkeypatch.chdir(published.ROOT)
    for name in SUITES:
        measured(tmp_path / "published" / name, row("b" * 40))
    return tmp_path / "published"


def publish(monkeypatch: pytest.MonkeyPatch, run: Callable[[list[str]], int]) -> tuple[int, str, list[str]]:
    """Exit code, output, and what was measured, each by `run`, which is given the words of a command."""
    asked: list[str] = []

    def ended(words: list[str]) -> int:
        if words[0] == "report":
            return 0
        asked.append(words[1])
        return run(words)

    monkeypatch.setattr(command, "_ended", ended)
    done = harness("publish", *SUITES)
    return done.exit_code, done.output, asked


def good(words: list[str]) -> int:
    measured(Path(words[-1]), row(), row(minute=1))
    return 0


def test_every_suite_but_those_of_users_and_of_the_ci_is_published_once() -> None:
    names = published.names()
    assert sorted(names) == sorted([*set(suite_names()) - {"gate", "scenes"}, "gaps"])
    assert published.chosen(["hard", "speed"]) == ["speed", "hard"]
    with pytest.raises(InputError, match=r"NAMES, name = 'sped'|sped"):
        published.chosen(["sped"])


def test_what_is_whole_takes_the_place_of_the_old_and_is_not_measured_again(
    there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, output, asked = publish(monkeypatch, good)
    assert (code, asked) == (0, SUITES)
    assert "Suite 1 of 2: default" in output
    for name in SUITES:
        assert published.is_of(published.rows_of(there / name), CODE)
    assert (there / "index.md").read_text("utf-8").startswith(f"# Published results: commit {CODE}\n")
    assert publish(monkeypatch, good)[::2] == (0, [])


def test_a_suite_that_is_not_whole_leaves_the_old_and_is_continued(
    there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(words: list[str]) -> int:
        if words[1] == "scaling":
            measured(Path(words[-1]), row())
            return 130
        return good(words)

    code, _, asked = publish(monkeypatch, stopped)
    assert (code, asked) == (130, SUITES)
    assert published.is_of(published.rows_of(there / "default"), CODE)
    assert published.is_of(published.rows_of(there / "scaling"), "b" * 40)
    assert len(published.rows_of(published.staged("scaling", CODE))) == 1
    code, _, asked = publish(monkeypatch, good)
    assert (code, asked) == (0, ["scaling"])
    assert len(published.rows_of(there / "scaling")) == 3


def test_one_that_fails_or_is_of_changed_code_is_not_published_and_the_others_are(
    there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert publish(monkeypatch, lambda words: 1 if words[1] == "default" else good(words))[0] == 1
    assert published.is_of(published.rows_of(there / "default"), "b" * 40)
    assert published.is_of(published.rows_of(there / "scaling"), CODE)

    def changed(words: list[str]) -> int:
        measured(Path(words[-1]), row(clean=False))
        return 0

    assert publish(monkeypatch, changed)[::2] == (1, ["default"])
    assert published.is_of(published.rows_of(there / "default"), "b" * 40)


def test_large_files_gaps_and_locks_are_left_out(tmp_path: Path) -> None:
    kept_kb = published.KEPT_SCENE_KB * 1000
    for name, size in (("small", 1000), ("many", kept_kb), ("large", published.KEPT_MIB * 2**20 + 1)):
        folder = tmp_path / name
        measured(folder, row())
        for file in ("answers/a.npz", "answers/.lock", ".lock", "scenes/a.npz"):
            (folder / file).parent.mkdir(exist_ok=True)
            (folder / file).write_bytes(bytes(10 if file == ".lock" else size))
        if name == "many":
            for k in range(published.KEPT_MIB * 2**20 // kept_kb):
                (folder / f"scenes/{k}.npz").write_bytes(bytes(kept_kb))
        published.publish(name, folder, tmp_path / "published")
    kept = {str(path.relative_to(tmp_path / "published")) for path in (tmp_path / "published").rglob("*.*")}
    rows = {f"{name}/{MEASUREMENTS}" for name in ("small", "many", "large")}
    assert kept == rows | {"small/answers/a.npz", "small/scenes/a.npz", "many/answers/a.npz"}


@pytest.mark.parametrize(
    ("known", "why"), [((CODE, False), "not committed"), (("0.1.0", None), "must be in a clone")]
)
def test_code_of_no_commit_is_refused(
    there: Path, monkeypatch: pytest.MonkeyPatch, known: tuple[str, bool | None], why: str
) -> None:
    monkeypatch.setattr(published, "commit", lambda: known)
    code, output, asked = publish(monkeypatch, good)
    assert (code, asked) == (2, [])
    assert why in output


def test_another_checkout_is_refused(there: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    code, output, asked = publish(monkeypatch, good)
    assert (code, asked) == (2, [])
    assert "go there" in output


def test_an_interruption_is_not_counted_as_time() -> None:
    pauses = [row(minute=minute) for minute in (0, 2, 7, 50)]
    assert published.seconds(pauses) == 7 * 60
    assert published.seconds([row()]) is None


def test_the_commands_exist(tmp_path: Path) -> None:
    """Each is known to the command line, which then names what is missing."""
    assert command._ended(["run", "no-such-suite", "--out", str(tmp_path)]) == 2
    assert command._ended([*published.command("gaps", tmp_path), "--solver", "nobody"]) == 2
