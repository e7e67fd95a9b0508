"""`export --form` and `judge`: problems to other programs, bit for bit, and their answers back."""

import json
import runpy
import shutil
import subprocess
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pandas as pd
import pytest
import scipy.sparse as sp
import tiny_joint
from commands import harness, succeeds, wrong_usage
from small_problems import solve_by_nnls
from strip_scene import write_strip

from harness import export, solve
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms import Form
from problems.forms.problem import in_form
from problems.scene_files import read_scene

READERS = Path(__file__).parents[2] / "examples" / "readers"
EIGEN = Path("/usr/include/eigen3")


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scenes")
    write_strip(folder)
    tiny_joint.write_problem(folder / "tiny.npz")
    return folder


def read_problem(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = runpy.run_path(str(READERS / "read_problem.py"))["read_problem"](folder)
    return found


def dense(M: Any) -> np.ndarray:
    return M.toarray() if sp.issparse(M) else np.asarray(M)


@pytest.mark.parametrize("form", ["primal", "dual", "sparse"])
def test_a_problem_is_written_bit_for_bit(form: Form, scenes: Path, tmp_path: Path) -> None:
    source = scenes / "strip.toml"
    succeeds("export", source, "--form", form, "--with-reference", "--out", tmp_path / "p")
    files = read_problem(tmp_path / "p")
    problem = in_form(prepared(read_scene(str(source)), form=form), form)
    (load,) = problem.loads([load_case(read_scene(str(source)), form)])
    assert np.array_equal(dense(files["P"]), dense(sp.block_diag(problem.blocks)))
    assert np.array_equal(files["q"], problem.q(load))
    if form == "dual":
        assert np.array_equal(files["lb"], np.zeros(45))
        assert "G" not in files
    else:
        assert np.array_equal(dense(files["G"]), dense(problem.G))
        assert np.array_equal(files["h"], problem.h(load))
    assert np.array_equal(files["unit_mm"], np.ones(problem.assembly.n))
    assert float(files["limit_mm"][0]) == 1e-7
    assert 0 < float(files["bound_mm"][0]) < 1e-9


@pytest.mark.parametrize("listed", [True, False])
def test_another_program_takes_the_place_of_the_first(listed: bool, scenes: Path, tmp_path: Path) -> None:
    """Readers tell forms apart by their files; a file of the user stays.

    listed : whether about.json names the files of the first, which version 0.3.0 did not. It had no unit_mm.
    """
    out, words = tmp_path / "p", ("export", scenes / "tiny.npz", "--form")
    succeeds(*words, "primal", "--with-reference", "--out", out)
    (out / "mine.txt").write_text("mine")
    about = json.loads((out / "about.json").read_text())
    assert sorted(path.name for path in out.iterdir()) == sorted(["mine.txt", *about["files"]])
    if not listed:
        (out / "unit_mm.mtx").unlink()
        del about["files"]
    (out / "about.json").write_text(json.dumps(about))
    succeeds(*words, "dual", "--out", out)
    assert {path.name for path in out.iterdir()} == {"P.mtx", "q.mtx", "lb.mtx", "about.json", "mine.txt"}


def test_a_record_of_another_program_names_nothing_to_remove(scenes: Path, tmp_path: Path) -> None:
    (tmp_path / "about.json").write_text('{"files": ["mine.mtx"]}')
    (tmp_path / "mine.mtx").write_text("mine")
    succeeds("export", scenes / "tiny.npz", "--form", "dual", "--out", tmp_path)
    assert (tmp_path / "mine.mtx").read_text() == "mine"


def test_the_reference_is_the_answer_of_another_method(scenes: Path, tmp_path: Path) -> None:
    """The files alone, solved by nnls."""
    succeeds("export", scenes / "tiny.npz", "--form", "primal", "--with-reference", "--out", tmp_path / "p")
    scene = read_scene(str(scenes / "tiny.npz"))
    x, lam = solve_by_nnls(prepared(scene), load_case(scene))
    found = read_problem(tmp_path / "p")
    np.testing.assert_allclose(found["x"], x, atol=1e-12)
    np.testing.assert_allclose(found["lam"], lam, atol=1e-11)
    residual = found["P"] @ x + found["q"] + found["G"].T @ lam
    assert abs(residual).max() < 1e-11


@pytest.mark.parametrize("form", ["dual", "sparse"])
def test_one_npz_holds_the_same(form: Form, scenes: Path, tmp_path: Path) -> None:
    asked = ("export", scenes / "strip.toml", "--form", form, "--with-reference", "--out")
    succeeds(*asked, tmp_path / "p")
    succeeds(*asked, tmp_path / "p.npz")
    files = read_problem(tmp_path / "p")
    with np.load(tmp_path / "p.npz") as archive:
        arrays = dict(archive)
    if form == "sparse":
        for name in "PG":
            parts = [arrays.pop(f"{name}_{part}") for part in ("data", "indices", "indptr", "shape")]
            arrays[name] = sp.csc_array(tuple(parts[:3]), shape=tuple(parts[3])).toarray()
    assert str(arrays["scene"]) == "strip"
    for name, M in files.items():
        assert np.array_equal(arrays[name], dense(M)), name


@pytest.mark.parametrize(
    ("words", "out", "message"),
    [
        ("--format op4 --form dual", "p", "none with --form"),
        ("--format npz --with-reference", "p", "needs --form"),
        ("", "p", "--format: format = None: one of"),
        ("--form dual --with-reference", "p.mps", "it holds no answer"),
        ("--form dual --with-reference", "p.parquet", "it holds no answer"),
    ],
)
def test_options_that_exclude_others(
    words: str, out: str, message: str, scenes: Path, tmp_path: Path
) -> None:
    assert message in wrong_usage("export", scenes / "tiny.npz", *words.split(), "--out", tmp_path / out)


@pytest.mark.slow
@pytest.mark.skipif(not (shutil.which("g++") and EIGEN.is_dir()), reason="needs g++ and Eigen")
def test_the_reader_in_cpp_agrees_with_the_one_in_python(scenes: Path, tmp_path: Path) -> None:
    compiled = tmp_path / "read_problem"
    command = ["g++", "-I", str(EIGEN), str(READERS / "read_problem.cpp"), "-o", str(compiled)]
    subprocess.run(command, check=True)
    for form in ("dual", "sparse"):
        asked = ("export", scenes / "strip.toml", "--form", form, "--with-reference", "--out")
        succeeds(*asked, tmp_path / form)
        said = subprocess.run([compiled, tmp_path / form], capture_output=True, text=True, check=True).stdout
        unknowns, residual = map(float, said.split())
        assert unknowns == len(read_problem(tmp_path / form)["q"])
        assert residual < 1e-9


# The answer back.


@pytest.fixture(scope="module")
def answer(scenes: Path) -> tuple[np.ndarray, np.ndarray]:
    scene = read_scene(str(scenes / "tiny.npz"))
    x, lam = solve_by_nnls(prepared(scene), load_case(scene))
    return np.asarray(x), np.asarray(lam)


def written(path: Path, x: np.ndarray, name: str = "x") -> Path:
    if path.suffix == ".npz":
        np.savez(path, **{name: x})
    elif name == "lam":
        np.savetxt(path, x, header=name, comments="")
    else:
        lines = (f"{k},a – b,{v!r}\n" for k, v in enumerate(x.tolist()))
        path.write_text("node,part,displacement_mm\n" + "".join(lines))
    return path


@pytest.mark.parametrize(
    ("name", "shift", "code"),
    [("x.npz", 2e-7, 1), ("x.csv", 2e-7, 1), ("x.npz", 5e-8, 0)],
)
def test_displacements(name: str, shift: float, code: int, scenes: Path, answer: Any, tmp_path: Path) -> None:
    x = answer[0].copy()
    x[7] += shift
    done = harness("judge", written(tmp_path / name, x), scenes / "tiny.npz")
    assert done.exit_code == code, done.output
    assert ("Outside" if code else "Within") in done.stdout
    assert f"{shift:.3e} at entry 7" in done.stdout


def test_an_answer_in_other_units_is_judged_by_its_millimetres(tmp_path: Path) -> None:
    """Each in its own unit: 2e-3 mm in the largest, and 1e-3 mm, a larger number, in the smallest."""
    rung, out = "hard/units/unknowns", tmp_path / "p"
    succeeds("export", rung, "--form", "primal", "--with-reference", "--out", out)
    files = read_problem(out)
    x, unit = files["x"], files["unit_mm"]
    large, small = int(unit.argmax()), int(unit.argmin())
    assert unit[large] == 16
    assert unit[small] == 1 / 16
    x[large] += 2e-3 / unit[large]
    x[small] += 1e-3 / unit[small]
    done = harness("judge", written(tmp_path / "x.npz", x), rung)
    assert done.exit_code == 1, done.output
    assert f"2.000e-03 at entry {large}" in done.stdout


def test_forces_alone_are_judged_by_their_displacements(scenes: Path, answer: Any, tmp_path: Path) -> None:
    _, lam = answer
    path = written(tmp_path / "lam.csv", lam, "lam")
    told = succeeds("judge", path, scenes / "tiny.npz")
    assert "largest unbalanced force" in told
    written(path, lam + 1e-3 * (lam > 0), "lam")
    assert harness("judge", path, scenes / "tiny.npz").exit_code == 1


def test_tables_of_solve_are_answers(scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("report.writers.answer_report.answer_figures", lambda *_: {})
    succeeds("solve", scenes / "strip.toml", "--out", tmp_path)
    for name in ("nodes.csv", "contacts.csv", "solution.npz"):
        succeeds("judge", tmp_path / name, scenes / "strip.toml")
    header, *lines = (tmp_path / "nodes.csv").read_text().splitlines()
    (tmp_path / "nodes.csv").write_text(
        "\n".join([header, *sorted(lines, key=lambda line: line.split(",")[-1])])
    )
    done = harness("judge", tmp_path / "nodes.csv", scenes / "strip.toml")
    assert (done.exit_code, "rows in its order" in done.stderr) == (2, True)


@pytest.mark.parametrize(
    ("limit", "code", "said"),
    [("1e-16", 3, "Cannot be judged"), ("0", 2, "positive"), ("nan", 2, "positive")],
)
def test_a_wrong_limit(limit: str, code: int, said: str, scenes: Path, answer: Any, tmp_path: Path) -> None:
    done = harness("judge", written(tmp_path / "x.npz", answer[0]), scenes / "tiny.npz", "--limit", limit)
    assert done.exit_code == code
    assert said in done.output


BAD: dict[str, tuple[Any, int, str]] = {
    "nan.npz": (np.full(20, np.nan), 2, "20 of 20 are not"),
    "infinite.csv": ("x\n" + "inf\n" * 20, 2, "must be a finite number"),
    "short.npz": (np.zeros(19), 5, "20 in the primal form"),
    "forces10.csv": ("lam\n" + "0\n" * 11, 5, "name another form"),
    "matrix.npz": (np.zeros((4, 5)), 2, "a vector"),
    "text.npz": (np.array(["a"]), 2, "a vector"),
    "x.npy": (np.zeros(20), 2, "a .npz or .csv file"),
    "words.csv": ("x\none\n", 2, "numbers"),
    "heading.csv": ("a,b\n1,2\n", 2, "displacement_mm"),
    "ragged.csv": ("x,lam\n1,2\n1\n", 2, "numbers"),
    "permuted.csv": ("node,x\n" + "".join(f"{k},0\n" for k in range(20, 0, -1)), 2, "an index that ascends"),
    "index.csv": (
        "part,index,x\n" + "".join(f"a,{k},0\n" for k in range(20, 0, -1)),
        2,
        "column 2 = 'index'",
    ),
    "decimal.csv": ("i,x,\n" + "0,1,5\n" * 20, 2, "one for each heading"),
    "row.csv": ("x\n" + "0\n" * 20 + "#N/A\n", 2, "line 22"),
    "coordinate.csv": ("x,y,displacement_mm\n" + "0,0,0\n" * 20, 2, "one of them alone"),
    "forces.csv": ("force_N,lam\n" + "0,0\n" * 10, 2, "one of them alone"),
    "empty.csv": ("", 2, "displacement_mm"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_answer_of_this_problem_is_refused(name: str, scenes: Path, tmp_path: Path) -> None:
    content, code, message = BAD[name]
    path = tmp_path / name
    if isinstance(content, str):
        path.write_text(content)
    elif path.suffix == ".npy":
        np.save(path, content)
    else:
        written(path, content)
    done = harness("judge", path, scenes / "tiny.npz")
    assert done.exit_code == code, done.output
    assert message in done.stderr


def test_a_text_in_an_npz_is_no_answer(scenes: Path, tmp_path: Path) -> None:
    with ZipFile(tmp_path / "x.npz", "w") as archive:
        archive.writestr("x", "0.0")
    assert "a vector of numbers" in wrong_usage("judge", tmp_path / "x.npz", scenes / "tiny.npz")


def test_forces_whose_displacements_overflow_are_refused(tmp_path: Path) -> None:
    """As where the largest number stands for no value."""
    scene = tmp_path / "soft.npz"
    np.savez(scene, K=0.5 * np.eye(2), A=[[1.0], [-1.0]], f=[3.0, -1.0], g=[0.5])
    told = wrong_usage("judge", written(tmp_path / "lam.npz", np.array([1.7e308]), "lam"), scene)
    assert "lam.npz: lam[0] = 1.7e+308: forces whose displacements do not overflow" in told


def read_mps(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, float]]:
    """P, q, G, h and the lower bounds of a free MPS file with QUADOBJ; z is free but for these."""
    section, rows, columns = "", list[str](), dict[str, int]()
    entries: dict[str, list[list[str]]] = {}
    for line in path.read_text().splitlines():
        if line[:1] not in (" ", "*", ""):
            section = line.split()[0]
        elif (words := line.split()) and line[0] == " ":
            entries.setdefault(section, []).append(words)
            if section == "COLUMNS":
                columns.setdefault(words[0], len(columns))
    rows = [name for kind, name in entries["ROWS"] if kind == "L"]
    (objective,) = (name for kind, name in entries["ROWS"] if kind == "N")
    q, G, P = np.zeros(len(columns)), np.zeros((len(rows), len(columns))), np.zeros((len(columns),) * 2)
    for column, *pairs in entries["COLUMNS"]:
        for row, value in zip(pairs[::2], pairs[1::2], strict=True):
            (q if row == objective else G[rows.index(row)])[columns[column]] = float(value)
    for a, b, value in entries["QUADOBJ"]:
        P[columns[a], columns[b]] = P[columns[b], columns[a]] = float(value)
    h = np.zeros(len(rows))
    for _, *pairs in entries.get("RHS", []):
        for row, value in zip(pairs[::2], pairs[1::2], strict=True):
            h[rows.index(row)] = float(value)
    free = {words[2] for words in entries.get("BOUNDS", []) if words[0] in ("FR", "MI")}
    return P, q, G, h, {name: -np.inf if name in free else 0.0 for name in columns}


@pytest.mark.parametrize(("form", "name"), [("primal", "p.mps"), ("dual", "p.qps"), ("sparse", "p.mps")])
def test_an_mps_file_has_the_program_and_its_optimum(
    form: Form, name: str, scenes: Path, tmp_path: Path
) -> None:
    """By a reader of our own, to all digits; HiGHS reads it back and finds the certified displacements."""
    import highspy

    source, out = scenes / "strip.toml", tmp_path / name
    succeeds("export", source, "--form", form, "--out", out)
    P, q, G, h, lower = read_mps(out)
    problem = in_form(prepared(read_scene(str(source)), form=form), form)
    (load,) = problem.loads([load_case(read_scene(str(source)), form)])
    assert np.array_equal(P, dense(sp.block_diag(problem.blocks)))
    assert np.array_equal(q, problem.q(load))
    assert set(lower.values()) == {0.0 if form == "dual" else -np.inf}
    if form != "dual":
        assert np.allclose(G, dense(problem.G), rtol=1e-14, atol=0)
        assert np.allclose(h, problem.h(load), rtol=1e-14, atol=0)
    highs = highspy.Highs()
    highs.silent()
    read = highs.readModel(str(out.rename(out.with_suffix(".mps"))))
    assert read in (highspy.HighsStatus.kOk, highspy.HighsStatus.kWarning)  # 1.16 leaves out |P_ij| <= 1e-9
    for option in ("qp_regularization_value", "primal_feasibility_tolerance", "dual_feasibility_tolerance"):
        highs.setOptionValue(option, 0.0 if option[0] == "q" else 1e-10)
    highs.run()
    z = np.array(highs.getSolution().col_value)
    exact, found = solve(str(source)), z if form == "dual" else problem.assembly.at_junction(z)
    assert found == pytest.approx(exact.lam if form == "dual" else exact.x, abs=1e-7)


def test_a_suite_is_a_test_set(scenes: Path, tmp_path: Path) -> None:
    """As qpbenchmark reads it: P, G and A by rows with as many columns as q has entries. One program is in
    memory at a time: each is a group of rows.
    """
    parquet = pytest.importorskip("pyarrow.parquet")
    suite = 'scenes = ["tiny.npz", "strip.toml"]\n[[solver]]\nname = "gi"\n'
    (scenes / "pair.toml").write_text(suite)
    out = tmp_path / "pair.parquet"
    succeeds("export", scenes / "pair.toml", "--form", "primal", "--out", out)
    said = subprocess.run(["sha256sum", "-c", f"{out.name}.sha256"], cwd=tmp_path, capture_output=True)
    assert said.returncode == 0
    assert parquet.ParquetFile(out).num_row_groups == 2
    problems = pd.read_parquet(out, engine="pyarrow")
    assert list(problems["name"]) == ["tiny", "strip"]
    assert set(problems.columns) == {"P", "q", "G", "h", "A", "b", "lb", "ub", "name"}
    for line, source in zip(problems.to_dict("records"), ("tiny.npz", "strip.toml"), strict=True):
        problem = in_form(prepared(read_scene(str(scenes / source)), form="primal"), "primal")
        assert line["lb"] is line["ub"] is line["A"] is line["b"] is None
        n = len(line["q"])
        assert np.array_equal(line["P"].reshape(-1, n), dense(sp.block_diag(problem.blocks)))
        assert np.array_equal(line["G"].reshape(-1, n), dense(problem.G))


def test_a_scene_is_no_test_set(scenes: Path, tmp_path: Path) -> None:
    scene = read_scene(str(scenes / "strip.toml"))
    with pytest.raises(InputError, match=r"^SUITE: name = 'strip': the name of a suite"):
        export(scene, tmp_path / "strip.parquet", form="dual")


def test_two_programs_of_one_name_are_no_test_set(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        write_strip(tmp_path / folder)
    suite = tmp_path / "two.toml"
    suite.write_text('scenes = ["a/strip.toml", "b/strip.toml"]\n[[solver]]\nname = "gi"\n')
    told = wrong_usage("export", suite, "--form", "dual", "--out", tmp_path / "two.parquet")
    assert "scenes = ['strip']: names of their own" in told
