"""Answers to questions about plans, each kept in a file: an interrupted search finds them there."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import asdict
from math import inf
from pathlib import Path
from typing import Any

from harness.measurement.scheduler import done_as_completed
from harness.placement.session import Outcome, Question, Study, answer
from harness.results import records
from harness.results.records import to_line
from problems.errors import InputError
from problems.storage import digest

PLANS = "plans.jsonl"


class Asked:
    """identity : what must be the same for kept answers to be answers. executor, count : the workers, or None
    for this process.

    Raises InputError if PATH has the answers of another search, or a damaged line: nothing proves them anew.
    """

    def __init__(
        self, study: Study, path: Path, identity: dict[str, Any], workers: tuple[Executor, int] | None
    ) -> None:
        self.study, self.path, self.workers = study, path, workers
        records.remove_torn_line(path)
        first, *rows = records.read(path) or [{}]
        if not first:
            records.append(path, identity)
        else:
            records.refuse_other(path, first, identity)
        for number, row in enumerate(rows, start=2):
            if row.pop("hash", None) != digest(to_line(row)):
                raise InputError.one(path, f"line {number}", "damaged", "remove it: it is answered anew")
        self.known = {to_line(row["question"]): list(map(_outcome, row["outcomes"])) for row in rows}

    def __call__(self, questions: Sequence[Question]) -> list[list[Outcome]]:
        texts = [to_line(asdict(question)) for question in questions]
        new = {text: q for text, q in zip(texts, questions, strict=True) if text not in self.known}
        if self.workers is None:
            for text, question in new.items():
                self._keep(text, question, answer((self.study, question)))
        else:
            tasks = ((text, (self.study, question)) for text, question in new.items())
            for text, found in done_as_completed(*self.workers, answer, tasks):
                if isinstance(found, BaseException):
                    raise found
                self._keep(text, new[text], found)
        return [self.known[text] for text in texts]

    def _keep(self, text: str, question: Question, found: list[Outcome]) -> None:
        row = {"question": asdict(question), "outcomes": list(map(asdict, found))}
        records.append(self.path, row | {"hash": digest(to_line(row))})
        self.known[text] = found


def _outcome(row: dict[str, Any]) -> Outcome:
    largest = tuple(inf if value is None else value for value in row["largest"])
    return Outcome(largest, tuple(row["contact"]), tuple(row["mean"]))
