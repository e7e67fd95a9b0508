"""The public interface: what it gives is what the commands give, and what it refuses it names."""

import tomllib
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tiny_joint
from refusals import refusal_of
from small_problems import make_load, own_arrays, solve_by_nnls
from strip_scene import STRIP, write_strip

import harness
import rivetbench
from harness import (
    Answer,
    GapCases,
    InputError,
    LoadCase,
    Solver,
    api,
    judge,
    load_scene,
    own_matrices,
    random_gaps,
    solve,
    solve_dual,
    solve_series,
)
from harness.series.session import Job
from harness.verification.reference import reference_of
from problems.build import load_case, prepared
from problems.effects.fasteners import Fasteners
from problems.input.tables import TableOptions
from problems.load_cases import Listed
from problems.model.joint import Joint
from problems.model.joint_model import JointModel
from solvers.base import failed


def test_the_names_are_offered_and_documented() -> None:
    assert harness.__all__ == api.__all__
    for name in harness.__all__:
        assert getattr(harness, name) is getattr(api, name)
        assert getattr(harness, name).__doc__
        assert getattr(rivetbench, name) is getattr(api, name)
    assert dir(rivetbench) == sorted(api.__all__)
    with pytest.raises(AttributeError, match="no 'slove'"):
        _ = rivetbench.slove


def test_a_scene_from_a_dict_or_objects_is_that_of_the_file(tmp_path: Path) -> None:
    table = tomllib.loads(STRIP)
    scenes = [load_scene(write_strip(tmp_path)), load_scene(table)]
    assert table == tomllib.loads(STRIP)  # left as it was
    gap, fasteners, *others = table["effect"]
    effects = (gap, Fasteners.model_validate(fasteners), *others)
    scenes.append(load_scene({"joint": Joint.model_validate(table["joint"]), "effect": effects}))
    gap["random"]["seed"] = np.int64(gap["random"]["seed"])
    scenes.append(load_scene(table))
    assert len({scene.key for scene in scenes}) == 1
    assert load_scene(scenes[0]) is scenes[0]


@pytest.mark.usefixtures("without_report")
def test_every_function_takes_a_scene_as_an_object_or_a_dict(tmp_path: Path) -> None:
    table = tomllib.loads(STRIP)
    sources = [str(write_strip(tmp_path)), load_scene(table), table]
    assert len({harness.validate(source) for source in sources}) == 1
    written = [
        harness.export(source, tmp_path / f"{n}.npz", format="npz") for n, source in enumerate(sources)
    ]
    assert len({load_scene(path).key for path in written}) == 1
    assert harness.import_matrices(written[0], tmp_path / "again.npz").exists()
    sweep: Any = {"sweep": ["initial_gap.mean=0.4,0.5"], "options": harness.SeriesOptions(check=0)}
    done = [harness.run_series(source, tmp_path / f"{n}", **sweep) for n, source in enumerate(sources)]
    assert len({tuple(row["max_gap_mm"] for row in one.rows) for one in done}) == 1
    for source in sources:
        with pytest.raises(InputError, match=r"KEY one of initial_gap\.mean"):
            harness.tolerance(source, tmp_path / "none", "nothing=1:2", 0.1)


def test_load_cases_have_paths_or_texts_and_possible_numbers(tmp_path: Path) -> None:
    scene = load_scene(write_strip(tmp_path))
    np.savetxt(tmp_path / "table.csv", np.full((3, 45), 0.2), delimiter=",")
    for k in range(2):
        (tmp_path / f"scan{k}.csv").write_text(f"x,y,gap\n0,0,0.{k + 1}\n400,0,0.2\n0,120,0.2\n400,120,0.3\n")
    for name, path in (("gaps", "table.csv"), ("around", "scan0.csv"), ("scans", "scan*.csv")):
        pair = [GapCases(count=2, **{name: kind(tmp_path / path)}) for kind in (str, Path)]  # type: ignore[arg-type]
        assert len({tuple(map(str, cases.files)) for cases in pair}) == 1
        text, path_of = (cases.of(scene, "dual").load(1).g for cases in pair)
        np.testing.assert_array_equal(text, path_of)
    how: Any = {"threads": 2.5, "check": -1}
    for given, names in (
        ({"count": 0, "seed": -1}, ["--cases", "--seed"]),
        ({"count": 2.5, "seed": 0.5}, ["--cases", "--seed"]),
        ({"count": 10**10, "gaps": ""}, ["--cases", "--gaps"]),
        ({"contributors": 8.0, "random": ("x",), "scans": ""}, ["--contributors", "--scans"]),
    ):
        asked: Any = GapCases(**given), harness.SeriesOptions(**how)  # type: ignore[arg-type]
        faults = refusal_of(harness.run_series, scene, tmp_path / "none", *asked).faults
        assert [fault.where for fault in faults] == [*names, "--threads", "--check"]
    faults = refusal_of(harness.place, scene, tmp_path / "none", count=2.5).faults
    assert [fault.where for fault in faults] == ["--count"]
    pair = [GapCases(2, 3), GapCases(np.int64(2), np.int64(3))]  # type: ignore[arg-type]
    assert len({cases.of(scene, "dual").key for cases in pair}) == 1


def test_all_faults_of_a_dict_are_named() -> None:
    table = tomllib.loads(STRIP.replace("preload = 60.0", "preload = -1.0").replace("ribs", "rips"))
    faults = refusal_of(load_scene, table).faults
    assert [fault.key for fault in faults] == ["effect[1] (fasteners).preload", "effect[3].kind"]


@pytest.mark.parametrize("solver", [None, "newton", "piqp"])
@pytest.mark.parametrize("form", [None, "primal"])
def test_solutions_are_the_independent_answer(solver: str | None, form: Any) -> None:
    if solver == "newton" and form == "primal":
        with pytest.raises(InputError, match="newton: form = 'primal': it takes dual"):
            solve(own_matrices(*own_arrays()[2]), solver, form=form)
        return
    data, load, arrays = own_arrays()
    x, lam = solve_by_nnls(data, load)
    solution = solve(own_matrices(*arrays), solver, form=form, tolerance=1e-10)
    assert arrays[2].flags.writeable
    assert solution.status == "solved"
    assert solution.judgement.verdict == "within"
    np.testing.assert_allclose(solution.x, x, atol=1e-9)
    np.testing.assert_allclose(solution.lam, lam, atol=1e-5)
    np.testing.assert_allclose(solution.gap, load.g - data.assembly.A.T @ x, atol=1e-9)
    assert abs(solution.x - x).max() <= solution.error_bound_mm + 1e-11
    assert (solution.iterations is None) == (solver is None)
    assert 0 < solution.error_bound_mm < (1e-11 if solver is None else 1e-7)
    away, near = solution.judgement.displacement_error_mm, solution.problem.reference.bound_mm
    assert away is not None
    rounded = (1 + 4 * Fraction(2) ** -53) * Fraction(away)  # of the distance as computed
    assert Fraction(solution.error_bound_mm) >= rounded + Fraction(near)


def test_an_x_from_elsewhere_is_judged() -> None:
    data, load, own = own_arrays()
    scene = own_matrices(*own)
    x, lam = solve_by_nnls(data, load)
    right, wrong = judge(scene, x, lam), judge(scene, x + 1e-6)
    assert right.verdict == "within"
    assert right.backward_error < 1e-14
    assert wrong.verdict == "outside"
    assert wrong.displacement_error_mm == pytest.approx(1e-6, rel=1e-5)
    assert wrong.dual_residual is None
    assert judge(scene, x + 1e-6, limit_mm=1e-5).verdict == "within"
    with pytest.raises(InputError, match=r"judge: x.shape = \(13,\): must be \(14,\)"):
        judge(scene, x[:-1])


def test_plain_arrays_are_copied_and_checked() -> None:
    data, load, _ = own_arrays()
    Q, p = data.Q, load.p
    before = Q.copy(), p.copy()
    assert solve_dual(Q, p).x is None
    for array, was in zip((Q, p), before, strict=True):
        assert array.flags.writeable
        np.testing.assert_array_equal(array, was)
    for bad, said in (
        ((Q[:-1], p), r"Q.shape = \(7, 8\): must be a square matrix"),
        ((Q, p[:-1]), r"p.shape = \(7,\): must be \(8,\)"),
        ((Q + np.triu(np.ones_like(Q), 1), p), "symmetric"),
        ((-Q, p), "positive definite"),
        ((Q * np.nan, p), "finite"),
        ((Q * (1 + 1j), p), "must be real numbers"),
        ((Q, p * (1 + 1j)), "must be real numbers"),
    ):
        with pytest.raises(InputError, match=said):
            solve_dual(*bad)
    with pytest.raises(InputError, match="did you mean newton"):
        solve_dual(Q, p, "newtom")


def test_masked_values_are_no_numbers() -> None:
    g = np.ma.masked_equal([0.2, -1.0], -1.0)
    scene = own_matrices(np.eye(2), np.eye(2), [1.0, 1.0], np.ma.masked_equal([0.2, 0.3], -1.0))
    for refused in (
        lambda: own_matrices(np.eye(2), np.eye(2), [1.0, 1.0], g),
        lambda: judge(scene, g),
        lambda: list(solve_series(scene, [LoadCase([1.0, 1.0], g)])),
    ):
        with pytest.raises(InputError, match="a number in each place; some are masked"):
            refused()


class Idle(Solver):
    """Gives λ = 0, or what it is told to give."""

    forms = ("dual",)

    def __init__(self, lam: Any = None, status: Any = "solved") -> None:
        self.lam, self.status = lam, status

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        if self.status == "failed":
            return failed("Q has no band")
        return Answer(self.status, self.lam if self.lam is not None else 0 * load.p)


def test_a_solver_object_is_judged_and_its_nonsense_named() -> None:
    scene = own_matrices(*own_arrays()[2])
    idle = solve(scene, Idle())
    assert (idle.status, idle.judgement.verdict) == ("solved", "outside")
    assert idle.error_bound_mm > 0.01
    with pytest.raises(InputError, match=r"solver Idle: answer = 'lam has shape \(1,\)"):
        solve(scene, Idle(np.zeros(1)))
    with pytest.raises(InputError, match=r"solver Idle: status = 'failed: Q has no band'.* or form"):
        solve(scene, Idle(status="failed"))
    with pytest.raises(InputError, match="has its options already"):
        solve(scene, Idle(), options={"lam": None})
    with pytest.raises(InputError, match=r"an object of it: Idle\(\)"):
        solve(scene, Idle)  # type: ignore[arg-type]


@pytest.mark.parametrize("options", [{"time_limit_s": np.nan}, {"memory_limit_mib": 0}])
def test_a_series_from_python_has_limits_that_stop(tmp_path: Path, options: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"limit = (nan|0): above 0"):
        harness.run_series(write_strip(tmp_path), tmp_path / "out", options=harness.SeriesOptions(**options))


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e-9, 0.0])
def test_a_tolerance_or_limit_that_no_answer_meets_is_refused_from_python(value: float) -> None:
    scene = own_matrices(*own_arrays()[2])
    for refused in (
        lambda: solve(scene, tolerance=value),
        lambda: solve_dual(np.eye(2), np.ones(2), tolerance=value),
        lambda: solve_series(scene, [], tolerance=value),
        lambda: solve_series(scene, [], limit_mm=value),
        lambda: judge(scene, np.zeros(14), limit_mm=value),
    ):
        with pytest.raises(InputError, match=rf" = {value}: must be positive and finite"):
            refused()
    with pytest.raises(InputError, match="nan"):
        solve(scene, limit_s=np.nan)


def test_a_text_is_no_list(tmp_path: Path) -> None:
    """Its letters would be read as entries."""
    for refused, name in (
        (lambda: GapCases(random="fasteners.preload=normal(1000, 100)"), "random"),  # type: ignore[arg-type]
        (lambda: GapCases(options=TableOptions(missing="9999")), "missing"),  # type: ignore[arg-type]
        (lambda: harness.Overrides(scenes="gallery/*"), "scenes"),  # type: ignore[arg-type]
        (lambda: harness.check_solver(Idle, "dual"), "forms"),  # type: ignore[arg-type]
        (lambda: harness.run_series(STRIP, tmp_path / "out", sweep="fasteners.preload=1"), "sweep"),
    ):
        with pytest.raises(InputError, match=f"{name} = .*: a list of texts, not one text"):
            refused()


def test_an_answer_that_is_changed_leaves_the_reference() -> None:
    answer = solve(own_matrices(*own_arrays()[2]))
    x, lam = answer.x, answer.problem.reference.lam.copy()
    answer.x[:] = 1.0
    answer.lam[:] = 1.0
    np.testing.assert_array_equal(answer.x, x)
    np.testing.assert_array_equal(answer.problem.reference.lam, lam)


def test_a_scene_is_that_of_the_folder_where_it_was_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though another one has a file of that name."""
    for name, f in (("there", 2.0), ("here", 1.0)):
        (tmp_path / name).mkdir()
        np.savez(tmp_path / name / "own.npz", K=np.eye(1), A=np.eye(1), f=[f], g=[9.0])
    monkeypatch.chdir(tmp_path / "here")
    scene = load_scene("own.npz")
    monkeypatch.chdir(tmp_path / "there")
    assert solve(scene).x == pytest.approx([1.0])


def test_the_plugin_of_a_series_is_a_text_or_a_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where workers find it, too. Matrices in memory cannot be sent to its process."""
    jobs: list[Job] = []

    def run(job: Job, *of: Any) -> int:
        jobs.append(job)
        return 0

    monkeypatch.setattr("harness.commands.load_case_series.run", run)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "exact.py").write_text(tiny_joint.EXACT)
    options = harness.SeriesOptions(solver="exact", plugin="exact.py")
    strip, few = write_strip(tmp_path), GapCases(count=1)
    harness.run_series(strip, "out", few, options, report=False)
    assert jobs[0].plugin == tmp_path / "exact.py"
    with pytest.raises(InputError, match=r"--plugin: scene = .*`export` makes one"):
        harness.run_series(own_matrices(*own_arrays()[2]), "out", few, options)


@pytest.mark.parametrize(("solver", "form"), [("newton", "dual"), ("gi", "dual"), ("gi", "primal")])
def test_a_series_of_own_load_cases(solver: str, form: Any) -> None:
    data, _, arrays = own_arrays()
    loads = [make_load(seed, data)[0] for seed in range(4)]
    results = list(solve_series(own_matrices(*arrays), loads, solver, form=form, check=2))
    assert [result.row["case"] for result in results] == [0, 1, 2, 3]
    for load, result in zip(loads, results, strict=True):
        x, _ = solve_by_nnls(data, load)
        assert result.row["verdict"] == "within"
        assert ("displacement_error_mm" in result.row) == (result.row["case"] % 2 == 0)
        np.testing.assert_allclose(result.gap, load.g - data.assembly.A.T @ x, atol=1e-6)
    assert all(array.flags.writeable for load in loads for array in (load.f, load.g))
    with pytest.raises(InputError, match=r"case 1: g\.shape"):
        solve_series(own_matrices(*arrays), [loads[0], LoadCase(loads[1].f, loads[1].g[1:])])


def test_a_series_of_no_load_cases_has_no_results() -> None:
    assert not list(solve_series(own_matrices(*own_arrays()[2]), Listed(())))


def test_series_and_judge_in_the_sparse_form_condense_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene(tomllib.loads(STRIP))
    gaps = [results.gap for results in solve_series(scene, random_gaps(scene, 2, seed=5))]
    with pytest.raises(InputError, match=r"case 0: f\.shape"):
        solve_series(scene, random_gaps(scene, 2, seed=5), form="sparse")  # made for the dual form
    load = load_case(scene, "sparse")
    x = reference_of(scene, prepared(scene, form="sparse"), load).x
    monkeypatch.setattr(JointModel, "dense", lambda *given: pytest.fail("condensed"))
    cases = random_gaps(scene, 2, seed=5, form="sparse")
    results = list(solve_series(scene, cases, form="sparse"))
    assert [result.row["verdict"] for result in results] == ["within"] * 2
    np.testing.assert_allclose([result.gap for result in results], gaps, atol=1e-7)
    assert judge(scene, x, form="sparse").verdict == "within"
    assert judge(scene, x + 1e-6, form="sparse").verdict == "outside"
