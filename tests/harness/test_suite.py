"""Suite files, the plan made of them, and what the command line changes."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import tiny_joint
from commands import wrong_usage
from refusals import refusal_of

from harness.commands import suite_runs
from harness.measurement.suite_run import batches
from harness.planning.overrides import Overrides, overridden
from harness.planning.plan import Measurement, expand, of_key, with_key
from harness.planning.suite import (
    Suite,
    read_suite,
    read_written,
    suite_from,
    suite_names,
    to_toml,
    validated,
)
from problems.errors import InputError

TWO = """
[[solver]]
name = "exact"
forms = ["dual"]
[[solver]]
name = "piqp"
forms = ["dual", "primal"]
variant = "plain"
options = {}
tolerances = [1e-3, 1e-6]
gated = false
time_limit_s = 3
"""


def plan_of(tmp_path: Path, **keys: object) -> list[Measurement]:
    return expand(tiny_joint.suite(tmp_path, TWO, **keys))


def dual_suite(tmp_path: Path, *solvers: dict[str, Any], **keys: Any) -> Suite:
    """Of solvers in the dual form on one scene."""
    entries = [{"forms": ["dual"]} | solver for solver in solvers]
    return suite_from({"scenes": ["4386/0107"], "solver": entries} | keys, tmp_path / "suite.toml")


@pytest.mark.parametrize("name", suite_names())
def test_the_suites_of_the_package_can_be_planned(name: str) -> None:
    assert expand(read_suite(name))


def test_a_plan_is_the_product_of_what_the_suite_says(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, threads=[1, 2], repeats=3)
    assert len(plan) == 3 * 2 * (1 + 2 * 2)
    assert len({m.key for m in plan}) == len({m.stem for m in plan}) == len(plan)
    first, last = plan_of(tmp_path)[0], plan_of(tmp_path)[-1]
    assert first.key == "tiny exact dual tol=1e-09 threads=1 repeat=0"
    assert last.key == "tiny piqp primal plain tol=1e-06 threads=1 repeat=0"
    assert [(m.entry.gated, m.time_limit_s) for m in (first, last)] == [(True, 20), (False, 3)]
    assert Path(first.source).is_absolute()


def test_repeats_are_interleaved_and_shuffled_the_same_way_each_time(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, repeats=4)
    assert [m.repeat for m in plan] == sorted(m.repeat for m in plan)
    assert [m.key for m in plan] == [m.key for m in plan_of(tmp_path, repeats=4)]
    rounds = [[m.key[:-1] for m in plan if m.repeat == repeat] for repeat in range(4)]
    assert len({tuple(one) for one in rounds}) > 1
    assert len({frozenset(one) for one in rounds}) == 1


def test_a_shuffled_round_keeps_the_order_of_the_tolerances(tmp_path: Path) -> None:
    tolerances, solvers = [1e-2, 1e-5, 1e-3, 1e-8], ["ipm", "gi", "piqp"]
    entries = ({"name": name} for name in solvers)
    plan = expand(dual_suite(tmp_path, *entries, tolerances=tolerances, repeats=3))
    for repeat in range(3):
        names = [m.solver for m in plan if m.repeat == repeat]
        in_order = sorted(names, key=solvers.index)
        assert (names == in_order) is (repeat == 0)  # the first round is not shuffled
        for name in set(names):
            assert [m.tolerance for m in plan if (m.solver, m.repeat) == (name, repeat)] == tolerances


def test_an_entry_may_have_repeats_of_its_own(tmp_path: Path) -> None:
    own = {"name": "ipm", "tolerances": [1e-6], "repeats": 3}
    suite = dual_suite(tmp_path, {"name": "ipm", "tolerances": [1e-2, 1e-6]}, own)
    planned = sorted((m.tolerance, m.repeat) for m in expand(suite))
    assert planned == [(1e-6, 0), (1e-6, 1), (1e-6, 2), (1e-2, 0)]
    once = overridden(suite, Overrides(repeats=1))
    assert {m.repeat for m in expand(once)} == {0}


def test_an_entry_may_have_numbers_of_threads_of_its_own(tmp_path: Path) -> None:
    suite = dual_suite(tmp_path, {"name": "gi"}, {"name": "ipm", "threads": [2]}, threads=[1, 4])
    assert [(m.solver, m.threads) for m in expand(suite)] == [("gi", 1), ("gi", 4), ("ipm", 2)]
    told = overridden(suite, Overrides(threads=(3,)))
    assert [(m.solver, m.threads) for m in expand(told)] == [("gi", 3), ("ipm", 3)]


def test_what_is_written_beside_the_rows_reads_back_the_same(tmp_path: Path) -> None:
    suite = tiny_joint.suite(tmp_path, TWO, title='a "quoted" title — ü')
    odd = {"description": "\x7f\n\\ \U0001f600", "time_limit_by_size_s": {12: 1e-9}}
    suite = suite.model_copy(update=odd)
    assert validated(tomllib.loads(to_toml(suite)), tmp_path / "suite.toml") == suite


def test_the_file_of_a_suite_is_not_written(tmp_path: Path) -> None:
    path = tiny_joint.write_suite(tmp_path, TWO).rename(tmp_path / "suite.toml")
    text = path.read_text()
    assert "is one of the files that are read: name another" in wrong_usage("run", path, "--out", tmp_path)
    assert path.read_text() == text


def test_all_faults_of_a_suite_come_at_once(tmp_path: Path) -> None:
    text = """
    [[solver]]
    name = "osqq"
    form = ["dual"]
    [[solver]]
    name = "piqp"
    forms = ["duel"]
    """
    path = tiny_joint.write_suite(tmp_path, text, scenes=["4386/9999"], time_limit_s=-1, tolerence=[1.0])
    faults = {fault.key: fault for fault in refusal_of(read_suite, str(path)).faults}
    assert set(faults) == {
        *("scenes", "time_limit_s", "tolerence"),
        *("solver.0.name", "solver.0.form", "solver.1.forms.0"),
    }
    assert all(fault.where == str(path) for fault in faults.values())
    assert "did you mean osqp" in faults["solver.0.name"].allowed
    assert "did you mean forms?" in faults["solver.0.form"].allowed
    assert "did you mean tolerances?" in faults["tolerence"].allowed
    assert "4386/" in faults["scenes"].allowed
    assert "'primal', 'dual' or 'sparse'" in faults["solver.1.forms.0"].allowed


@pytest.mark.parametrize("name", ["..", ".", "...", "", "a/b", "/tmp/a", "a\\b"])
def test_the_name_of_a_suite_is_that_of_a_folder(tmp_path: Path, name: str) -> None:
    """`run` writes into results/NAME: with '..' it wrote into the current folder."""
    refused = refusal_of(tiny_joint.suite, tmp_path, name=name)
    assert [fault.key for fault in refused.faults] == ["name"]


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        ('[[solver]]\nname = "gi"\n[[solver]]\nname = "gi"\noptions = {a = 1}\n', r"solver\.1\.variant"),
        (
            f'{TWO}with = ["piqp==0.6.2"]\n[[solver]]\nname = "piqp"\nvariant = "plain 0.6.2"\n',
            "other `with` under this variant",
        ),
    ],
)
def test_one_name_and_variant_stands_for_one_set_of_options_and_versions(
    tmp_path: Path, text: str, refused: str
) -> None:
    with pytest.raises(InputError, match=refused):
        tiny_joint.suite(tmp_path, text)


ENTRY = '[[solver]]\nname = "exact"\n'


@pytest.mark.parametrize(
    ("above", "entry", "fault"),
    [
        ("gated = false", "", r"1\.gated = True: False in solver\.0, .* tiny exact dual tol=1e-09 threads=1"),
        ("", 'forms = ["primal", "dual"]\ntime_limit_s = 3', r"solver\.1\.time_limit_s = 3.*: 20.* in .*\.0"),
        ('tolerances = "auto"\ngated = false', "tolerances = [1e-6]", r"solver\.1\.gated .* tol=1e-06"),
        ("gated = false", 'scenes = ["t*"]\nthreads = [2, 1]', r"solver\.1\.gated .* threads=1"),
        ("", "time_limit_s = 20", None),  # the suite's
        ("repeats = 2", "gated = true", None),
        ("gated = false", "tolerances = [1e-6]", None),
        ("gated = false", 'forms = ["primal"]', None),
        ("gated = false", "threads = [2]", None),
        ('scenes = ["tiny.npz"]\ngated = false', 'scenes = ["4386/*"]', None),
        ("", 'scenes = ["tiny.npz", "4386/0..9"]', r"solver\.1\.scenes = '4386/0\.\.9': a scene among those"),
        ("gated = false", 'variant = "other"', None),
    ],
)
def test_no_entry_decides_for_another_whether_a_row_is_gated_and_how_long_it_may_take(
    tmp_path: Path, above: str, entry: str, fault: str | None
) -> None:
    scenes = ["tiny.npz", "4386/0107"]
    path = str(tiny_joint.write_suite(tmp_path, f"{ENTRY}{above}\n{ENTRY}{entry}\n", scenes=scenes))
    if fault is None:
        assert read_suite(path)
        return
    with pytest.raises(InputError, match=fault):
        read_suite(path)


def test_of_entries_that_an_option_brings_together_the_first_counts(tmp_path: Path) -> None:
    text = f"{ENTRY}{ENTRY}gated = false\ntolerances = [1e-3]\n"
    change = Overrides(forms=("dual",), tolerances=(1e-6,))
    suite = overridden(tiny_joint.suite(tmp_path, text), change)
    assert [m.entry.gated for m in expand(suite)] == [True]
    (tmp_path / "written.toml").write_text(to_toml(suite))
    assert expand(read_written(tmp_path / "written.toml"))


def test_a_folder_hides_no_suite_and_is_gone_on_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran = list[tuple[str, Path]]()
    monkeypatch.setattr(suite_runs, "run_suite", lambda suite, to, *_: ran.append((suite.name, to)) or 0)
    monkeypatch.chdir(tmp_path)
    for name in ("gate", "mine"):
        Path(name).mkdir()
        Path(name, "suite.toml").write_text(to_toml(read_suite("methods")))
        suite_runs.run(name)
    assert ran == [("gate", Path("results/gate")), ("methods", Path("mine"))]


def test_unknown_suite_names_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"did you mean default\? allowed: accuracy, default, drawn, gate"):
        read_suite("defualt")


class TestOverrides:
    @pytest.fixture
    def suite(self, tmp_path: Path) -> Suite:
        return tiny_joint.suite(tmp_path, TWO, scenes=["tiny.npz", "4386/0052", "6112/0120"])

    def test_scenes_sizes_and_solvers(self, suite: Suite) -> None:
        suite = suite.model_copy(update={"description": "Of the whole suite."})
        changed = overridden(suite, Overrides(sizes=(6112,), solvers=("gi", "exact")))
        assert changed.description == ""
        assert overridden(suite, Overrides(repeats=3)).description == suite.description
        assert changed.scenes == ["6112/0120"]
        assert [(e.name, e.forms) for e in changed.solver] == [("exact", ["dual"]), ("gi", None)]
        assert overridden(suite, Overrides(scenes=("4386/00*",))).scenes == ["4386/0052"]

    def test_figures_take_the_place_of_the_entries_own(self, suite: Suite) -> None:
        limits = {"time_limit_s": 7, "memory_limit_mib": 99}
        change = Overrides(forms=("primal",), tolerances=(1e-4,), repeats=2, threads=(3,), **limits)
        plan = expand(overridden(suite, change))
        assert len(plan) == 3 * 2 * 2
        assert {(m.form, m.tolerance, m.threads) for m in plan} == {("primal", 1e-4, 3)}
        assert {(m.time_limit_s, m.suite.memory_limit_mib) for m in plan} == {(7, 99)}

    def test_a_plugin_joins_the_suites_solvers(self, suite: Suite, tmp_path: Path) -> None:
        plugin = tmp_path / "mine.py"
        plugin.write_text(tiny_joint.EXACT)
        suite = suite.model_copy(update={"solver": suite.solver[1:]})
        for given in (plugin, str(plugin)):
            changed = overridden(suite, Overrides(plugin=given))
            assert [entry.name for entry in changed.solver] == ["piqp", "mine"]
            assert changed.plugin == str(plugin)
        (alone,) = overridden(suite, Overrides(plugin=plugin, solvers=("mine",))).solver
        assert alone.name == "mine"

    def test_a_plugin_that_no_solver_names_is_refused(self, suite: Suite, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="'piqp': mine, that of --plugin"):
            overridden(suite, Overrides(plugin=tmp_path / "mine.py", solvers=("piqp",)))

    def test_unknown_names_give_the_known_ones(self, suite: Suite) -> None:
        with pytest.raises(InputError, match="allowed: 4386, 6112"):
            overridden(suite, Overrides(sizes=(4387,)))
        with pytest.raises(InputError, match=r"no such solver; did you mean clarabel\?"):
            overridden(suite, Overrides(solvers=("clarabell",)))
        with pytest.raises(InputError, match="no such scene"):
            overridden(suite, Overrides(scenes=("nowhere",)))


@pytest.mark.parametrize(
    ("scene", "own", "name"),
    [("tiny.npz", "other/tiny.npz", "tiny"), ("4386/0107", "4386_0107.npz", "4386_0107")],
)
def test_two_scenes_whose_files_would_have_one_name_are_refused(
    tmp_path: Path, scene: str, own: str, name: str
) -> None:
    (tmp_path / "other").mkdir()
    path = tiny_joint.write_problem(tmp_path / own)
    with pytest.raises(InputError, match=f"another is called {name} too") as caught:
        plan_of(tmp_path, scenes=[scene, own])
    assert [fault.value for fault in caught.value.faults] == [str(path)]


def test_files_are_as_distinct_as_the_rows_they_belong_to(tmp_path: Path) -> None:
    """In their options too, and where a name has characters, or a length, that a file cannot have."""
    scenes = [f"{name}.npz" for name in ("a b", "a-b", "ü" * 120)]
    for scene in scenes:
        tiny_joint.write_problem(tmp_path / scene)
    plan: list[Measurement] = []
    for changed in ({"variant": "eps<1"}, {"variant": "eps>1"}, {"options": {"k": 1}}, {"options": {"k": 2}}):
        plan += expand(dual_suite(tmp_path, {"name": "gi"} | changed, scenes=scenes))
    assert len({m.stem for m in plan}) == len({m.key for m in plan}) == 12
    assert all(re.fullmatch(r"[\w.+-]{1,200}", m.stem, re.ASCII) for m in plan)


def test_load_cases_that_are_solved_at_once_in_two_ways_are_of_two_processes(tmp_path: Path) -> None:
    ways = ({"name": "newton", "variant": "batched", "batched": k} for k in (2, 4))
    plan = expand(dual_suite(tmp_path, *ways, series={"cases": 4}))
    assert len({m.stem for m in plan}) == len({m.key for m in plan}) == 8
    assert [[(m.entry.batched, m.case) for m in batch] for batch in batches(plan)] == [
        [(k, case) for case in range(4)] for k in (2, 4)
    ]
    assert [m.entry.batched for m in of_key(plan, plan[-1].key)] == [4] * 4


# Versions of a library.


def versions_asked(tmp_path: Path, *requirements: str, **more: tuple[str, ...]) -> list[tuple[str, str, str]]:
    suite = overridden(tiny_joint.suite(tmp_path, TWO), Overrides(requirements=requirements, **more))
    assert suite_from(tomllib.loads(to_toml(suite)), tmp_path / "small.toml") == suite
    return [(e.name, e.label, e.version) for e in suite.solver]


def test_each_version_is_an_entry_of_its_own(tmp_path: Path) -> None:
    """--with keeps the library's entries only, and adds a library that is not in the suite."""
    assert versions_asked(tmp_path, "piqp==0.6.2", "piqp", "clarabel==0.10.0") == [
        ("piqp", "plain 0.6.2", "0.6.2"),
        ("piqp", "plain", ""),
        ("clarabel", "0.10.0", "0.10.0"),
    ]
    assert versions_asked(tmp_path, "proxsuite==0.7.2", solvers=("proxqp",)) == [
        ("proxqp", "proxsuite==0.7.2", "proxsuite==0.7.2")
    ]
    assert versions_asked(tmp_path, "piqp==0.6.2", solvers=("exact",)) == [
        ("exact", "", ""),
        ("piqp", "plain 0.6.2", "0.6.2"),
    ]


def test_a_version_is_part_of_what_a_row_is_of(tmp_path: Path) -> None:
    text = TWO + 'with = ["piqp==0.6.2", "numpy==2.1.0"]\n'
    plan = expand(tiny_joint.suite(tmp_path, text))
    assert plan[-1].key == "tiny piqp primal plain 0.6.2 numpy==2.1.0 tol=1e-06 threads=1 repeat=0"
    assert plan[-1].entry.requirements == ["piqp==0.6.2", "numpy==2.1.0"]
    (entry,) = with_key(read_suite(str(tmp_path / "small.toml")), plan[-1].key).solver
    assert entry.label == "plain 0.6.2 numpy==2.1.0"


def test_the_name_of_a_plug_in_may_have_blanks_and_dots(tmp_path: Path) -> None:
    name = "my solver 1.2"
    asked = Overrides(solvers=(name,), options=(f"{name}.k=3",), plugin=tmp_path / f"{name}.py")
    suite = overridden(tiny_joint.suite(tmp_path), asked)
    (entry,) = with_key(suite, expand(suite)[0].key).solver
    assert entry.name == name
    assert entry.options == {"k": 3}


@pytest.mark.parametrize("requirement", ["piqp>=0.6", "piqp==", "==1.0", "--index-url=x", "piqp==0.6.*"])
def test_a_version_is_exact(tmp_path: Path, requirement: str) -> None:
    with pytest.raises(InputError, match=r"NAME==VERSION, as piqp==0\.6\.2"):
        versions_asked(tmp_path, requirement)
    with pytest.raises(InputError, match=r"solver.1.with.*must be NAME==VERSION"):
        tiny_joint.suite(tmp_path, TWO + f'with = ["{requirement}"]\n')


def test_only_true_and_false_are_truth_values(tmp_path: Path) -> None:
    text = TWO.replace("gated = false", "gated = 1")
    path = tiny_joint.write_suite(tmp_path, text, trace="yes", threads=[True])
    faults = r"(?s)threads\.0.*number.*trace.*boolean.*solver\.1\.gated.*boolean"
    with pytest.raises(InputError, match=faults):
        read_suite(str(path))


def test_an_option_that_no_row_can_hold_is_refused(tmp_path: Path) -> None:
    """JSON has no infinity: a search found none of its rows again."""
    text = '[[solver]]\nname = "exact"\noptions = { rho = inf, steps = [1, { last = nan }] }\n'
    faults = refusal_of(read_suite, str(tiny_joint.write_suite(tmp_path, text))).faults
    assert [fault.key for fault in faults] == ["solver.0.options.rho", "solver.0.options.steps.1.last"]
    assert {fault.allowed for fault in faults} == {"must be a finite number"}


def test_a_scene_from_outside_is_for_every_entry() -> None:
    """The scenes of an entry are some of the suite's own."""
    suite, every = read_suite("default"), {entry.name for entry in read_suite("default").solver}
    planned = expand(overridden(suite, Overrides(scenes=("scaling/1170", "11308/0220"))))
    assert {m.solver for m in planned if m.scene == "scaling/1170"} == every
    assert {m.solver for m in planned if m.scene == "11308/0220"} < every
