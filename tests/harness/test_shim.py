"""Which shims close the gap: plans against other answers and full enumeration; refused, resumed, drawn."""

import json
from collections import Counter
from dataclasses import replace
from hashlib import sha256
from itertools import product
from math import inf
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from clopper_pearson import interval_of
from commands import harness, wrong_usage
from shim_studies import search_of, study_of
from small_joints import FASTENERS, GAP, INLINE, JOINT, PART, make_joint, scene_at, two_parts, with_gap
from superelements import flat, scene_from, write_part

from harness import solve
from harness.placement.fresh_cases import Goal, Sample, SearchOutcome
from harness.placement.plan_search import Step
from harness.placement.session import Outcome, PlanSession, Question
from harness.planning.form_choice import Choice
from harness.series.load_case_source import GapCases
from harness.shimming.gap_regions import patches_of_gap
from harness.shimming.joint_shims import each_joint
from harness.shimming.outcome import sentence_of
from harness.shimming.patches import patches_of, stock_of
from harness.shimming.shim_search import ShimSearch
from harness.shimming.study import ShimStudy
from problems.build import load_case
from problems.effects.shims import Shims
from problems.errors import InputError
from problems.load_cases import Listed
from problems.load_cases.measured_gaps import MeasuredGaps
from problems.load_cases.random_gaps import random_gaps
from problems.model.fastener_forces import fastener_forces
from problems.reporter import SILENT
from problems.scene_files import read_scene
from report.document.numbers import percent_interval
from report.writers import shim_report

pytestmark = pytest.mark.usefixtures("without_pictures")
RIVET = '[[effect]]\nkind = "installed_fasteners"\npoints = [[90.0, 20.0]]\n'
SHEET = '[[effect]]\nkind = "shims"\nthickness = 0.02\nx = [50.0, 100.0]\ny = [0.0, 50.0]\n'
LAW = '[random]\nshims.thickness = "uniform(0.01, 0.01)"\n'
STOCK = (0.02, 0.04, 0.08)
ASKED = ("--allow-gap", 0.08, "--stock", "0.02,0.04,0.08", "--patches", "4x1")


@pytest.fixture(scope="module")
def strip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("shim") / "strip.toml"
    path.write_text(two_parts(length=200.0, nodes=(21, 4)) + GAP + FASTENERS + RIVET)
    return path


@pytest.fixture(scope="module")
def study(strip: Path) -> ShimStudy:
    """Of four patches."""
    return study_of(strip, "4x1")


def shim(path: Path, out: Path, *words: object) -> Any:
    return harness("shim", path, *ASKED, "--out", out, *words)


def record_of(directory: Path) -> dict[str, Any]:
    return dict(json.loads((directory / "shim.json").read_text()))


def test_a_plan_leaves_what_a_scene_with_its_shims_leaves(strip: Path) -> None:
    """Gaps and the largest force, against `solve` on the scene with the effects."""
    study = study_of(strip, "4x2", (1e6, inf))
    session = PlanSession(study)
    plan = ((0, 0.02), (5, 0.04))
    (outcome,) = session.answer(Question((plan,), (0,)))
    _, estimated = session.answer(Question(((), plan), (0,), base=()))
    scene = study.bare
    answer = solve(replace(scene, effects=(*scene.effects, *map(study.effect, plan))))
    assert answer.gap.max() <= outcome.largest[0] <= answer.gap.max() + 1e-7
    force = max(abs(one["force_N"]) for one in fastener_forces(scene, answer.x))
    assert outcome.further[0][-2] == pytest.approx(force, rel=1e-9)
    np.testing.assert_allclose(estimated.further, outcome.further, rtol=1e-3)
    assert sum(outcome.further[0][9:18]) == pytest.approx(np.maximum(answer.gap, 0) @ study.areas, rel=1e-6)
    assert study.areas.sum() == pytest.approx(200.0 * 50.0)


@pytest.mark.parametrize(("patches", "share"), [("4x1", 0.7), ("2x2", 0.35)])
def test_the_least_of_all_plans_is_found(strip: Path, patches: str, share: float) -> None:
    """Against all 4⁴ plans of four patches and three thicknesses; the limit is a share of the gap without."""
    session = PlanSession(study_of(strip, patches))
    plans = [tuple((k, t) for k, t in enumerate(plan) if t) for plan in product((0.0, *STOCK), repeat=4)]
    largest = session.answers(plans, (0,), 1e-9)[-1].vectors[1].max(axis=0)
    gaps = dict(zip(plans, largest.tolist(), strict=True))
    limit = share * gaps[()]
    search = search_of(session, limit, STOCK)
    kept = [plan for plan, gap in gaps.items() if gap <= limit]
    _, best = search.once(())
    assert 0 < len(kept) < len(plans)
    assert best.gap_mm <= limit
    assert search.cost(best.plan) == min(map(search.cost, kept))


def test_a_force_counts_as_a_gap_with_the_same_share_of_its_limit(strip: Path) -> None:
    search = search_of(PlanSession(study_of(strip, "4x1", (100.0, inf))), 1.0, STOCK)
    (outcome,) = search.outcomes([()], [0])
    assert outcome.largest[0] == max(*outcome.further[0][:5], outcome.further[0][-2] / 100.0)
    assert outcome.further[0][-2] >= 40.0  # a fastener's preload
    assert search._enough(0.04, 1e-13) == [0.08]  # a gap that is too large by rounding alone needs more, too


def test_each_contact_is_in_one_patch(tmp_path: Path) -> None:
    """Nodes on borders of cells, and of rectangles of a CSV that touch."""
    path = tmp_path / "joint.toml"
    path.write_text(two_parts(length=200.0, nodes=(21, 5)) + FASTENERS)
    joint = scene_at(path).joint
    csv = tmp_path / "patches.csv"
    csv.write_text("name,x_min,x_max,y_min,y_max\nleft,0,100,0,50\nright,100,200,0,25\n")
    for source, areas, missed in (("4x2", [1250.0] * 8, 0), (str(csv), [5000.0, 2500.0], 20)):
        patches = patches_of(joint, source)
        inside = np.sum([patch.shim.gap(joint) < 0 for patch in patches], axis=0)
        assert inside.max() == 1
        assert (inside == 0).sum() == missed
        assert [patch.area for patch in patches] == areas
    assert [patch.name for patch in patches] == ["left", "right"]
    assert len(patches_of(joint, None)) == 16


def test_a_cell_without_a_contact_is_no_patch(tmp_path: Path) -> None:
    """Ten cells along nine nodes, in each contact of three parts; an outline of the user's own is refused."""
    parts = PART, PART | {"name": "b"}, PART | {"name": "c"}
    joint = make_joint(*parts, length=400.0, width=60.0, nodes=(9, 3))
    for source in (None, "10x1"):
        patches = patches_of(joint, source)
        inside = np.sum([patch.shim.gap(joint) < 0 for patch in patches], axis=0)
        assert inside.tolist() == [1] * 54
        assert [patch.name for patch in patches[:9]] == [f"{k} a–b" for k in (1, 2, 3, 4, 5, 7, 8, 9, 10)]
        assert [patch.name for patch in patches[9:]] == [f"{k} b–c" for k in (1, 2, 3, 4, 5, 7, 8, 9, 10)]
    csv = tmp_path / "patches.csv"
    csv.write_text("x_min,x_max,y_min,y_max\n0,90,0,60\n205,235,0,60\n")
    with pytest.raises(InputError, match=r"line 3, x, y = .* ranges with a node"):
        patches_of(joint, str(csv))


def test_a_patch_is_one_where_its_pair_has_contacts(tmp_path: Path) -> None:
    """Of two parts that meet a third one at either end, each has the patch of its end."""
    x, parts = JOINT.nodes[:, 0], []
    for name, inside in (("a", x >= 0.0), ("b", x <= 200.0), ("c", x >= 200.0)):
        parts.append(write_part(tmp_path, name, 40 * np.eye(inside.sum()), flat(JOINT.nodes[inside])))
    joint = scene_from(parts, contacts=[["a", "b"], ["a", "c"]]).joint
    csv = tmp_path / "patches.csv"
    csv.write_text("name,x_min,x_max,y_min,y_max\nleft,0,160,0,120\nright,240,400,0,120\n")
    patches = patches_of(joint, str(csv))
    assert [(patch.name, patch.shim.between) for patch in patches] == [
        ("left a–b", ("a", "b")),
        ("right a–c", ("a", "c")),
    ]


def test_outlines_are_cut_to_any_shape(strip: Path, tmp_path: Path) -> None:
    """An L and the rest of a rectangle, whichever way round: the gap of two rectangles, each contact once."""
    joint, csv = scene_at(strip).joint, tmp_path / "outlines.csv"
    inner = [("L", 0, 0), ("L", 120, 0), ("L", 120, 25), ("L", 60, 25), ("L", 60, 50), ("L", 0, 50)]
    rest = [("rest", 60, 50), ("rest", 60, 25), ("rest", 120, 25), ("rest", 120, 50)]
    csv.write_text("name,x,y\n" + "".join(f"{name},{x},{y}\n" for name, x, y in inner + rest))
    ell, other = patches_of(joint, str(csv))
    two = [
        Shims(kind="shims", thickness=1.0, x=x, y=y) for x, y in (((0, 60), (0, 50)), ((60.1, 120), (0, 25)))
    ]
    np.testing.assert_array_equal(ell.shim.gap(joint), two[0].gap(joint) + two[1].gap(joint))
    both = ell.shim.gap(joint) + other.shim.gap(joint)
    x, _ = joint.places(joint.pairs[0]).T
    np.testing.assert_array_equal(both, np.where(x <= 120, -1.0, 0.0))
    assert (ell.area, other.area) == (60 * 50 + 60 * 25, 60 * 25)
    csv.write_text("x_min,x_max,y_min,y_max\n0,55,0,50\n53,120,0,50\n")  # no contact is in both
    with pytest.raises(InputError, match=r"line 3 .*overlaps line 2"):
        patches_of(joint, str(csv))
    csv.write_text("name,x,y\none,0,0\none,9,9\ntwo,0,0\ntwo,50,0\ntwo,900,50\n")
    with pytest.raises(InputError, match=r"(?s)3 corners or more.*900.*on the junction"):
        patches_of(joint, str(csv))


def test_patches_of_a_gap_need_shims_that_change_nothing_else(strip: Path) -> None:
    """In each a thickness t, max y − limit ≤ t ≤ min y: displacements stay, and the limit is kept."""
    answer = solve(str(strip))
    scene, joint, limit = answer.scene, answer.scene.joint, 0.4 * answer.gap.max()  # type: ignore[attr-defined]
    patches = patches_of_gap(joint, answer.gap, limit)
    inside = np.array([patch.shim.gap(joint) < 0 for patch in patches])
    assert 1 < len(patches) <= 16
    assert inside.sum(axis=0).max() == 1
    assert inside.any(axis=0)[answer.gap > limit].all()
    least = [answer.gap[some].min() for some in inside]
    assert all(np.ptp(answer.gap[some]) <= limit for some in inside)
    shims = [p.shim.model_copy(update={"thickness": t}) for p, t in zip(patches, least, strict=True) if t > 0]
    shimmed = solve(replace(scene, effects=(*scene.effects, *shims)))  # type: ignore[attr-defined]
    np.testing.assert_allclose(shimmed.x, answer.x, atol=1e-8)
    assert shimmed.gap.max() <= limit + 1e-8
    assert patches_of_gap(joint, answer.gap, answer.gap.max()) == ()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (FASTENERS + RIVET, "", ["no fasteners"]),
        (RIVET, RIVET + SHEET, ["--patches: 1, outline", "both fill the contact at 50, 0 mm"]),
        ('"initial_gap"', '"initial_gap"\nname = "shims"', ["another name: that of a kind"]),
        (
            RIVET,
            RIVET + SHEET.replace("50.0, 100.0", "10.0, 40.0") + LAW,
            ["[random]: key = 'shims.thickness'"],
        ),
    ],
)
def test_a_scene_that_shims_do_not_fit_is_refused_before_the_search(
    strip: Path, tmp_path: Path, old: str, new: str, said: list[str]
) -> None:
    """Contacts on a border would be filled twice; an effect has the name that shims have by default."""
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(strip.read_text().replace(old, new))
    told = wrong_usage("shim", scene, *ASKED, "--cases", 2, "--share", 1, "--out", out)
    assert all(text in told for text in said)
    assert not (out / "shims.jsonl").exists()


@pytest.mark.usefixtures("without_report")
def test_a_scene_whose_effects_are_inline_tables_is_shimmed(tmp_path: Path) -> None:
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(INLINE + two_parts())
    asked = ("--allow-gap", 0.05, "--stock", "0.1,0.2", "--patches", "2x1")
    done = harness("shim", scene, *asked, "--out", out)
    assert done.exit_code in (0, 4), done.output
    kinds = [effect.kind for effect in scene_at(out / "shimmed.toml").effects]
    shims = sum(patch["thickness_mm"] > 0 for patch in record_of(out)["patches"])
    assert kinds == ["initial_gap", "fasteners", *["shims"] * shims]
    assert shims


def test_the_gap_that_patches_follow_is_found_in_blocks(
    study: ShimStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of no more cases than memory has room for; the largest of all, as if they were solved at once."""
    session, sizes = PlanSession(study), list[int]()
    session.cases = random_gaps(study.bare, 5, 0)
    at_once = session.answers([()], range(5), 1e-9)[-1].vectors[1].max(axis=1)
    together = session.last.sweeps.together
    monkeypatch.setattr(
        session.last.sweeps, "together", lambda loads, *how: sizes.append(len(loads)) or together(loads, *how)
    )
    session.block = 2
    np.testing.assert_allclose(session.largest_gap(range(5)), at_once, rtol=0, atol=1e-4)
    assert sizes == [2, 2, 1]


def test_a_region_is_divided_where_its_parts_differ_least(strip: Path) -> None:
    """By hand: the zone without a gap first; of two cuts with the same largest difference, the least sum."""
    joint = scene_at(strip).joint
    x, _ = joint.places(joint.pairs[0]).T
    zones = [x < 15, x < 25, x < 45, x < 65, x < 155]
    gap = np.select(zones, [0.25, 0.3125, 0.375, 0.5, 0.0], 0.3)
    outlines = [np.array(patch.outline) for patch in patches_of_gap(joint, gap, 0.125)]
    assert [np.ptp(outline[:, 1]) for outline in outlines] == [50.0] * 3
    ends = [(float(outline[:, 0].min()), float(outline[:, 0].max())) for outline in outlines]
    assert ends == [(0.0, 45.0), (45.0, 65.0), (155.0, 200.0)]


@pytest.mark.parametrize(
    ("ends", "patches", "limit", "words"),
    [
        (1, "4x1", 0.08, ("--stock", "0.02,0.04,0.08", "--mean", 0.08)),
        (2, "2x1", 0.03, ("--stock", "0.02,0.05", "--mean", 0.05, "--taper")),
    ],
)
def test_each_joint_has_shims_of_its_own(
    strip: Path, tmp_path: Path, ends: int, patches: str, limit: float, words: tuple[Any, ...]
) -> None:
    """What `solve` says of each with its shims; the stock adds up, tapered pieces from the thin end."""
    path, out = tmp_path / "scene.toml", tmp_path / "out"
    path.write_text(strip.read_text().removesuffix(RIVET if ends == 2 else ""))
    asked = ("--allow-gap", limit, "--patches", patches, *words, "--each", "--cases", 3, "--share", 1)
    done = harness("shim", path, *asked, "--out", out)
    assert done.exit_code in (0, 4), done.output
    assert "of 3 joints can be kept within the limits" in done.output
    scene, study = scene_at(path), study_of(path, patches, ends=ends)
    cases, joints = GapCases(count=3, mean=words[3]).of(scene, "dual"), pd.read_csv(out / "joints.csv")
    pieces = list[tuple[float, ...]]()
    for k, joint in enumerate(record_of(out)["joints"]):
        shims = [study.effect(tuple(item)) for item in joint["plan"]]
        effects = (*(effect for effect in scene.effects if effect.kind != "initial_gap"), *shims)
        gap = solve(with_gap(replace(scene, effects=effects), cases.load(k).g)).gap.max()
        assert (gap <= limit) == joint["kept"] == joints["kept"][k]
        for patch, *t in joint["plan"]:
            name = study.patches[int(patch)].name
            assert [joints[f"{name}{end}"][k] for end in ("", ", other end")[:ends]] == t
            pieces.append(tuple(sorted(t)))
    stock = pd.read_csv(out / "stock.csv")
    sizes = stock.filter(like="thickness").itertuples(index=False, name=None)
    assert dict(zip(sizes, stock["pieces"], strict=True)) == Counter(pieces)
    assert pieces


@pytest.mark.parametrize(
    ("failing", "share"),
    [(0, 0.95), (3, 0.95), (4, 0.95), (10, 0.95), (11, 0.95), (9, 0.9), (20, 0.9), (1, 1.0), (200, 0.9)],
)
def test_joints_pass_if_the_interval_of_their_share_begins_at_it(failing: int, share: float) -> None:
    """By another implementation of the interval; of a table of joints the share itself counts."""
    limit, count = 0.1, 200
    bare = load_case(read_scene("examples/small-joint.toml"))
    gaps = MeasuredGaps(bare, np.zeros((count, len(bare.g))), count)

    def journal(questions: list[Question]) -> list[list[Outcome]]:
        gaps = [0.05 if q.cases[0] >= failing else 0.2 for q in questions]
        return [[Outcome((gap,), (0,), (gap,), ((gap,),), ())] * 2 for gap in gaps]

    for cases in (Listed((bare,) * count), gaps):
        study: Any = SimpleNamespace(cases=cases)
        *_, words, passed = each_joint(journal, study, Goal(limit, share), STOCK, SILENT)  # type: ignore[arg-type]
        low, _ = interval_of(count - failing, count)
        needed = 1 - failing / count if cases is gaps or share == 1 else low
        assert passed == (needed >= share)
        assert f"interval {percent_interval((low, 1.0)).partition(' to')[0]} to " in words
        assert ("no shim is needed" in words) == (not failing)
        assert ("needs a shim" in words) == (0 < failing < count)


def test_stocks_are_lists_or_steps() -> None:
    assert stock_of("0.2,0.3,0.5") == (0.2, 0.3, 0.5)
    assert stock_of("0.05:0.2:0.05") == (0.05, 0.1, 0.15, 0.2)
    lists = ["", "0", "-0.1,0.2", "0.3,0.2", "0.2,0.2", "nan", "x", "1e16"]
    steps = ["0.1:0.5", "0.1:0.5:0", "0.5:0.1:0.1"]
    none: Any = [*lists, *steps, [0.1, 0.2], 0.1]
    for text in none:
        with pytest.raises(InputError, match="ascending"):
            stock_of(text)


def test_the_command_finds_shims_that_solve_confirms(
    strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = shim(strip, tmp_path / "out", "--cases", 2, "--share", 1)
    assert done.exit_code == 0, done.output
    record, table = record_of(tmp_path / "out"), pd.read_csv(tmp_path / "out" / "shims.csv")
    assert "PASS: " in done.output
    assert "in all 2 fresh cases (95 % interval" in done.output
    assert record["after"]["gap"] <= 0.08 < record["before"]["gap"]
    assert (table["gap_after_mm"] <= 0.08).all()
    effects = scene_at(tmp_path / "out" / "shimmed.toml").effects_of(Shims)
    cut = [(effect.outline[1][0], effect.thickness) for effect in effects]
    assert cut == [
        tuple(line) for line in table.query("thickness_mm > 0")[["x_max", "thickness_mm"]].to_numpy()
    ]
    for name in ("report.md", "shims.png", "forces.csv", "sheet.pdf"):
        assert (tmp_path / "out" / name).is_file()
    page = (tmp_path / "out" / "index.html").read_text()
    assert record["said"] in page
    assert "data:image/png;base64," in page
    assert record["inputs"]["strip.toml"] == sha256(strip.read_bytes()).hexdigest()
    assert record["scene_key"] == read_scene(str(strip)).key
    # The same command again finds all answers, in their form, though another is the cheaper one by now.
    answers = (tmp_path / "out" / "shims.jsonl").read_text()
    with monkeypatch.context() as patch:
        patch.setattr("harness.planning.form_choice._by_rule", lambda *_: Choice("sparse"))
        assert shim(strip, tmp_path / "out", "--cases", 2, "--share", 1).exit_code == 0
    assert (tmp_path / "out" / "shims.jsonl").read_text() == answers
    other = shim(strip, tmp_path / "out", "--cases", 2, "--share", 1, "--allow-force", 500)
    assert other.exit_code == 2
    assert "allow_force" in other.output


@pytest.mark.usefixtures("without_report")
@pytest.mark.parametrize(
    ("mean", "limit", "words"),
    [
        (0.2, 0.08, ("--stock", "0.02,0.04,0.08", "--patches", "4x1")),
        (0.05, 0.04, ("--stock", "0.01,0.02,0.04", "--patches", "3x1", "--taper")),
    ],
)
def test_solve_says_the_same_of_one_joint(
    strip: Path, tmp_path: Path, mean: float, limit: float, words: tuple[str, ...]
) -> None:
    """Whose gap is as given; a tapered shim is written with both ends."""
    path, out = tmp_path / "flat.toml", tmp_path / "out"
    path.write_text(
        strip.read_text().replace("random = {", "# random = {").replace("mean = 0.05", f"mean = {mean}")
    )
    done = harness("shim", path, "--allow-gap", limit, *words, "--out", out)
    assert done.exit_code in (0, 4), done.output
    record, largest = record_of(out), solve(str(out / "shimmed.toml")).gap.max()
    assert f"{record['after']['gap']:.9f}" == f"{largest:.9f}"
    assert (done.exit_code == 0) == (largest <= limit)
    assert all(("thickness_end_mm" in patch) == ("--taper" in words) for patch in record["patches"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--stock", "0.3,0.2", "--allow-force", 0), ["--stock", "ascending", "allow_force", "above 0"]),
        (("--patches", "0x4"), ["--patches", "columns x rows"]),
        (
            ("--patches", "patches.csv"),
            ["on the junction", "line 3", "overlaps line 2", "x_min < x_max", "(9.0, 0.0), (9.0, 1.0)"],
        ),
        (("--patches", "outlines.csv"), ["line 2, outline", "two of its edges cross", "a name of its own"]),
        (("--patches", "borders.csv"), ["columns x_min, x_max, y_min, y_max, once each"]),
        (("--allow-gap", -1), ["limit_mm", "above 0"]),
        (("--allow-force", 1e10), ["allow_force", "above 0, at most 1e+09"]),
        (("--patches", "patches.csv", "--missing", 9999), ["--missing: marks = '9999'"]),
        (("--share", 2), ["share", "at most 1"]),
        (("--cases", 10), ["--share", "take 59"]),
    ],
)
def test_wrong_questions_are_refused(strip: Path, tmp_path: Path, words: Any, said: list[str]) -> None:
    (tmp_path / "patches.csv").write_text("x_min,x_max,y_min,y_max\n-5,100,0,50\n50,150,0,50\n9,9,0,1\n")
    (tmp_path / "borders.csv").write_text("xmin,xmax,ymin,ymax\n0,100,0,50\n")
    corners = "a,0,0\na,90,50\na,90,0\na,0,50\n"  # a bow tie
    (tmp_path / "outlines.csv").write_text(f"name,x,y\n{corners}b,100,0\nb,150,0\nb,150,50\n{corners}")
    words = [tmp_path / word if str(word).endswith(".csv") else word for word in words]
    done = shim(strip, tmp_path / "out", *words)
    assert done.exit_code == 2
    for text in said:
        assert text in done.output
    assert not (tmp_path / "out").exists()


def test_a_limit_on_a_stress_that_no_place_tells_is_refused(
    strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before the search, in which no plan could keep it."""
    monkeypatch.setattr("harness.shimming.shim_run.none_told", lambda _: True)
    told = wrong_usage("shim", strip, *ASKED, "--allow-stress", 50, "--out", tmp_path / "out")
    assert "leave it out: forces at points act near all elements" in told


def test_a_directory_of_another_command_is_refused_before_patches_are_found(
    strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("harness.shimming.shim_run.PlanSession", lambda _: pytest.fail("solved"))
    (tmp_path / "plans.jsonl").touch()
    told = wrong_usage("shim", strip, "--allow-gap", 0.1, "--stock", "0.1", "--out", tmp_path)
    assert "has plans.jsonl of another command" in told


@pytest.mark.usefixtures("without_report")
def test_no_answer_of_a_table_that_has_changed_is_used(strip: Path, tmp_path: Path) -> None:
    gaps, table = np.full((3, 84), 0.05), tmp_path / "gaps.npy"
    asked = ("--allow-gap", 0.1, "--stock", 0.1, "--gaps", table, "--share", 1, "--out", tmp_path / "out")
    np.save(table, gaps)
    assert harness("shim", strip, *asked).exit_code in (0, 4)
    gaps[2] = 2.0
    np.save(table, gaps)
    assert "cases_key" in wrong_usage("shim", strip, *asked)


def test_a_stock_that_is_too_thin_says_where(strip: Path, tmp_path: Path) -> None:
    done = shim(strip, tmp_path / "out", "--cases", 2, "--share", 1, "--mean", 2.0)
    assert done.exit_code == 4
    for text in ("FAIL: no shims of the stock", "in patch"):
        assert text in done.output


def test_two_shims_change_together_where_one_alone_does_not_help(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gap = "mean = 0.072\nrandom = { sd = 0.0292, correlation_length = 93.6, seed = 12 }"
    points = "preload = 117.0\npoints = [[25.5, 63.2], [131.0, 5.19]]"
    effects = [
        f'[[effect]]\nkind = "{kind}"\n{text}\n'
        for kind, text in (("initial_gap", gap), ("fasteners", points))
    ]
    path = tmp_path / "joint.toml"
    path.write_text("\n".join([two_parts(length=155.0, width=77.9, nodes=(13, 4)), *effects]))
    scene = scene_at(path)
    patches = patches_of(scene.joint, "5x1")
    session = PlanSession(ShimStudy(scene, scene, random_gaps(scene, 1, 12), "dual", patches, (inf, inf)))
    search = search_of(session, 0.0255, (0.038, 0.056, 0.06))
    _, together = search.once(())
    monkeypatch.setattr(ShimSearch, "walked", lambda *_: ((), False))
    _, alone = search.once(())
    assert together.gap_mm <= 0.0255
    assert search.cost(together.plan) < search.cost(alone.plan)


class FewFigures(ShimSearch):
    """Each patch of 1 mm² asks for `needs` in one case, and in another, which may fail, for 0.09 mm more."""

    needs, more = (0.03, 0.0, 0.05, 0.0), 0.09

    def excess(self, t: Any) -> Any:
        """By how much the gap of each patch is too large, mm."""
        return np.array(self.needs) - t

    def outcomes(self, plans: Any, cases: Any, base: Any = None) -> list[Outcome]:
        made = []
        for plan in plans:
            left = self.limit_mm + self.excess(self.sizes(plan)[:, 0])
            rows = [(*gap, 0.0, *[0.0] * 5, *gap, 0.0, 0.0) for gap in (left, left + self.more)]
            made.append(Outcome(tuple(max(row) for row in rows), (0, 0), (0.0, 0.0), tuple(rows)))
        return made


def test_growth_gives_what_the_gaps_ask_for_in_all_cases_but_those_that_may_fail(study: ShimStudy) -> None:
    """And yields plans by their cost, whatever they begin with."""
    search = FewFigures(lambda some: [], 2, 1, 0.08, study, (0.01, 0.02, 0.03, 0.04, 0.05, 0.06))
    (outcome,) = search.outcomes([()], range(2))
    assert search.thicker((), outcome) == ((0, 0.03), (2, 0.05))
    assert search.thicker(((0, 0.01), (1, 0.02)), search.outcomes([((0, 0.01), (1, 0.02))], ())[0]) == (
        (0, 0.03),
        (1, 0.02),
        (2, 0.05),
    )
    assert search.thicker((), outcome, held=2) == ()
    whole = [((0, 0.03), (1, t), (2, u)) for t in (0.06, 0.03, 0.01) for u in (0.06, 0.05, 0.01)]
    costs = list(map(search.cost, search.grown([(plan, -1) for plan in [*whole, ((3, 0.01),)]], (), (0, 1))))
    assert costs == sorted(costs)
    assert len(costs) > 5
    limit = search.cost(((0, 0.03), (1, 0.02), (2, 0.06)))
    below = search.grown([(plan, -1) for plan in [*whole, ((3, 0.01),)]], (), (0, 1), limit)
    assert max(map(search.cost, below)) < limit <= max(costs)


class OnlyTogether(FewFigures):
    """One of two shims alone makes all gaps larger, both close them; others make them larger still."""

    more = 0.0

    def excess(self, t: Any) -> Any:
        gaps = {(): 0.01, (1,): 0.02, (2,): 0.02, (1, 2): -0.001}
        return np.full(4, gaps.get(tuple(np.flatnonzero(t).tolist()), 0.03))


class OnlyEven(FewFigures):
    """Any thickness closes the gaps if it is the same everywhere."""

    more = 0.0

    def excess(self, t: Any) -> Any:
        return (-0.001 if t.any() else 0.01) + t.max() - t


def test_a_walk_passes_through_what_does_not_help(study: ShimStudy) -> None:
    """Never to a plan twice, and never to one that costs too much."""
    search = OnlyTogether(lambda some: [], 2, 0, 0.08, study, (0.01, 0.02))
    plan, keeps = search.walked((), (inf, inf), (0,))
    assert keeps
    assert [k for k, _ in plan] == [1, 2]
    assert not search.walked((), (2, 0.0), (0,))[1]
    assert search.walked(tuple((k, 0.02) for k in range(4)), (4, 0.0), (0,))[1]
    _, best = search.once(())
    assert best.plan == ((1, 0.01), (2, 0.01))


def test_all_shims_get_thinner_together(study: ShimStudy) -> None:
    search = OnlyEven(lambda some: [], 2, 0, 0.08, study, (0.01, 0.02, 0.05))
    better = search.better(search.whole(tuple((k, 0.05) for k in range(4))))
    assert better is not None
    assert better.plan == tuple((k, 0.01) for k in range(4))


def test_contacts_on_a_line_have_the_areas_of_the_first_face(tmp_path: Path) -> None:
    """Of two parts that overlap by one row of nodes, 30 mm from the next one."""
    y, parts = JOINT.nodes[:, 1], []
    for name, inside in (("lower", y <= 60.0), ("upper", y >= 60.0)):
        parts.append(write_part(tmp_path, name, 40 * np.eye(inside.sum()), flat(JOINT.nodes[inside])))
    fasteners = {"kind": "fasteners", "preload": 1.0, "points": [[200.0, 60.0]]}
    scene = scene_from(parts, {"kind": "initial_gap", "mean": 0.2}, fasteners)
    cases, patches = Listed((load_case(scene),)), patches_of(scene.joint, "2x1")
    study = ShimStudy(scene, scene, cases, "dual", patches, (inf, inf))
    np.testing.assert_allclose(study.areas, [375.0, *[750.0] * 7, 375.0])
    (outcome,) = PlanSession(study).answer(Question((((0, 0.1),),), (0,)))
    assert 0 < sum(outcome.further[0][3:6]) < 0.2 * study.areas.sum()


def test_a_gap_beyond_all_patches_counts(strip: Path, tmp_path: Path) -> None:
    (tmp_path / "half.csv").write_text("x_min,x_max,y_min,y_max\n0,60,0,50\n")
    search = search_of(PlanSession(study_of(strip, str(tmp_path / "half.csv"))), 0.1, STOCK)
    (outcome,) = search.outcomes([((0, 0.02),)], [0])
    inside, beyond = outcome.further[0][:2]
    assert inside < beyond == outcome.largest[0]


def without_shims(gap_mm: float) -> Step:
    """Of a case in four patches and beyond them."""
    figures = (*[gap_mm] * 14, 0.0, 0.0)
    return Step((), gap_mm, Outcome((gap_mm,), (0,), (gap_mm,), (figures,)))


def test_no_shims_that_fresh_cases_refute_fail_by_these(study: ShimStudy) -> None:
    """None was tried: that none of the stock is found would say too much, beside a gap within the limit."""
    fresh = Sample(without_shims(0.2), range(1, 40, 2), "held-back rows", 15, (0.5, 0.9), "shim")
    found = SearchOutcome([without_shims(0.05)], range(0, 40, 2), None, [fresh], [])
    words, passed = sentence_of(found, Goal(0.1, 0.95), study)
    assert not passed
    assert words.startswith("FAIL: joints without a shim keep 0.1 mm in 75.0 % of 20 held-back rows")


@pytest.mark.parametrize(("gap_mm", "said"), [(0.2, ", proven."), (inf, ", not proven.")])
def test_only_what_is_proven_is_said_to_be(study: ShimStudy, gap_mm: float, said: str) -> None:
    found = SearchOutcome([without_shims(gap_mm)], range(1), None, [], [])
    words, _ = sentence_of(found, Goal(0.1, 1.0), study)
    assert words.startswith("FAIL: no shims of the stock are found")
    assert words.endswith(f"the largest gap in patch 1{said}")


PATCH: dict[str, Any] = {
    "patch": "kept",
    "outline": [[0, 0], [200, 0], [200, 50], [0, 50]],
    "area_mm2": 1e4,
    **{"x_min": 0, "x_max": 200, "y_min": 0, "y_max": 50},
}
RECORD: dict[str, Any] = {
    "title": "a joint",
    "scene": "joint",
    "said": "PASS: 1 of 1 joint",
    "limit_mm": 0.1,
    "allow_force": None,
    "allow_stress": None,
    "taper": False,
    "stock": [0.1],
    "sure": [],
    "samples": [],
    "forces": [],
    "before": {"gap": None},
    "after": {"gap": None},
    "inputs": {},
    "marks": [],
    "bounds": [[0, 0], [200, 50]],
    "worst_at": "(0, 0) mm",
    **dict.fromkeys(("machine", "commit", "recorded_at"), ""),
    "clean": True,
}


def report_of(record: dict[str, Any], out: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """report.md of a record, without its page and sheet."""
    for name in ("write_page", "write_sheet"):
        monkeypatch.setattr(shim_report, name, lambda *_: None)
    (out / "shim.json").write_text(json.dumps(record))
    return shim_report.write(out).read_text("utf-8")


def test_a_patch_may_have_the_name_of_a_column_of_joints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each patch has a column there, too."""
    figures = {"gap_before_mm": 0.15, "gap_after_mm": 0.05, "liquid_mm3": 1.0}
    joint = {"joint": 0, "kept": True, "shims": 1, "plan": [[0, 0.1]]}
    report_of(RECORD | {"joints": [joint], "patches": [PATCH | figures]}, tmp_path, monkeypatch)
    table = pd.read_csv(tmp_path / "joints.csv")
    assert list(table.columns) == ["joint", "kept", "shims", "kept, mm"]


def test_figures_are_told_to_what_is_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A figure of which nothing is proven, null in the record, is not 0; a place is a hundredth of a mm."""
    force = {"kind": "fasteners", "x": 1077.934, "y": 0.0, "force_N": 900.0, "with_shims_N": 800.0}
    figures = dict.fromkeys(("gap_before_mm", "gap_after_mm", "liquid_mm3")) | {"thickness_mm": 0.1}
    text = report_of(RECORD | {"forces": [force], "patches": [PATCH | figures]}, tmp_path, monkeypatch)
    assert "– mm³ fill what is left" in text
    assert "| fasteners | 1077.93 | 0 | 900 | 800 |" in " ".join(text.split())
