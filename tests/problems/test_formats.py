"""Matrices out to other programs' files and back, and what is said of the files' digits."""

import re
import subprocess
import sys
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from commands import onto, wrong_usage
from hypothesis import given, settings
from hypothesis import strategies as st
from matrix_files import PATHS, files_of
from refusals import refusal_of
from rich.console import Console
from small_problems import make_load, make_prepared, solve_by_nnls

from harness import own_matrices, solve
from harness.scene.export import export, matrices
from harness.scene.import_files import import_matrices
from harness.scene.solve import solve_into
from harness.verification.reference_problem import ReferenceProblem
from harness.verification.rounded_stiffness import expected_error
from problems import formats
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.input.matrix_files import apparent_digits
from problems.scene_files import read_scene
from problems.stiffness.operator import Stiffness

ROOT = Path(__file__).parents[2]
SCENE = "gallery/installed-fasteners"  # springs join both parts into one block of K


def there_and_back(form: str, folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """K, A, f, g of the scene, and the same after export and import."""
    export(SCENE, folder / PATHS[form], format=form)
    import_matrices(files_of(form, folder / PATHS[form]), folder / "back.npz")
    scene = read_scene(SCENE)
    data = prepared(scene)
    wanted = matrices(data, load_case(scene))
    return wanted, dict(np.load(folder / "back.npz"))


@pytest.mark.parametrize("form", [form for form in formats.FORMATS if form != "dmig"])
def test_a_round_trip_is_bit_for_bit(form: str, tmp_path: Path) -> None:
    wanted, read_back = there_and_back(form, tmp_path)
    for name in "KA":
        np.testing.assert_array_equal(read_back[name], wanted[name].toarray())
    for name in "fg":
        np.testing.assert_array_equal(read_back[name], wanted[name])
    if form == "npz":
        np.testing.assert_array_equal(read_back["nodes"], wanted["nodes"])


@pytest.mark.parametrize("form", formats.FORMATS)
def test_a_scene_that_was_solved_is_exported(form: str, tmp_path: Path) -> None:
    """Solvers are given its matrices read-only."""
    scene = own_matrices(2 * np.eye(2), np.eye(2), [1.0, 3.0], [1.0, 1.0])
    assert solve(scene, "gi").has_contact
    export(scene, tmp_path / PATHS[form], format=form)
    import_matrices(files_of(form, tmp_path / PATHS[form]), tmp_path / "back.npz")
    np.testing.assert_array_equal(np.load(tmp_path / "back.npz")["A"], np.eye(2))


def test_an_almost_symmetric_A_comes_back_from_op4_as_it_was(tmp_path: Path) -> None:
    """pyyeti calls a matrix symmetric whose entries differ by 1e-8, of which one triangle would count."""
    A = np.array([[1.0, 0.0], [1e-9, 1.0]])
    data = {"K": sp.csr_array(np.eye(2)), "A": sp.csc_array(A), "f": np.ones(2), "g": np.ones(2)}
    formats.FORMATS["op4"].write(tmp_path / "p.op4", data)
    found, _ = formats.read_labelled(tmp_path / "p.op4")["A"]
    np.testing.assert_array_equal(found, A)


def test_dmig_keeps_ten_digits(tmp_path: Path) -> None:
    """pyyeti sets how numpy prints when it is imported, and tables would lose their last digits."""
    wanted, read_back = there_and_back("dmig", tmp_path)
    assert str(np.float64(1 / 3)) == repr(1 / 3)
    np.testing.assert_allclose(read_back["K"], wanted["K"].toarray(), rtol=1e-9)
    np.testing.assert_array_equal(read_back["A"], wanted["A"].toarray())
    np.testing.assert_allclose(read_back["f"], wanted["f"], rtol=1e-9)
    np.testing.assert_allclose(read_back["g"], wanted["g"], rtol=1e-9)


def test_dmig_cards_by_their_columns(tmp_path: Path) -> None:
    """Large-field cards: after 8 columns a point, its component and the number, 16 columns
    each, ten digits; of the symmetric K one triangle."""
    data = matrices(*small())
    formats.FORMATS["dmig"].write(tmp_path / "p.pch", data)
    read_back: dict[str, dict[tuple[int, int], float]] = {}
    for line in (tmp_path / "p.pch").read_text().splitlines():
        if line.startswith("DMIG*"):
            name, column = line[8:24].strip(), int(line[24:40])
        elif line.startswith("*"):
            value = float(line[40:56].replace("D", "E"))
            read_back.setdefault(name, {})[int(line[8:24]) - 1, column - 1] = value
    wanted = {"K": sp.tril(data["K"]), "A": data["A"], "F": data["f"][:, None], "G": data["g"][:, None]}
    for name, matrix in wanted.items():
        dense = matrix.toarray() if sp.issparse(matrix) else matrix
        read = np.zeros(dense.shape)
        for at, value in read_back[name].items():
            read[at] = value
        np.testing.assert_array_equal(read, rounded(dense, 10))


def test_a_stiffness_that_nastran_calls_otherwise(tmp_path: Path) -> None:
    """KAAX of two grid points with the component 3, written by hand."""
    cards = [
        "DMIG    KAAX           0       6       2       0       0               3",
        "DMIG*   KAAX                         101               3",
        "*                    101               3 2.500000000D+00",
        "*                    207               3-1.250000000D-01",
        "DMIG*   KAAX                         207               3",
        "*                    207               3 4.000000000D+00",
    ]
    stiffness, others = tmp_path / "job.pch", [f"{name}={tmp_path / f'{name}.mtx'}" for name in "Afg"]
    stiffness.write_text("\n".join(cards) + "\n")
    K = np.array([[2.5, -0.125], [-0.125, 4.0]])
    rest = {"A": sp.csc_array([[1.0], [0.0]]), "f": np.ones(2), "g": np.ones(1)}
    formats.FORMATS["mtx"].write(tmp_path, {"K": sp.csr_array(K)} | rest)
    with pytest.raises(InputError, match="say K=FILE"):
        import_matrices([str(stiffness), *others], tmp_path / "out.npz")
    import_matrices([f"K={stiffness}", *others], tmp_path / "out.npz")
    np.testing.assert_array_equal(np.load(tmp_path / "out.npz")["K"], K)


@pytest.mark.parametrize("labels", [True, False])
def test_abaqus_text_with_labels_or_rows(labels: bool, tmp_path: Path) -> None:
    """Nodes 7, 12 and 100 with the degrees of freedom 3 and 1 3; of each pair one entry, in any triangle."""
    K = np.array([[4.0, 1.0, 0.0, -0.5], [1.0, 5.0, 0.25, 0.0], [0.0, 0.25, 6.0, 0.0], [-0.5, 0.0, 0.0, 7.0]])
    at = [(7, 3), (12, 1), (12, 3), (100, 3)]
    lines = ["** made by hand", "*MATRIX INPUT"]
    for i in range(4):
        for j in range(4):
            if K[i, j] and (i + j) % 2 == (i < j):
                where = [*at[i], *at[j]] if labels else [i + 1, j + 1]
                lines.append(", ".join(map(str, where)) + f", {K[i, j]:.17e}")
    (tmp_path / "K.mtx").write_text("\n".join(lines) + "\n")
    found, _ = formats.read_labelled(tmp_path / "K.mtx")["K"]
    np.testing.assert_array_equal(found.toarray(), K)


def test_bad_lines_of_abaqus_text_are_named(tmp_path: Path) -> None:
    for wrong in ("1,3,2,3,what", "2,3,2,3", "2,2,1.0", "1.5,3,2,3,1.0"):
        (tmp_path / "K.mtx").write_text(f"1,3,1,3,5.0\n\n{wrong}\n{wrong}\n")
        (fault,) = refusal_of(formats.read_labelled, tmp_path / "K.mtx").faults
        assert fault.key == "line 3"


def test_the_format_of_a_file_is_known_without_its_library() -> None:
    code = (
        "import sys, pathlib, problems.formats as f; f.format_of(pathlib.Path('k.op4')); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert not {"pandas", "pyyeti"} & set(done.stdout.split())


# --- import -------------------------------------------------------------------------------------------


def small(seed: int = 3) -> tuple[Prepared, LoadCase]:
    data = make_prepared(seed, 5, tools=2)
    return data, make_load(seed, data)[0]


def written(folder: Path, **changes: Any) -> list[str]:
    formats.FORMATS["mtx"].write(folder, matrices(*small()) | changes)
    return files_of("mtx", folder)


def test_a_name_picks_its_matrix_from_a_file_of_several(tmp_path: Path) -> None:
    one, two = matrices(*small(3)), matrices(*small(4))
    formats.FORMATS["npz"].write(tmp_path / "one.npz", one)
    formats.FORMATS["op4"].write(tmp_path / "two.op4", two)
    import_matrices([str(tmp_path / "one.npz"), f"f={tmp_path / 'two.op4'}"], tmp_path / "out.npz")
    found = np.load(tmp_path / "out.npz")
    np.testing.assert_array_equal(found["f"], two["f"])
    np.testing.assert_array_equal(found["K"], one["K"].toarray())
    others = [f"{name}={tmp_path / 'two.op4'}" for name in "Af"]
    with pytest.raises(InputError, match="g = None: is in none"):
        import_matrices([f"{tmp_path / 'one.npz'}:K", *others], tmp_path / "out.npz")
    with pytest.raises(InputError, match="matrix = 'Q': K, A, f, g or nodes"):
        import_matrices([f"{tmp_path / 'one.npz'}:Q"], tmp_path / "out.npz")
    np.savez(tmp_path / "none.npz", stiffness=np.eye(2), mass=np.eye(2))
    with pytest.raises(InputError, match="a matrix K, or one matrix alone"):
        import_matrices([f"K={tmp_path / 'none.npz'}"], tmp_path / "out.npz")


def test_what_is_missing_or_of_no_format_is_named(tmp_path: Path) -> None:
    files = written(tmp_path)
    (tmp_path / "x.txt").write_text("1 2 3")
    for given_files, said in (
        (files[:2], "is in none of the files"),
        ([str(tmp_path / "x.txt")], ".op4"),
        ([str(tmp_path / "none.mtx")], "no such file"),
    ):
        assert said in wrong_usage("import", *given_files, "--out", tmp_path / "out.npz")
    assert "abaqus" in wrong_usage("export", SCENE, "--format", "xls", "--out", tmp_path / "o")


def test_nastran_without_pyyeti_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyyeti", None)
    (tmp_path / "k.op4").write_bytes(b"x" * 100)
    with pytest.raises(InputError, match="pip install"):
        formats.read_labelled(tmp_path / "k.op4")
    with pytest.raises(InputError, match="pip install"):
        export(SCENE, tmp_path / "out.op4", format="op4")
    export(SCENE, tmp_path / "k.pch", format="dmig")


# --- digits -------------------------------------------------------------------------------------------


@given(st.integers(3, 14), st.integers(0, 1000))
@settings(deadline=None, max_examples=40)
def test_rounded_values_show_their_digits(digits: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=300) * 10.0 ** np.arange(-5, 5).repeat(30)
    assert apparent_digits(rounded(values, digits)) == digits


def test_unrounded_and_single_precision_values() -> None:
    values = np.random.default_rng(1).normal(size=300)
    assert apparent_digits(values) == 16
    assert apparent_digits(values.astype(np.float32).astype(float)) == 7
    for digits in (9, 10, 15):
        assert apparent_digits(rounded(values.astype(np.float32).astype(float), digits)) == 7
    assert apparent_digits(np.array([2.0, -1.0, 0.0])) == apparent_digits(np.eye(2)) == 16
    assert apparent_digits(np.array([123457e3, -4567.89])) == apparent_digits(np.array([123457e3])) == 6


def rounded(K: Any, digits: int) -> Any:
    return np.vectorize(lambda value: float(f"{value:.{digits - 1}e}"))(K)


def test_the_expected_error_is_that_of_rounding() -> None:
    """Against solving with the rounded matrix, some contacts closed: within a factor of five of the middle
    one of nine units of force, in each of which K is rounded differently."""
    scene = read_scene("gallery/sheet-over-former")
    data = prepared(scene)
    load = load_case(scene)
    x, lam = solve_by_nnls(data, load)
    assert 3 < (lam > 0).sum() < 150
    digits, errors = 9, []
    for unit in 1.17 ** np.arange(9):
        coarse = Prepared(
            Assembly(
                Stiffness.of(rounded(data.assembly.K.matrices[0] * unit, digits) / unit), data.assembly.A
            )
        )
        errors.append(abs(solve_by_nnls(coarse, load)[0] - x).max())
    expected = expected_error(data, x, lam, digits)
    assert np.median(errors) / 5 < expected < 5 * np.median(errors)


@pytest.mark.usefixtures("without_pictures")
def test_too_few_digits_are_warned_of_with_the_error(tmp_path: Path) -> None:
    scene = read_scene("gallery/sheet-over-former")
    data = matrices(prepared(scene), load_case(scene))
    K = data["K"].toarray()
    data["K"] = sp.csr_array(rounded(K, 7))
    formats.FORMATS["npz"].write(tmp_path / "seven.npz", data)
    shown, solved = StringIO(), StringIO()
    import_matrices([str(tmp_path / "seven.npz")], tmp_path / "out.npz", reporter=onto(shown))
    solve_into(str(tmp_path / "seven.npz"), None, 1e-9, tmp_path / "answer", Console(file=solved, width=200))
    for said in (shown.getvalue(), solved.getvalue(), (tmp_path / "answer" / "answer.md").read_text()):
        assert "seem to have 7 digits" in said
        assert "more than 1e-07 mm: export it with more digits" in said
    formats.FORMATS["npz"].write(tmp_path / "all.npz", data | {"K": sp.csr_array(K)})
    shown = StringIO()
    import_matrices([str(tmp_path / "all.npz")], tmp_path / "out2.npz", reporter=onto(shown))
    assert "all digits of double precision" in shown.getvalue()


@pytest.mark.usefixtures("without_pictures")
def test_digits_of_many_separate_unknowns_take_no_reference_and_no_dense_matrix(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """K = diag(k) of three digits, A first differences: |δx| ≤ 5e-3 |x|."""
    n = 4000
    k, f = np.round(np.random.default_rng(0).uniform(1.0, 2.0, n), 2), np.sin(np.arange(n) / 300)
    A = sp.eye_array(n, n - 1) - sp.eye_array(n, n - 1, k=-1)
    data = {"K": sp.csr_array(sp.diags_array(k)), "A": sp.csr_array(A), "f": f, "g": np.full(n - 1, 0.1)}
    formats.FORMATS["npz"].write(tmp_path / "mine.npz", data)
    monkeypatch.setattr(Stiffness, "compliance", None)
    solved, shown = StringIO(), StringIO()
    solve_into(str(tmp_path / "mine.npz"), None, 1e-9, tmp_path / "answer", Console(file=solved, width=200))
    monkeypatch.setattr(ReferenceProblem, "reference", None)
    import_matrices([str(tmp_path / "mine.npz")], tmp_path / "out.npz", reporter=onto(shown))
    for said in (solved.getvalue(), shown.getvalue()):
        (error,) = re.findall("seem to have 3 digits.* off by about (.*) mm, more", said)
        assert 1e-3 < float(error) < 1e-2


def test_an_op4_that_ends_early_has_whole_matrices_or_is_refused(tmp_path: Path) -> None:
    """Within a matrix pyyeti warns or raises what it likes."""
    data = make_prepared(3, 3, tools=1)
    path = tmp_path / "p.op4"
    formats.FORMATS["op4"].write(path, matrices(data, make_load(3, data)[0]))
    whole, wanted = path.read_bytes(), formats.read_labelled(path)
    refused = 0
    for length in range(0, len(whole), 3):
        path.write_bytes(whole[:length])
        try:
            read_back = formats.read_labelled(path)
        except InputError:
            refused += 1
        else:
            for name, (values, _) in read_back.items():
                np.testing.assert_array_equal(values, wanted[name][0])
    assert refused > 0.99 * len(whole) / 3
