"""Answers to questions about plans, each kept in a file: an interrupted search finds them there."""

from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import asdict, replace
from math import inf
from pathlib import Path
from typing import Any

from harness.measurement.scheduler import done_as_completed, refuse_lost_workers
from harness.placement.session import Outcome, Question, Study, answer
from harness.planning.form_choice import chosen_form
from harness.results import records
from harness.results.records import to_line
from harness.series.load_case_source import RANDOM, GapCases
from problems.errors import InputError
from problems.forms import Form
from problems.model.scene import JointScene
from problems.storage import digest


class AnswerJournal:
    """Answers questions: from the file at `path`, else now, and the file then has the answer too.

    identity : what decides the answers. pool : the workers and their number; None: this process answers.

    Raises InputError if the file has another identity, or a damaged line: nothing proves its answer anew.
    """

    def __init__(
        self, study: Study, path: Path, identity: dict[str, Any], pool: tuple[Executor, int] | None
    ) -> None:
        self.study, self.path, self.pool = study, path, pool
        records.remove_torn_line(path)
        first, *rows = records.read(path) or [{}]
        if not first:
            records.append(path, identity)
        else:
            records.refuse_other(path, first, identity)
        for number, row in enumerate(rows, start=2):
            if row.pop("hash", None) != digest(to_line(row)):
                raise InputError.one(path, f"line {number}", "damaged", "remove it: it is answered anew")
        self.answers = {to_line(row["question"]): list(map(_outcome, row["outcomes"])) for row in rows}

    def __call__(self, questions: Sequence[Question]) -> list[list[Outcome]]:
        texts = [to_line(asdict(question)) for question in questions]
        new = {text: q for text, q in zip(texts, questions, strict=True) if text not in self.answers}
        if self.pool is None:
            for text, question in new.items():
                self._keep(text, question, answer((self.study, question)))
        else:
            tasks = ((text, (self._part(question), question)) for text, question in new.items())
            for text, outcomes in done_as_completed(*self.pool, answer, tasks):
                if isinstance(outcomes, BaseException):
                    refuse_lost_workers(outcomes)
                    raise outcomes
                self._keep(text, new[text], outcomes)
        return [self.answers[text] for text in texts]

    def _part(self, question: Question) -> Study:
        """The study with the data of the cases of a question alone, for a worker."""
        return replace(self.study, cases=self.study.cases.only(question.cases))

    def _keep(self, text: str, question: Question, outcomes: list[Outcome]) -> None:
        row = {"question": asdict(question), "outcomes": list(map(asdict, outcomes))}
        records.append(self.path, row | {"hash": digest(to_line(row))})
        self.answers[text] = outcomes


def form_of_search(path: Path, scene: JointScene, forms: Sequence[Form], cases: GapCases, items: int) -> Form:
    """The form of the answers in a journal, if it is one of `forms`; else the cheaper, for so many items."""
    wanted: Form | None = None
    with suppress(OSError, ValueError), path.open("rb") as file:
        recorded = records.parsed(file.readline()).get("form")
        wanted = next((form for form in forms if form == recorded), None)
    count = 1 if cases.is_single(scene) else cases.count or RANDOM
    return chosen_form(scene, forms, wanted, count * items).form


def _outcome(row: dict[str, Any]) -> Outcome:
    largest, mean, *further = map(_figures, (row["largest"], row["mean"], *row["further"]))
    return Outcome(largest, tuple(row["contact"]), mean, tuple(further), tuple(map(tuple, row["plan"])))


def _figures(values: Sequence[float | None]) -> tuple[float, ...]:
    """The figures of a line, whose null is an infinite one."""
    return tuple(inf if value is None else value for value in values)
