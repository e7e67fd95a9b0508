"""Rows on disk: whole lines, torn lines, a full disk, two writers."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from harness.results import records
from problems.errors import InputError


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / records.MEASUREMENTS
    for k in range(3):
        records.append(path, {"key": f"k{k}", "value": k})
    return path


def test_a_line_is_strict_json() -> None:
    row = {
        "a": np.float64(1.5),
        "b": float("nan"),
        "c": [np.int32(2), -np.inf],
        "d": np.bool_(True),
        "e": Path("p"),
    }
    assert json.loads(records.to_line(row)) == {"a": 1.5, "b": None, "c": [2, None], "d": True, "e": "p"}


@pytest.mark.parametrize("torn", [b'{"key": "k3", "va', b'{"key": "k3"}', b'{"key": "k3"\n', b"\xff\xfe"])
def test_a_torn_last_line_is_removed_by_run_and_stops_the_others(path: Path, torn: bytes) -> None:
    whole = path.read_bytes()
    path.write_bytes(whole + torn)
    with pytest.raises(InputError, match=r"measurements\.jsonl: line 4"):
        records.read(path)
    assert records.remove_torn_line(path)
    assert path.read_bytes() == whole
    assert not records.remove_torn_line(path)
    assert [row["value"] for row in records.read(path)] == [0, 1, 2]


def test_damage_in_the_middle_is_named_and_nothing_is_changed(path: Path) -> None:
    path.write_bytes(b"nonsense\n" + path.read_bytes())
    before = path.read_bytes()
    with pytest.raises(InputError, match="line 1 = 'nonsense'"):
        records.remove_torn_line(path)
    assert path.read_bytes() == before


def test_a_full_disk_leaves_the_rows_before(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(fd: int) -> None:
        raise OSError(28, "No space left on device")

    before = path.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left"):
            records.append(path, {"key": "k3"})
        with pytest.raises(OSError, match="No space left"):
            records.rewrite(path, [])
    assert path.read_bytes() == before


def test_a_directory_takes_one_run_at_a_time(tmp_path: Path) -> None:
    def enter_twice() -> None:
        with records.locked(tmp_path / "out"), records.locked(tmp_path / "out"):
            raise AssertionError("held twice")

    with pytest.raises(InputError, match="another run is writing here"):
        enter_twice()
    with records.locked(tmp_path / "out"):
        pass


def test_an_unwritable_directory_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # a long path is said shortened
    Path("file").touch()
    with pytest.raises(InputError, match=r"file/out'.*cannot be written"):
        records.locked(Path("file/out")).__enter__()
