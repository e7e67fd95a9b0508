"""The names of a row's fields, in one place for the harness and the report."""

import json
from dataclasses import fields
from pathlib import Path
from typing import get_args

import pytest

from harness.results import schema
from harness.verification.judge import Judgement
from problems.drawn import EXAMPLES
from problems.ladders import LADDERS
from solvers.base import Status

PUBLISHED = Path(__file__).parents[2] / "results" / "published"
RESULTS = sorted(path.parent.name for path in PUBLISHED.glob("*/measurements.jsonl"))
TYPES = {"number": (int, float), "text": str, "flag": bool, "object": dict}
FORMERLY = {"together": "batched"}


@pytest.mark.parametrize("name", RESULTS)
def test_every_field_of_the_published_rows_is_in_the_schema_with_its_kind(name: str) -> None:
    for line in (PUBLISHED / name / "measurements.jsonl").read_text("utf-8").splitlines():
        row = json.loads(line)
        assert row["status"] in schema.STATUSES
        assert row["verdict"] in schema.VERDICTS
        for field, value in row.items():
            kind = schema.FIELDS[FORMERLY.get(field, field)]
            assert value is None or isinstance(value, TYPES[kind]), field
            assert kind == "flag" or not isinstance(value, bool), field


def test_the_vocabulary_is_that_of_solvers_judge_and_ladders() -> None:
    assert set(get_args(Status)) == set(schema.STATUSES[:4])
    assert {field.name for field in fields(Judgement)} == set(schema.JUDGED)
    assert schema.LADDERS == LADDERS
    assert all(name.startswith(schema.DRAWN) for name in EXAMPLES)
    assert schema.ANSWERED == ("within", "outside", "cannot_be_judged")


def test_a_field_has_one_kind() -> None:
    groups = (schema.ASKED, schema.PROBLEM, schema.MEASURED, schema.MEASURED_OF_CASES, schema.JUDGED)
    assert sum(map(len, (*groups, schema.ORIGIN))) == len(schema.FIELDS)
    assert sorted(name for kind in TYPES for name in schema.of_kind(kind)) == sorted(schema.FIELDS)
