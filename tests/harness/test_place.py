"""Where fasteners go: plans against other answers and full enumeration; refused, resumed, on workers."""

import json
import re
import tomllib
from concurrent.futures import CancelledError, ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from hashlib import sha256
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pandas as pd
import pytest
from clopper_pearson import interval_of
from commands import harness, wrong_usage
from scipy.stats import binom, binomtest
from small_joints import FASTENERS, GAP, INLINE, two_parts
from superelements import scene_from, with_bay

from harness import GapCases, shim, solve
from harness import place as place_fasteners
from harness.placement import search as search_module
from harness.placement.answer_journal import AnswerJournal
from harness.placement.candidates import MovableFasteners, Plan, grid, plan_of, uniform_plans
from harness.placement.fresh_cases import Cases, Goal, Sample, SearchOutcome, search_in_rounds
from harness.placement.plan_search import Step
from harness.placement.search import Search
from harness.placement.search_record import record_of, sentence_on
from harness.placement.session import FastenerStudy, Outcome, PlanSession, Question, answer
from harness.planning.form_choice import Choice
from harness.results import series_file
from harness.results.records import PLANS
from harness.scene.scene_file import MOVED, edited, with_fasteners
from problems.build import load_case
from problems.errors import InputError
from problems.input.tables import TableOptions
from problems.load_cases.measured_gaps import MeasuredGaps
from problems.load_cases.random_gaps import RandomGaps, random_gaps
from problems.reporter import Reporter
from problems.scene_files import read_scene, scene_of
from report.writers.place_report import _summary


@pytest.fixture(scope="module")
def strip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("place") / "strip.toml"
    path.write_text(two_parts(length=200.0, nodes=(21, 4)) + GAP + FASTENERS)
    return path


def study_of(path: Path, cases: int = 6) -> FastenerStudy:
    movable = MovableFasteners.of(read_scene(str(path)))
    gaps = random_gaps(movable.bare, cases, 0)
    return FastenerStudy.of(movable, gaps, "dual")


def plans_of(path: Path, rows: int, columns: int) -> Plan:
    return plan_of(grid(read_scene(str(path)), rows, columns))


@pytest.fixture(scope="module")
def session(strip: Path) -> PlanSession:
    return PlanSession(study_of(strip))


def test_a_plan_leaves_what_a_scene_with_its_fasteners_leaves(strip: Path, session: PlanSession) -> None:
    """Against `solve` on the scene with these fasteners and each gap, by another way to the loads."""
    plan = ((33.0, 12.5), (120.0, 40.0))
    (outcome,) = session.answer(Question((plan,), (0, 1, 2)))
    _, estimated = session.answer(Question(((), plan), (0, 1, 2), base=((33.0, 12.5),)))
    np.testing.assert_allclose(estimated.largest, outcome.largest, rtol=0, atol=1e-6)
    text = strip.read_text().replace(
        "[[20.0, 10.0], [50.0, 25.0], [80.0, 40.0]]", str([list(p) for p in plan])
    )
    for case, largest in enumerate(outcome.largest):
        seed = session.study.cases.parameters(case)["gap_seed"]
        path = strip.with_name(f"case{case}.toml")
        path.write_text(text.replace("seed = 3", f"seed = {seed}"))
        answer = solve(str(path))
        assert answer.gap.max() <= largest <= answer.gap.max() + 1e-7
        assert answer.gap.argmax() == outcome.contact[case]


def test_doubt_counts_against_a_plan(session: PlanSession, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its largest gap is no less than the proven upper bound of any."""
    question = Question((((33.0, 12.5),),), (0, 1))
    (sure,) = session.answer(question)
    m = session.last.data.assembly.m
    monkeypatch.setattr(session.last, "gap_error", lambda *_: np.linspace(0.0, 1e-3, m))
    (unsure,) = session.answer(question)
    np.testing.assert_allclose(np.subtract(unsure.largest, sure.largest), 1e-3, rtol=0.01)


def test_an_outcome_is_that_of_its_question_alone(strip: Path, session: PlanSession) -> None:
    """To the last bit, whatever was asked before: so that workers agree."""
    first, second = plans_of(strip, 1, 3), plans_of(strip, 1, 4)
    questions = [
        Question((second,), (0, 3), base=first),
        Question((first, second), (1, 2)),
        Question((first,), (0, 3), base=second),
    ]
    in_turn = [session.answer(question) for question in questions]
    fresh = [PlanSession(session.study).answer(question) for question in reversed(questions)]
    assert in_turn == fresh[::-1]


def test_load_cases_of_earlier_questions_are_forgotten(strip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The oldest first, beyond room for two and for their forces, but none of a question; outcomes stay."""
    session, plan = PlanSession(study_of(strip)), plans_of(strip, 1, 3)
    contacts = session.last.data.assembly.m
    monkeypatch.setattr("harness.placement.session.LOADS_BYTES", 8 * (2 * contacts + 2 * 2 * contacts))
    first = session.answer(Question((plan,), (0, 1, 2)))
    assert [k for _, k in session.loads] == [0, 1, 2]
    session.answer(Question((plan,), (3,)))
    assert [k for _, k in session.loads] == [2, 3]
    assert session.answer(Question((plan,), (0, 1, 2))) == first


def searched(session: PlanSession, limit: float, candidates: Plan, allowed: int = 0) -> Search:
    nodes = session.last.data.assembly.contact_nodes
    assert nodes is not None
    bare, count = session.study.bare, session.study.cases.count
    answers = lambda questions: [session.answer(q) for q in questions]  # noqa: E731
    return Search(answers, count, allowed, limit, bare, nodes, candidates)


@pytest.fixture
def no_plan_by_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    """As with so many candidates that plans cannot all be compared."""
    monkeypatch.setattr(search_module, "PLANS", 0)


@pytest.mark.usefixtures("no_plan_by_plan")
def test_fewest_are_near_optimum(strip: Path, session: PlanSession) -> None:
    """Against all plans of ever more of eight candidates, solved once for both limits."""
    candidates, answer = plans_of(strip, 2, 4), cache(session.answer)
    for limit, allowed in ((0.03, 0), (0.05, 2)):
        search = searched(session, limit, candidates, allowed)
        search = replace(search, ask=lambda questions: [answer(q) for q in questions])
        optimum = next(
            count
            for count in range(len(candidates) + 1)
            if any(step.gap_mm <= limit for step in search.wholes([*combinations(candidates, count)]))
        )
        best, _ = search.fewest(search.whole(candidates))
        assert search.whole(best.plan).gap_mm == best.gap_mm <= limit
        assert optimum <= len(best.plan) <= optimum + 1


def test_lazy_removal_asks_less(strip: Path, session: PlanSession, monkeypatch: pytest.MonkeyPatch) -> None:
    """As if every fastener were tried in every step."""
    monkeypatch.setattr(search_module, "AT_ONCE", 2)
    candidates, questions = plans_of(strip, 2, 4), list[Question]()
    search = searched(session, 0.0, candidates)
    lazy = replace(search, ask=lambda some: questions.extend(some) or search.ask(some))  # type: ignore[func-returns-value]
    *_, last = lazy.removal(search.whole(candidates), {})
    tried = sum(len(q.plans) * len(q.cases) for q in questions if q.base is not None)
    assert last.plan == ()
    assert tried < 8 * 9 // 2 * search.cases


def test_uniform_plans_of_any_number(strip: Path) -> None:
    """In rows of as many fasteners, or one more, each evenly along the joint."""
    bare = study_of(strip).bare
    for count in (1, 2, 7, 12):
        plans = uniform_plans(bare, count)
        assert [len(plan) for plan in plans] == [count] * min(count, 4)
        for rows, plan in enumerate(plans, start=1):
            lines = [sorted(x for x, y in plan if y == at) for at in sorted({y for _, y in plan})]
            assert len(lines) == rows
            assert {len(line) for line in lines} <= {count // rows, count // rows + 1}
            assert all(line[0] == pytest.approx(100 / len(line), abs=1e-6) for line in lines)
    assert plan_of(grid(bare, 3, 4)) == uniform_plans(bare, 12)[2]


def test_uniform_patterns_are_in_holes_that_can_be_drilled(strip: Path, session: PlanSession) -> None:
    holes = plans_of(strip, 2, 5)[1:]
    search = searched(session, 0.03, holes)
    tried = [*search.even(3), *search.even(9)]
    assert all(set(plan) <= set(holes) for plan in tried)
    assert [len(plan) for plan in tried] == [3, 3, 3, 9]


def told(strip: Path, candidates: Plan, gap_of: Any, cases: int = 1) -> Search:
    """A search whose cases have these gaps, each at another candidate, in turn."""

    def outcomes(question: Question) -> list[Outcome]:
        at = tuple(case % len(candidates) for case in question.cases)
        gaps = [tuple(gap_of(plan, case) for case in question.cases) for plan in question.plans]
        return [Outcome(some, at, some) for some in gaps]

    bare = study_of(strip).bare
    return Search(
        lambda some: list(map(outcomes, some)), cases, 0, 0.0, bare, np.array(candidates), candidates
    )


def test_no_two_fasteners_next_to_each_other_go_at_once(strip: Path) -> None:
    """Of five in a line, needed less the further right, the two at the right are neighbours: one goes."""
    line = tuple((10.0 * k, 0.0) for k in range(5))
    search = told(strip, line, lambda plan, _: sum(1.0 / (1.0 + x) for x, _ in set(line) - set(plan)))
    start = search.whole(line)
    assert search._without_least(start, {}, 2).plan == line[:4]
    assert search._without_least(start, {}, 3).plan == (line[0], line[1], line[3])


def test_a_plan_that_fresh_cases_refute_is_searched_again(strip: Path) -> None:
    """None of the 60 cases that choose needs more than a fastener, and all after them two."""
    candidates, told_by = plans_of(strip, 1, 4), Mock(spec=Reporter)
    search = replace(told(strip, candidates, lambda plan, case: 2.0 - min(len(plan), 2)), limit_mm=0.5)
    search.reporter = told_by
    needs_two = search.ask
    easy = told(strip, candidates, lambda plan, case: float(case >= 60 and len(plan) < 2)).ask
    goal = Goal(0.5, 0.95, None)
    rounds = search_in_rounds(replace(search, ask=easy), (), goal, Cases.of(60, False, goal))
    first, second = rounds.samples
    assert (len(first.step.plan), first.kept) == (0, 0)
    ((sentence,), _) = told_by.say.call_args
    assert sentence.endswith("that is too few. The search goes on with 120 cases")
    assert (len(second.step.plan), second.kept) == (2, len(second.numbers))
    # Each round spends half of what is left of 5 %.
    assert [len(sample.numbers) for sample in rounds.samples] == [goal.fresh(0.025), goal.fresh(0.0125)]
    assert rounds.best is not None
    assert rounds.best.plan == second.step.plan
    chosen, *samples = (set(some) for some in (rounds.numbers, first.numbers, second.numbers))
    assert not set(range(60)) & samples[0]
    assert not (chosen | samples[0]) & samples[1]
    # Of a table there are no more; where all candidates fail, no more cases help.
    table = Cases([*range(0, 240, 2), *range(60, 240)], 60, True)
    assert len(search_in_rounds(replace(search, ask=easy), (), goal, table).samples) == 1
    few = replace(search, ask=needs_two, candidates=candidates[:1])
    none = search_in_rounds(few, (), goal, Cases.of(60, False, goal))
    assert (none.best, len(none.samples)) == (None, 1)
    assert told_by.say.call_count == 1


def test_a_case_of_which_nothing_is_proven_neither_keeps_the_limit_nor_fails(strip: Path) -> None:
    """Of twenty cases one leaves more, and one is not proven: it counts at one end of the interval only."""
    gaps = {0: float("inf"), 1: 1.0}
    search = told(strip, plans_of(strip, 1, 4), lambda _, case: gaps.get(case, 0.1))
    sample = Sample.of((), search, Goal(0.5, 0.5), Cases(range(20), 20), slice(0, 20), 0.05)
    assert sample.kept == 18
    assert sample.interval == pytest.approx((interval_of(18, 20)[0], interval_of(19, 20)[1]))


def test_a_record_tells_cases_beyond_the_limit_from_those_not_proven(strip: Path) -> None:
    study, holes = study_of(strip), plans_of(strip, 1, 4)
    outcome = Outcome((np.inf, 1.0, 0.1), (2, 2, 2), (0.1, 0.1, 0.1))
    step = Step(holes, 1.0, outcome)
    found = SearchOutcome([step], range(3), step, [], [])
    best = record_of(study, (), holes, Goal(0.5, 1.0), found, np.zeros((3, 2)))["best"]
    assert (best["failing"], best["unproven"]) == ([1], [0])


def test_a_gap_that_is_proven_without_a_limit_is_rounded_upwards() -> None:
    goal, step = Goal(None, 0.95, 1), Step(((0.0, 0.0),), 0.12041, Outcome((0.12041,), (0,), (0.1,)))
    sample = Sample(step, range(20), "fresh cases", 19, (0.8, 0.99), "fastener")
    assert sample.sentence(goal).startswith("1 fastener keeps 0.121 mm in 95.0 % of 20 fresh cases")
    said, _ = sentence_on(SearchOutcome([step], range(1), step, [], [step]), goal, np.zeros((1, 2)))
    assert said == "1 fastener leaves 0.121 mm in the one load case, proven."


def test_a_case_of_which_nothing_is_proven_is_named() -> None:
    """Not as infinitely much more than allowed."""
    step = Step(((0.0, 0.0),), np.inf, Outcome((0.1, np.inf), (0, 0), (0.1, 0.1)))
    sample = Sample(step, range(7, 9), "fresh cases", 1, (0.1, 0.9), "fastener")
    found = SearchOutcome([step], range(2), step, [sample], [step])
    said, passed = sentence_on(found, Goal(0.5, 1.0), np.zeros((1, 2)))
    assert said.endswith("of 2 fresh cases (95 % interval 10.0 to 90.0 %); nothing is proven of case 8.")
    assert not passed


def test_what_is_not_proven_is_not_said_to_be(strip: Path) -> None:
    """Of a plan without a limit, after a stage that is not proven."""
    step = Step(plans_of(strip, 1, 4), np.inf, Outcome((np.inf,), (0,), (0.1,)))
    said, _ = sentence_on(SearchOutcome([step], range(1), step, [], []), Goal(None, 1.0, 4), np.zeros((1, 2)))
    assert said == "4 fasteners leave inf mm in the one load case, not proven."
    sample = Sample(step, range(20), "fresh cases", 0, (0.0, 1.0), "fastener")
    assert sample.sentence(Goal(None, 0.95, 4)).startswith("4 fasteners keep inf mm in 0.0 % of 20 ")


@pytest.mark.parametrize("share", [0.5, 0.9, 0.95, 0.99])
def test_how_many_fresh_cases_and_how_many_of_them_may_fail(share: float) -> None:
    """By binomial sums: more failures show the share no longer, and half as many pass four times in five."""
    goal = Goal(0.1, share, None)
    for alpha in (0.05, 0.025, 0.0125):
        n = goal.fresh(alpha)
        c = goal.allowed_fresh(n, alpha)
        low = binomtest(n - c, n).proportion_ci(1 - alpha, "exact").low
        lower = binomtest(n - c - 1, n).proportion_ci(1 - alpha, "exact").low
        assert lower < share <= low
        assert binom.cdf(c, n, (1 - share) / 2) >= 0.8
    assert goal.allowed_fresh(goal.least(0.025), 0.05) == 0
    assert goal.allowed_fresh(goal.least(0.025) - 1, 0.05) == -1


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_the_scene_of_a_plan_has_the_gaps_that_chose_it(strip: Path, tmp_path: Path) -> None:
    """The scan in place of the scene's gap, or the law that options gave; `solve` takes them from there."""
    scan, holes = tmp_path / "scan.csv", tmp_path / "holes.csv"
    scan.write_text("X,Y,Z\n0,0,0.03\n200,0,0.05\n9,9,9999\n0,50,0.06\n200,50,0.04\n")
    holes.write_text("name,X,Y\n" + "".join(f"H{x},{x},25\n" for x in range(20, 200, 40)))
    read_by = ("--columns", "X,Y,Z", "--missing", 9999, "--candidates", holes)
    (varied := tmp_path / "varied.toml").write_text(
        strip.read_text() + '[random]\ninitial_gap.mean = "normal(0.05, 0.01)"\n'
    )
    done = place(varied, tmp_path / "a", "--count", 2, "--around", scan, *read_by)
    assert done.exit_code == 0, done.output
    for name in ("own", "plan"):  # of the same cases
        assert all("initial_gap.mean" in row for row in series_file.rows(tmp_path / "a" / name))
    for table, x in (("plan.csv", "x"), ("report/order.csv", "x_mm")):
        lines = pd.read_csv(tmp_path / "a" / table).dropna()
        assert list(lines["name"]) == [f"H{at:g}" for at in lines[x]]
    scene = read_scene(str(tmp_path / "a" / "plan.toml"))
    assert [effect.kind for effect in scene.effects] == ["fasteners", "measured_gap"]
    assert load_case(scene, effects=scene.effects).g[0] == pytest.approx(0.03)
    few = "--candidates", "1x3", "--count", 2
    assert place(strip, tmp_path / "b", *few, "--mean", 0.2).exit_code == 0
    scene = read_scene(str(tmp_path / "b" / "own.toml"))
    (gap,) = (effect for effect in scene.effects if effect.kind == "initial_gap")
    assert (gap.mean, gap.random.sd, gap.random.correlation_length) == (0.2, 0.02, 60.0)
    # A scan that no scene can have is refused before the search.
    (tmp_path / "line.csv").write_text("x,y,gap\n0,0,0.03\n200,0,0.05\n")
    refused = place(strip, tmp_path / "c", "--count", 2, "--around", tmp_path / "line.csv")
    assert refused.exit_code == 2
    assert "measured_gap" in refused.output
    assert not (tmp_path / "c" / PLANS).exists()


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_rows_of_a_table_are_held_back(strip: Path, tmp_path: Path) -> None:
    gaps = random_gaps(MovableFasteners.of(read_scene(str(strip))).bare, 40, 7)
    for rows in (40, 1):
        np.savetxt(tmp_path / f"{rows}.csv", [gaps.load(k).g for k in range(rows)], delimiter=",")
    goal = ("--candidates", "2x4", "--allow-gap", 0.08, "--out")
    many = harness("place", strip, "--gaps", tmp_path / "40.csv", "--share", 0.8, *goal, tmp_path / "many")
    assert "Every second row is held back" in many.output
    assert re.search(r"keeps? 0\.08 mm in (all|[\d.]+ % of) 20 held-back rows \(95 % interval", many.output)
    record = records_of(tmp_path / "many")
    assert record["samples"][0]["numbers"] == [*range(1, 40, 2)]
    assert all(step["worst_case"] % 2 == 0 for step in record["steps"])
    one = harness("place", strip, "--gaps", tmp_path / "1.csv", *goal, tmp_path / "one")
    assert "in the one load case, proven" in one.output
    told = wrong_usage("place", strip, "--gaps", tmp_path / "40.csv", *goal, tmp_path / "few")
    assert "half of 40 rows are held back: take 144 rows, or a share of 1" in told


@pytest.mark.usefixtures("without_pictures")
def test_a_plan_for_joints_that_vary_as_scans_do(strip: Path, tmp_path: Path) -> None:
    """Fresh joints of the same modes decide, and are the series of the plan."""
    random = np.random.default_rng(2)
    for k in range(6):
        corners = [f"{x},{y},{0.05 + 0.01 * random.standard_normal()}" for x in (0, 200) for y in (0, 50)]
        (tmp_path / f"scan{k}.csv").write_text("\n".join(("x,y,gap", *corners)))
    goal = ("--candidates", "2x3", "--allow-gap", 0.06, "--share", 0.5, "--cases", 8)
    scans = ("--scans", str(tmp_path / "scan*.csv"), "--variance", 0.9)
    done = harness("place", strip, *scans, *goal, "--out", tmp_path / "out")
    assert "principal modes of 6 scans keep" in done.output
    record = records_of(tmp_path / "out")
    fresh = record["samples"][-1]["numbers"]
    assert min(fresh) >= 8
    rows = series_file.rows(tmp_path / "out" / "plan")
    assert [row["case"] for row in rows] == list(range(max(fresh) + 1))


@pytest.mark.parametrize("count", [1, 2, 3, 7, 8])
def test_few_plans_are_all_compared(strip: Path, count: int) -> None:
    """Whose gaps follow no rule, in 20 cases of which one may fail: against the least of all."""
    candidates, gaps = plans_of(strip, 2, 4), np.random.default_rng(count)
    plans = {plan: gaps.uniform(size=20) for k in range(9) for plan in combinations(candidates, k)}
    search = told(strip, candidates, lambda plan, case: float(plans[plan][case]), cases=20)
    _, best = replace(search, allowed=1).once(candidates, count)
    assert best.gap_mm == min(sorted(gap)[-2] for plan, gap in plans.items() if len(plan) == count)


@pytest.mark.usefixtures("no_plan_by_plan")
@pytest.mark.parametrize("count", [4, 7])
def test_as_many_fasteners_are_found_as_were_asked_for(strip: Path, count: int) -> None:
    """Also one less than there are candidates, where the scene has a plan of its own."""
    candidates = plans_of(strip, 2, 4)
    search = told(strip, candidates, lambda plan, _: sum(x + y for x, y in set(candidates) - set(plan)))
    _, best = search.once(candidates[:3], count)
    assert best.plan == tuple(sorted(sorted(candidates, key=sum)[-count:]))


@pytest.mark.usefixtures("no_plan_by_plan")
def test_exchange_starts_from_uniform_plans_too(strip: Path) -> None:
    """Where only the uniform one of three is good, which no exchange would reach one by one."""
    candidates = plans_of(strip, 1, 9)
    even = tuple(candidates[k] for k in (1, 4, 7))
    search = told(strip, candidates, lambda plan, _: 0.0 if plan == even else 1.0 + sum(x for x, _ in plan))
    found, _ = search.fewer(search.whole(candidates[:4]), {})
    assert (found.plan, found.gap_mm) == (even, 0.0)


def test_exchange_goes_on_after_a_move_that_opens_another_case(strip: Path) -> None:
    """The second hole is best in the cases that decide, and worst in one that does not; the third is next."""
    first, second, third = ((10.0 * k, 0.0) for k in range(3))

    def gap(plan: Plan, case: int) -> float:
        return {(first,): 1.0, (second,): 2.0 if case == 15 else 0.2, (third,): 0.6}.get(plan, 3.0)

    search = told(strip, (first, second, third), gap, cases=20)
    found = search.exchanged(search.whole((first,)), {})
    assert (found.plan, found.gap_mm) == ((third,), 0.6)


@pytest.mark.usefixtures("no_plan_by_plan")
def test_exchange_starts_from_what_is_least_in_all_cases(strip: Path) -> None:
    """Not from a uniform plan that is good only in those that decide about another one."""
    candidates = plans_of(strip, 1, 9)
    search = told(
        strip, candidates, lambda plan, case: 0.5 + (candidates[4] in plan and case == 15), cases=20
    )
    found, _ = search.fewer(search.whole(candidates[:2]), {})
    assert found.gap_mm == 0.5


def place(path: Path, out: Path, *words: object) -> Any:
    return harness("place", path, "--candidates", "2x6", "--cases", 6, "--share", 1, "--out", out, *words)


#: Words of a search that asks little: it compares all plans of two of four places.
FEW = ("--candidates", "1x4", "--count", 2)


@pytest.fixture(scope="module")
def compared(strip: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of that search, without its report."""
    out = tmp_path_factory.mktemp("compared")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("report.writers.place_report.write", Path)
        assert place(strip, out, *FEW).exit_code == 0
    return out


@pytest.mark.slow
def test_the_command_finds_a_plan_that_solve_confirms(
    strip: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    done = place(strip, tmp_path / "out", "--allow-gap", 0.05)
    assert done.exit_code == 0, done.output
    said, record = done.output, records_of(tmp_path / "out")
    best, plan = record["best"], tmp_path / "out" / "plan.toml"
    assert best["fasteners"] < len(record["candidates"])
    assert best["gap_mm"] <= 0.05
    assert f"PASS: {best['fasteners']} fasteners keep 0.05 mm in all 6 fresh cases (95 % " in said
    (sample,) = record["samples"][-1:]
    assert (sample["plan"], sample["kept"], sample["failing"]) == (best["plan"], 6, [])
    assert min(sample["numbers"]) >= record["cases"]
    assert "# Where they are now." in plan.read_text()
    assert pd.read_csv(tmp_path / "out" / "plan.csv").to_numpy().tolist() == best["plan"]
    assert [list(p) for p in MovableFasteners.of(read_scene(str(plan))).current] == best["plan"]
    assert "12 fasteners, all candidates: " in said  # progress, though this is no terminal
    assert "(1 plan proven)" in said
    drawn = harness("report", tmp_path / "out" / "plan")
    assert drawn.exit_code == 0, drawn.output
    request.getfixturevalue("without_report")
    series = harness("series", plan, "--cases", 6, "--allow-gap", 0.05, "--out", tmp_path / "again")
    assert series.exit_code == 0, series.output
    assert [step["fasteners"] for step in record["order"]] == [*range(best["fasteners"] + 1)]
    for name in ("report.md", "gap-against-fasteners.png", "before-and-after.png", "order.csv"):
        assert (tmp_path / "out" / "report" / name).is_file()
    # The same command again finds all answers, in their form, though another is the cheaper one by now.
    plans = (tmp_path / "out" / PLANS).read_text()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("harness.planning.form_choice._by_rule", lambda *_: Choice("sparse"))
        assert place(strip, tmp_path / "out", "--allow-gap", 0.05).exit_code == 0
    assert (tmp_path / "out" / PLANS).read_text() == plans
    # Another search is refused before its work, and leaves the files as they are.
    scene = plan.read_text()
    other = place(strip, tmp_path / "out", "--allow-gap", 0.04, "--seed", 1, "--candidates", "2x5")
    assert other.exit_code == 2
    for reason in ("cases_key", "limit_mm = 0.05: now 0.04: name another directory with --out", "'12 places"):
        assert reason in other.output
    assert (plan.read_text(), (tmp_path / "out" / PLANS).read_text()) == (scene, plans)
    damaged = plans.replace('"largest": [0.0', '"largest": [0.1', 1)
    assert damaged != plans
    (tmp_path / "out" / PLANS).write_text(damaged)
    refused = place(strip, tmp_path / "out", "--allow-gap", 0.05)
    assert refused.exit_code == 2
    assert "line 2" in refused.output
    assert "damaged" in refused.output


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_no_fastener_at_all_is_a_plan(strip: Path, tmp_path: Path) -> None:
    """Where the limit is larger than the gap without fasteners."""
    assert place(strip, tmp_path, "--candidates", "1x3", "--allow-gap", 9.0).exit_code == 0
    assert records_of(tmp_path)["best"]["plan"] == []
    effects = read_scene(str(tmp_path / "plan.toml")).effects
    assert not any(effect.kind == "fasteners" for effect in effects)


@pytest.mark.slow
@pytest.mark.usefixtures("without_report")
def test_an_interrupted_search_goes_on(
    strip: Path, tmp_path: Path, compared: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the plan of the best estimates is proven."""
    keep, kept = AnswerJournal._keep, [0]

    def interrupted(self: AnswerJournal, *answer: Any) -> None:
        keep(self, *answer)
        kept[0] += 1
        if kept[0] == 7:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(AnswerJournal, "_keep", interrupted)
        assert place(strip, tmp_path / "parts", *FEW).exit_code == 130
    assert len((tmp_path / "parts" / PLANS).read_text().splitlines()) == 1 + 7
    assert place(strip, tmp_path / "parts", *FEW).exit_code == 0
    assert records_of(compared) == records_of(tmp_path / "parts")


def test_workers_get_the_rows_of_their_question(
    strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And give the outcomes of the whole table."""
    movable, sent = MovableFasteners.of(read_scene(str(strip))), list[np.ndarray]()
    law = random_gaps(movable.bare, 6, 0)
    gaps = np.array([law.load(k).g for k in range(6)])
    study = FastenerStudy.of(movable, MeasuredGaps(law.load(0), gaps, 6), "dual")
    questions = [Question((((33.0, 12.5),),), cases) for cases in ((0, 1), (4,))]

    def on_worker(task: Any) -> list[Outcome]:
        sent.append(task[0].cases.gaps)
        return answer(task)

    monkeypatch.setattr("harness.placement.answer_journal.answer", on_worker)
    with ThreadPoolExecutor(1) as pool:
        outcomes = AnswerJournal(study, tmp_path / PLANS, {}, (pool, 1))(questions)
    assert outcomes == [PlanSession(study).answer(question) for question in questions]
    for rows, question in zip(sent, questions, strict=True):
        np.testing.assert_array_equal(rows, gaps[list(question.cases)])


@pytest.mark.parametrize("killed", [True, False])
def test_workers_that_were_killed_are_said(
    strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, killed: bool
) -> None:
    """Each answer so far stays."""
    study, question = study_of(strip), Question((((20.0, 10.0),),), (0,))
    ended = CancelledError()
    if killed:
        ended = pytest.importorskip("distributed").KilledWorker("answer", SimpleNamespace(address="a"), 3)

    def on_worker(task: Any) -> list[Outcome]:
        if task[1] != question:
            raise ended
        return answer(task)

    monkeypatch.setattr("harness.placement.answer_journal.answer", on_worker)
    said = "--scheduler: workers = .*run the same command again"
    with ThreadPoolExecutor(1) as pool, pytest.raises(InputError, match=said):
        AnswerJournal(study, tmp_path / PLANS, {"a": 1}, (pool, 1))([question, replace(question, cases=(1,))])
    assert len(AnswerJournal(study, tmp_path / PLANS, {"a": 1}, None).answers) == 1


def test_figures_without_a_bound_are_read_again(
    strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """JSON has no infinity: a resumed search compared None with a limit."""
    study, question = study_of(strip), Question(((),), (0,))
    unproven = Outcome((np.inf,), (2,), (np.inf,), ((0.1, np.inf),), ((0.0, 0.2),))
    monkeypatch.setattr("harness.placement.answer_journal.answer", lambda _: [unproven])
    assert AnswerJournal(study, tmp_path / PLANS, {"a": 1}, None)([question]) == [[unproven]]
    assert AnswerJournal(study, tmp_path / PLANS, {"a": 1}, None)([question]) == [[unproven]]


@pytest.mark.slow
@pytest.mark.usefixtures("without_report")
def test_workers_find_the_same(strip: Path, tmp_path: Path, compared: Path, cluster: Any) -> None:
    two = place(strip, tmp_path / "two", *FEW, "--scheduler", cluster.scheduler_address)
    assert two.exit_code == 0, two.output
    assert records_of(compared) == records_of(tmp_path / "two")


def records_of(directory: Path) -> dict[str, Any]:
    record = dict(json.loads((directory / "place.json").read_text()))
    assert record.pop("recorded_at")
    assert record["machine"]
    return record


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_a_limit_that_no_plan_keeps_says_where_and_by_how_much(strip: Path, tmp_path: Path) -> None:
    done = place(strip, tmp_path / "out", "--allow-gap", 0.001)
    assert done.exit_code == 4
    for word in ("FAIL", "all of the 12 fasteners", "more than allowed", "is the worst, at ("):
        assert word in done.output


def test_a_share_needs_cases_to_show_it() -> None:
    """Of those that choose half as many may fail as in all."""
    assert Goal(0.1, 0.95, None).allowed_choosing(200) == 5
    assert Goal(0.1, 1.0, None).allowed_choosing(1) == 0
    assert Goal(0.1, 0.95, None).allowed_choosing(59) == 1
    assert Goal(0.1, 0.01, None).allowed_choosing(10) == 4
    with pytest.raises(InputError, match="take 59, or a share of 1"):
        Goal(0.1, 0.95, None).allowed_choosing(58)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), ["goal", "--allow-gap MM, or --count N"]),
        (("--count", 4), ["--count", "at most 3"]),
        (("--candidates", "holes.csv", "--count", 1), ["holes.csv", "[900.0, 10.0]", "is there twice"]),
        (("--candidates", "9999x9999", "--count", 1), ["holes = '9999x9999'", "1 to 10000"]),
        (("--candidates", "0x5", "--count", 1), ["holes = '0x5'", "rows x columns"]),
        (("--candidates", "4x", "--count", 1), ["holes = '4x'", "or a CSV file"]),
        (("--candidates", "2by4", "--count", 1), ["2by4", "readable"]),
        (
            ("--count", 1, "--candidates", "1x3", "--columns", "X,Y", "--missing", 9),
            ["--columns: headings = 'X, Y'", "--missing: marks = '9'"],
        ),
        (("--count", 1, "--cases", 10), ["--share", "take 59"]),
        (("--allow-gap", "inf"), ["finite"]),
    ],
)
def test_wrong_words(
    strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[object, ...], said: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "holes.csv").write_text("x,y\n10,10\n900,10\n20,20\n20,20\n")
    done = harness("place", strip, "--out", tmp_path / "out", *words)
    assert done.exit_code == 2, done.output
    assert all(word in done.output for word in said)


@pytest.mark.parametrize(
    ("fasteners", "said"),
    [
        ("", "no fasteners"),
        (FASTENERS + FASTENERS.replace("40.0", "50.0", 1).replace("0, ", "1, "), "fasteners.preload"),
    ],
)
def test_scenes_whose_fasteners_cannot_move(tmp_path: Path, fasteners: str, said: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(two_parts() + GAP.replace("60.0", "50.0") + fasteners)
    with pytest.raises(InputError, match=said):
        MovableFasteners.of(read_scene(str(path)))


@pytest.mark.parametrize(
    ("holes", "said"),
    [
        ("x,y\n10,10\n30,10\n", r"holes\.csv: points = \[\[30\.0, 10\.0\]\]: separate places"),
        ("x,y\n", r"holes\.csv: rows = 0: at least one row"),
    ],
)
def test_no_candidate_is_where_a_fastener_is_installed(tmp_path: Path, holes: str, said: str) -> None:
    """Of a table without a hole that is said alone."""
    scene, table = tmp_path / "scene.toml", tmp_path / "holes.csv"
    installed = '[[effect]]\nkind = "installed_fasteners"\npoints = [[30.0, 10.0]]\n'
    scene.write_text(two_parts() + GAP.replace("60.0", "50.0") + FASTENERS + installed)
    table.write_text(holes)
    with pytest.raises(InputError, match=said):
        MovableFasteners.of(read_scene(str(scene))).candidates(str(table))


def test_a_mark_of_missing_gaps_leaves_out_no_hole(strip: Path, tmp_path: Path) -> None:
    """It marks a gap, and a table of holes has none."""
    (tmp_path / "holes.csv").write_text("x,y\n10,0\n20,10\n")
    marked, movable = TableOptions(missing=(0,)), MovableFasteners.of(read_scene(str(strip)))
    assert movable.candidates(str(tmp_path / "holes.csv"), marked)[0] == ((10.0, 0.0), (20.0, 10.0))
    assert [fault.where for fault in GapCases(options=marked).faults(table=True)] == ["--missing"]


def test_cells_of_a_pattern_in_a_bay_have_no_hole(tmp_path: Path) -> None:
    """Of a table a hole there is refused; so is a pattern without any on the parts."""
    fasteners = {"kind": "fasteners", "preload": 1.0, "points": [[10.0, 10.0]]}
    movable = MovableFasteners.of(scene_from(with_bay(tmp_path), fasteners))
    assert movable.candidates("1x4")[0] == ((12.5, 50.0), (87.5, 50.0))
    with pytest.raises(InputError, match="its centre on the parts"):
        movable.candidates("1x1")


def test_holes_are_checked_where_plans_have_them(strip: Path, tmp_path: Path) -> None:
    (tmp_path / "holes.csv").write_text("x,y\n200.0000004,10\n10,10\n")
    movable = MovableFasteners.of(read_scene(str(strip)))
    assert movable.candidates(str(tmp_path / "holes.csv"))[0] == ((10.0, 10.0), (200.0, 10.0))


class ReachedError(Exception):
    """A search begins."""


def test_a_scene_that_was_read_needs_its_file(
    strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The search begins from a scene as from its path; not without a file, or with another content of it."""

    def search(*_: object) -> None:
        raise ReachedError

    for module in ("placement.run", "shimming.shim_run"):
        monkeypatch.setattr(f"harness.{module}.search_in_rounds", search)
    read, table = read_scene(str(strip)), tomllib.loads(strip.read_text())
    gap, *rest = read.effects  # type: ignore[attr-defined]
    changed = replace(read, effects=(gap.model_copy(update={"mean": 0.06}), *rest))  # type: ignore[call-arg]
    asked: Any = {"cases": GapCases(count=2), "share": 1.0}
    for n, call in enumerate(
        (partial(place_fasteners, count=1, **asked), partial(shim, allow_gap_mm=0.1, stock="0.1", **asked))
    ):
        with pytest.raises(ReachedError):
            call(read, tmp_path / f"{n}")
        with pytest.raises(InputError, match="a scene in a file"):
            call(table, tmp_path / "none")
        with pytest.raises(InputError, match=r"strip\.toml'?: the scene as it is now"):
            call(changed, tmp_path / "none")
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("text", [INLINE + two_parts(), two_parts() + GAP + FASTENERS])
def test_a_law_of_gaps_is_written_among_effects_of_any_shape(tmp_path: Path, text: str) -> None:
    """In place of the scene's own gap."""
    path = tmp_path / "scene.toml"
    path.write_text(text)
    bare = MovableFasteners.of(read_scene(str(path))).bare
    law = GapCases(mean=0.3, sd=0.1, correlation_length=100.0, count=1).of_search(bare, "dual")
    assert isinstance(law, RandomGaps)
    written = edited(str(path), tmp_path, with_fasteners(((10.0, 20.0),)), MOVED, law)
    first, second = scene_of(tomllib.loads(written)).effects  # type: ignore[attr-defined]
    assert (first.kind, first.points) == ("fasteners", ((10.0, 20.0),))
    assert (second.kind, second.mean, second.random.sd) == ("initial_gap", 0.3, 0.1)


def test_fasteners_in_the_file_of_the_assembly_are_refused_before_the_search(tmp_path: Path) -> None:
    joint = two_parts().replace("[joint]", "").replace("joint.part", "part")
    (tmp_path / "joint.toml").write_text(joint + FASTENERS)
    scene = tmp_path / "scene.toml"
    scene.write_text(f'assembly = "joint.toml"\n{GAP.replace("60.0", "50.0")}')
    told = wrong_usage("place", scene, "--count", 2, "--cases", 6, "--share", 1, "--out", tmp_path / "out")
    assert "joint.toml: effect = ['fasteners']: these in the scene itself" in told
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["place", "shim"])
@pytest.mark.usefixtures("without_report")
def test_a_file_that_changes_during_the_search_changes_no_plan(
    command: str, strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is written starts from the text that was read, and the hash of the input is that of it."""
    scene, out = tmp_path / "strip.toml", tmp_path / "out"
    scene.write_bytes(strip.read_bytes())

    def searched(*of: Any) -> Any:
        scene.write_text(strip.read_text().replace("preload = 40.0", "preload = 77.0"))
        return search_in_rounds(*of)

    module, name = {"place": ("placement.run", "own"), "shim": ("shimming.shim_run", "shimmed")}[command]
    monkeypatch.setattr(f"harness.{module}.search_in_rounds", searched)
    asked = ["--count", 1] if command == "place" else ["--stock", "0.02", "--patches", "2x1"]
    words = ("--allow-gap", 1, "--cases", 2, "--share", 1, "--out", out)
    assert harness(command, scene, *asked, *words).exit_code == 0
    assert "preload = 40.0" in (out / f"{name}.toml").read_text()
    record = json.loads((out / f"{command}.json").read_text())
    assert record["inputs"]["strip.toml"] == sha256(strip.read_bytes()).hexdigest()


def test_the_cases_that_fail_are_named_up_to_ten() -> None:
    """A sentence of the sheet, which adds the full stop."""
    sample = {"fasteners": 3, "kept": 8, "interval": [0.1, 0.7], "failing": [*range(12)], "unproven": []}
    record = {"best": None, "limit_mm": 0.1, "share": 1.0, "count": None, "stages": [], "candidates": []}
    record |= {"preload": 1.0, "said": "FAIL", "confidence": 0.95, "samples": [sample | {"cases": 20}]}
    said = _summary(record).data["value"].iloc[-1]
    assert said.endswith("in 12 of 20 cases: 0, 1, 2, 3, 4, 5, 6, 7, 8, 9 and 2 more")
