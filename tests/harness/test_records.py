"""Rows on disk: whole lines, torn lines, a full disk, two writers; their fields; on the terminal."""

import json
import os
from dataclasses import fields
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from published_runs import DIRECTORIES

from harness.results import records, schema
from harness.verification.judge import Judgement
from problems.errors import InputError
from problems.ladders import LADDERS
from problems.random_scenes import EXAMPLES
from solvers.base import Status


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

    whole = path.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left"):
            records.append(path, {"key": "k3"})
        with pytest.raises(OSError, match="No space left"):
            records.rewrite(path, [])
    assert path.read_bytes() == whole


# --- the names of a row's fields, in one place for the harness and the report ---------------------------


@pytest.mark.parametrize("directory", DIRECTORIES, ids=lambda path: path.name)
def test_published_rows_are_of_the_schema(directory: Path) -> None:
    for row in records.read(directory / records.MEASUREMENTS):
        assert row["status"] in schema.STATUSES
        assert row["verdict"] in schema.VERDICTS
        assert row.keys() <= schema.FIELDS.keys()


def test_the_vocabulary_is_that_of_solvers_judge_and_ladders() -> None:
    assert set(get_args(Status)) == set(schema.STATUSES[:4])
    assert {field.name for field in fields(Judgement)} <= set(schema.FIELDS)
    assert schema.LADDERS == LADDERS
    assert all(name.startswith(schema.DRAWN) for name in EXAMPLES)
    assert schema.ANSWERED == ("within", "outside", "cannot_be_judged")
