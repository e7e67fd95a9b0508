"""Contributors of a series: Sobol indices in closed form, by quadrature where contacts close, and files."""

import json
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from clopper_pearson import interval_of
from commands import harness, wrong_usage
from scipy import stats
from small_joints import two_parts
from strip_scene import write_strip

from harness.results import series_file
from harness.series.load_case_source import GapCases
from harness.series.session import Job, SeriesSession
from problems.build import load_case, prepared
from problems.forms.assembly import LoadCase
from problems.load_cases import Listed, LoadCases
from problems.load_cases.random_inputs import RandomInputs
from problems.load_cases.sweep import keys_of
from problems.model.fastener_forces import fastener_forces
from problems.model.scene import JointScene
from problems.scene_files import read_scene
from report.document.blocks import Figure, Text
from report.document.numbers import percent_interval
from report.figures.contributors import indices, of_contacts
from report.results.series_results import Series, read
from report.writers.series_contributors import contributors_of

FIXED = ("random = {", "# random = {")


def series_of(cases: RandomInputs, y: np.ndarray) -> Series:
    """A series whose largest gaps are y, (cases,) mm."""
    table = pd.DataFrame({"case": np.arange(len(y)), "max_gap_mm": y, "gap_error_mm": 1e-12})
    facts = cases.facts | {"cases": cases.count}
    none = np.zeros((len(y), 0))
    return Series(facts, {}, table, None, None, np.zeros((0, 2)), [], pd.DataFrame(), none)


def of_gaps(series: Series) -> pd.DataFrame:
    return indices(series, series.cases["max_gap_mm"].to_numpy(), series.cases["gap_error_mm"].max())


def drawn(scene: JointScene, N: int, *random: str) -> RandomInputs:
    cases = GapCases(random=random, contributors=N).of(scene, "dual")
    assert isinstance(cases, RandomInputs)
    return cases


def test_of_a_joint_without_contact(tmp_path: Path) -> None:
    """y = g_j − (K⁻¹f)_j is linear in the inputs: S_i = a_i²σ_i² / Σ a_j²σ_j², which is the total, too."""
    scene = read_scene(str(write_strip(tmp_path, FIXED, ("mean = 0.4", "mean = 9.0"))))
    sd = {"initial_gap.mean": 0.2, "fasteners.preload": 5.0, "pressure.value": 2e-4}
    means = {"initial_gap.mean": 9.0, "fasteners.preload": 60.0, "pressure.value": 1e-4}
    texts = [f"{name}=normal({means[name]}, {sd[name]})" for name in sd]
    texts[1] = texts[1].replace("=", "=each ")
    cases, data = drawn(scene, 64, *texts), prepared(scene).assembly
    j = 20
    row = data.K.solve(data.A[:, [j]].toarray())[:, 0]

    def gap(load: LoadCase) -> float:
        return float(load.g[j] - row @ load.f)

    found = of_gaps(series_of(cases, np.array([gap(cases.load(k)) for k in range(cases.count)])))
    preload, pressure = scene.effects[1:3]
    points = [preload.model_copy(update={"points": (point,)}) for point in preload.points]
    of_preload = sum((row @ one.force(scene.joint) / 60.0 * sd["fasteners.preload"]) ** 2 for one in points)
    of_pressure = (row @ pressure.force(scene.joint) / 1e-4 * sd["pressure.value"]) ** 2
    parts = np.array([sd["initial_gap.mean"] ** 2, of_preload, of_pressure])
    exact = parts / parts.sum()
    assert exact.min() > 0.05
    assert_near(found, exact, exact)


def assert_near(found: pd.DataFrame, first: np.ndarray, total: np.ndarray) -> None:
    """Within twice the half-width of the 95 % interval, some four standard errors."""
    for order, exact in (("first_order", first), ("total_order", total)):
        width = found[f"{order}_high"] - found[f"{order}_low"]
        assert 0 < width.min() < width.max() < 0.9
        assert (abs(found[order] - exact) < width).all()


def test_of_a_joint_in_contact(tmp_path: Path) -> None:
    """The variances of E(y | x) by quadrature over the two inputs: y is piecewise linear in them."""
    scene = read_scene(str(write_strip(tmp_path, FIXED, ("mean = 0.4", "mean = 0.2"))))
    cases = drawn(scene, 64, "pressure.value=uniform(-4e-4, 8e-4)", "fasteners.preload=uniform(10, 50)")

    def largest(some: LoadCases, count: int) -> np.ndarray:
        session = SeriesSession(Job(scene=scene, cases=some, form="dual", check=0, threads=1))
        return np.array([row["max_gap_mm"] for done in session.solve(range(count)) for row, _ in done])

    preload, pressure = scene.effects[1:3]
    loads = [
        LoadCase(
            preload.model_copy(update={"preload": 10 + 50 * (q + 0.5) / 10}).force(scene.joint)
            + pressure.model_copy(update={"value": -4e-4 + 8e-4 * (p + 0.5) / 10}).force(scene.joint),
            np.full(45, 0.2),
        )
        for p in range(10)
        for q in range(10)
    ]
    y = largest(Listed(tuple(loads)), len(loads)).reshape(10, 10)
    first = np.array([y.mean(axis=1).var(), y.mean(axis=0).var()]) / y.var()
    assert 1 - first.sum() > 0.02  # the inputs act together
    assert_near(of_gaps(series_of(cases, largest(cases, cases.count))), first, 1 - first[::-1])


def test_what_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The interval of a share counts two cases of a base point; more base points extend the series."""
    scene, out = write_strip(tmp_path), tmp_path / "out"
    command = "series", scene, "--random", "pressure.value=normal(1e-4, 1e-5)", "--out", out
    with monkeypatch.context() as patch:
        patch.setattr("report.writers.series_report.write", lambda directory: directory)
        assert harness(*command, "--contributors", 2, "--allow-gap", 0.4).exit_code == 4
    done = harness(*command, "--contributors", 16, "--allow-gap", 0.4)
    assert done.exit_code == 4, done.output
    assert "8 already in" in done.output
    assert [row["case"] for row in series_file.rows(out)] == [*range(64)]
    within = [row["max_gap_mm"] <= 0.4 for row in series_file.rows(out)]
    kept = sum(within[k] for k in range(64) if k % 4 < 2)
    interval = percent_interval(interval_of(kept, 32), 2)
    assert f"the share of joints is {interval}, with 95 %" in " ".join(done.output.split())
    table = pd.read_csv(out / "report/contributors.csv")
    pd.testing.assert_frame_equal(table, of_gaps(read(out)), rtol=1e-12)
    assert table["input"].tolist() == ["pressure.value", "initial_gap.random"]
    assert (out / "report/contributors.png").stat().st_size > 1000
    done = read(out)
    table = pd.read_csv(out / "report/contributors-map.csv")
    for j in table.dropna().index[::9]:
        gap = done.gaps[np.arange(64), j : j + 1][:, 0].astype(float)
        alone = of_gaps(replace(done, cases=done.cases.assign(max_gap_mm=gap)))
        for order in ("first_order", "total_order"):
            row = table[[f"{name}, {order}" for name in alone["input"]]].iloc[j]
            np.testing.assert_allclose(row, alone[order], rtol=1e-9)
    shares, alone = of_contacts(done), done.gaps[np.arange(64), 0:45].astype(float)
    moving = np.ptp(alone, axis=0) > 2 * done.cases["gap_error_mm"].max()
    peaked = stats.kurtosis(alone, fisher=False) - 1 >= 32 / 9  # the relative error of a variance, squared
    few = moving & peaked
    assert moving.sum() > few.sum() > 0
    assert (np.isnan(shares) == few).all()
    (left_out,) = contributors_of(replace(done, cases=done.cases[1:]))
    assert isinstance(left_out, Text)
    assert "left out: 1 of 64 cases without an answer" in left_out.markdown


def test_a_series_that_grows_meanwhile_keeps_its_new_facts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another command extends it while the derivatives are computed, and its scene is edited."""
    scene, out = write_strip(tmp_path), tmp_path / "out"
    read = sha256(scene.read_bytes()).hexdigest()

    def meanwhile(_: object) -> dict[str, list[str]]:
        facts = series_file.read_facts(out) or {}
        series_file.write_fact(out, "series", json.dumps(facts | {"cases": 64}))
        scene.write_text("# for the next series")
        return {"input": []}

    monkeypatch.setattr("harness.commands.load_case_series.derivatives", meanwhile)
    monkeypatch.setattr("report.writers.series_report.write", lambda directory: directory)
    words = ("--random", "pressure.value=normal(1e-4, 1e-5)", "--contributors", 2, "--out", out)
    assert harness("series", scene, *words).exit_code == 0
    facts = series_file.read_facts(out) or {}
    assert (facts["cases"], facts["derivatives"]) == (64, {"input": []})
    assert facts["inputs"] == {"strip.toml": read}


def test_forces_in_fasteners(tmp_path: Path) -> None:
    """Each is that of the scene with the values of its row; far from contact it is linear in the inputs."""
    text = f"""{two_parts()}
[[effect]]
kind = "initial_gap"
mean = 9.0
[[effect]]
kind = "installed_fasteners"
points = [[20.0, 10.0], [80.0, 40.0]]
stiffness = 1e3
[[effect]]
kind = "pressure"
part = "a"
value = 1e-4
"""
    path = tmp_path / "tied.toml"
    path.write_text(text)
    scene = read_scene(str(path))
    sd = {"installed_fasteners.approach": 0.01, "installed_fasteners.preload": 2.0, "pressure.value": 2e-4}
    mean = {"installed_fasteners.approach": 0.0, "installed_fasteners.preload": 60.0, "pressure.value": 1e-4}
    cases = drawn(scene, 64, *(f"{key}=normal({mean[key]}, {sd[key]})" for key in sd))
    job = Job(scene=scene, cases=cases, form="dual", check=0, threads=1)
    rows = [row for some in SeriesSession(job).solve(range(cases.count)) for row, _ in some]

    def forces(values: dict[str, float]) -> np.ndarray:
        keys, effects = keys_of(scene), list(scene.effects)
        for name, value in values.items():
            number = keys[name].effect
            effects[number] = keys[name].changed(effects[number], value, scene.joint)
        changed = replace(scene, effects=tuple(effects))
        x = prepared(changed).assembly.K.solve(load_case(changed).f)
        return np.array([one["force_N"] for one in fastener_forces(changed, x)])

    row = rows[5]
    np.testing.assert_allclose(row["fastener_forces_N"], forces({key: row[key] for key in sd}), rtol=1e-9)
    assert row["force_error_N"] < 1e-3
    a = np.array([forces(mean | {key: mean[key] + sd[key]}) - forces(mean) for key in sd])
    exact = a**2 / (a**2).sum(axis=0)
    series = series_of(cases, np.array([row["max_gap_mm"] for row in rows]))
    places = [*fastener_forces(scene, np.zeros(scene.joint.size[0]))]
    series = replace(
        series,
        facts=series.facts | {"fasteners": places},
        cases=series.cases.assign(force_error_N=[row["force_error_N"] for row in rows]),
        forces=np.array([row["fastener_forces_N"] for row in rows]),
    )
    _, figure = contributors_of(series)
    assert isinstance(figure, Figure)
    assert figure.name == "contributors-force"
    table = figure.data
    assert table is not None
    for (_, found), share in zip(table.dropna(subset="x").groupby("x"), exact.T, strict=True):
        assert_near(found.reset_index(drop=True), share, share)
    assert table["input"].tolist() == [*sd] * 3


@pytest.mark.parametrize(("error_mm", "varies"), [(1e-12, False), (np.nan, True)])
def test_a_gap_that_is_proven_not_to_vary_has_no_contributors(
    tmp_path: Path, error_mm: float, varies: bool
) -> None:
    """One that is not proven is not taken for constant."""
    cases = drawn(read_scene(str(write_strip(tmp_path))), 2, "pressure.value=normal(1e-4, 1e-5)")
    gaps = 0.1 + 1e-12 * np.arange(8) / 8
    found = indices(series_of(cases, gaps), gaps, error_mm)
    assert found["total_order"].all() == varies
    assert found.drop(columns="input").to_numpy().any() == varies


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--contributors", 3, "--random", "pressure.value=norm()"), "a power of 2"),
        (("--contributors", 4), "--random, or [random] in the scene"),
        (("--contributors", 4, "--cases", 9, "--random", "pressure.value=norm()"), "no --cases"),
    ],
)
def test_bad_base_points_are_refused(tmp_path: Path, options: tuple[object, ...], said: str) -> None:
    assert said in wrong_usage("series", write_strip(tmp_path), *options, "--out", tmp_path / "out")
