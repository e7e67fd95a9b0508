"""A sparse K, a user's own or a scene's, from its files to the answer: nothing dense, few arrays however many
bodies there are, and one message for what is wrong.
"""

import os
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from commands import harness
from scipy.sparse.linalg import spsolve
from small_joints import two_parts
from sparse_matrices import band_matrix, chain, renumbered

from harness import LoadCase, judge, load_scene, own_matrices, solve, solve_series
from harness.planning import form_choice
from problems import formats, storage
from problems.build import load_case, prepared
from problems.formats.nastran import pyyeti
from problems.forms import FORMS
from problems.forms.assembly import Vector
from problems.forms.prepared import Prepared
from problems.input import matrix_files
from problems.input.user_matrices import read_matrices
from problems.model.joint_model import JointModel
from problems.scene_files import read_scene
from problems.stiffness.dense_block import DenseBlock

N, M = 3000, 400
HELD_CHAIN = sp.csc_array(chain(N) + 2 * sp.eye_array(N))
NODES = (200, 8)
SCENE = f"""
{two_parts(3000.0, 105.0, NODES, "south")}
[[effect]]
kind = "initial_gap"
mean = 0.3
random = {{ sd = 0.1, correlation_length = 200.0, seed = 7 }}
[[effect]]
kind = "pressure"
part = "a"
value = 0.02
[[effect]]
kind = "self_weight"
part = "b"
"""


def dense(*_: Any) -> None:
    raise AssertionError("a dense matrix was asked for")


@pytest.fixture(autouse=True)
def _nothing_dense(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(DenseBlock, "U", property(dense))
    monkeypatch.setattr(Prepared, "Q", property(dense))
    monkeypatch.setattr(JointModel, "dense", dense)  # condensation
    monkeypatch.setattr(form_choice, "physical_memory_mib", lambda: 200)  # holds the sparse form alone


def files(folder: Path, K: sp.csc_array | None = None, scipy_npz: bool = False) -> list[str]:
    """Two bodies in one K, their unknowns interleaved at random, contacts between them, as files."""
    random = np.random.default_rng(3)
    order = random.permutation(N)
    if K is None:
        K = sp.csc_array(sp.block_diag([band_matrix(random, N // 2, 4)] * 2))
    unit = sp.eye_array(N, format="csc")
    A = sp.csc_array(unit[:, :M] - unit[:, N // 2 : N // 2 + M])
    f, g = random.normal(0, 1, N), random.uniform(-0.1, 0.3, M)
    K, A = renumbered(K, order), sp.csc_array(A[order])
    if scipy_npz:
        sp.save_npz(folder / "K.npz", sp.csc_matrix(K))
        sp.save_npz(folder / "A.npz", sp.csr_matrix(A))
    else:
        scipy.io.mmwrite(folder / "K.mtx", K, symmetry="symmetric", precision=17)
        scipy.io.mmwrite(folder / "A.mtx", A, precision=17)
    for name, vector in (("f", f), ("g", g)):
        scipy.io.mmwrite(folder / f"{name}.mtx", vector[:, None], precision=17)
    suffix = "npz" if scipy_npz else "mtx"
    return [str(folder / f"{name}.{suffix if name in 'KA' else 'mtx'}") for name in "KAfg"]


def run(*words: str) -> tuple[int, str]:
    done = harness(*words)
    return done.exit_code, " ".join(done.output.split())


def answer(folder: Path) -> Vector:
    return np.asarray(np.load(folder / "solution.npz")["x"])


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_import_validate_and_solve_make_nothing_dense(tmp_path: Path) -> None:
    """Of Matrix Market files, and of SciPy's, which give the same."""
    out, read = tmp_path / "mine.npz", []
    for scipy_npz in (False, True):
        code, said = run("import", *files(tmp_path, scipy_npz=scipy_npz), "--out", str(out))
        assert (code, "positive definite, cond(K) = about" in said) == (0, True), said
        assert out.stat().st_size < 8 * N**2 / 20
        read.append(read_matrices({"problem": out}))
    (one, load), (other, other_load) = read
    assert (one.K.matrix != other.K.matrix).nnz == (one.A != other.A).nnz == 0
    np.testing.assert_array_equal(np.append(load.f, load.g), np.append(other_load.f, other_load.g))
    code, said = run("validate", str(out))
    assert (code, "Sparse form by default" in said) == (0, True), said
    code, said = run("solve", str(out), "--out", str(tmp_path / "answer"))
    assert (code, "proven" in said) == (0, True), said
    # The optimality conditions in the user's numbering, by another factorisation.
    scene = read_scene(str(out))
    data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
    K, A = data.assembly.K.matrices[0], data.assembly.A
    gaps = np.random.default_rng(1).uniform(-0.1, 0.3, (2, M))
    np.save(tmp_path / "gaps.npy", gaps)
    series = ("series", str(out), "--gaps", str(tmp_path / "gaps.npy"), "--out", str(tmp_path / "series"))
    code, said = run(*series)
    assert (code, "2 within" in said) == (0, True), said
    x, lam = answer(tmp_path / "answer"), np.load(tmp_path / "answer" / "solution.npz")["lam"]
    np.testing.assert_allclose(x, spsolve(K, load.f - A @ lam), atol=1e-11)
    gap = load.g - A.T @ x
    assert lam.min() >= 0
    assert gap.min() >= -1e-11
    assert 0 < np.count_nonzero(lam) < M
    assert abs(lam * gap).max() < 1e-10


@pytest.mark.slow
def test_of_a_scene_no_matrix_of_order_m_or_n_is_made(tmp_path: Path) -> None:
    """All arrays are smaller than two of order m, or one of order n."""
    path, nodes = tmp_path / "strip.toml", NODES[0] * NODES[1]
    path.write_text(SCENE)
    tracemalloc.start()
    try:
        solution = solve(load_scene(str(path)), form="sparse")  # newton, and its proof
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert solution.method.startswith("newton")
    assert solution.judgement.verdict == "within"
    assert (len(solution.x), len(solution.lam)) == (2 * nodes, nodes)
    assert solution.error_bound_mm <= 1e-9
    assert 100 < (solution.lam > 0).sum() < nodes
    assert peak < 2 * 8 * nodes**2


def test_ten_thousand_bodies_take_a_fixed_number_of_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As LISWET1 of Maros and Mészáros: K = I, and rows of second differences."""
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))
    n = 10_002
    A = -sp.diags_array([1.0, -2.0, 1.0], offsets=[0, -1, -2], shape=(n, n - 2), format="csc")
    f = np.sqrt(np.linspace(0, 1, n))
    given = {"K": sp.eye_array(n, format="csc"), "A": A, "f": f, "g": np.zeros(n - 2)}
    matrix_files.write(tmp_path / "liswet.npz", given)
    scene = read_scene(str(tmp_path / "liswet.npz"))
    assert form_choice.chosen_form(scene, FORMS, None).form == "sparse"
    data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
    assert len(data.assembly.K.blocks) == 1
    assert data.assembly.K.factor_nonzeros == n  # half-bandwidth 0
    np.testing.assert_array_equal(data.recover(np.zeros(n - 2), load), f)
    assert max(len(names) for _, _, names in os.walk(storage.root())) < 16


def test_tens_of_thousands_of_separate_unknowns_are_solved() -> None:
    """Half of them against stops at 1 mm: x = min(f, 1) there."""
    n, m = 40_000, 20_000
    f = np.linspace(0, 3, n)
    K, A = (sp.eye_array(n, columns, format="csc") for columns in (n, m))
    found = solve(own_matrices(K, A, f, np.ones(m)))
    assert found.judgement.verdict == "within"
    exact = np.where(np.arange(n) < m, np.minimum(f, 1), f)
    assert abs(found.x - exact).max() <= found.error_bound_mm <= 1e-12


def test_a_series_and_a_judgement_of_an_own_sparse_K_make_nothing_dense() -> None:
    A, f, g = sp.eye_array(N, M, format="csc"), np.linspace(9.0, 0.0, N), np.ones(M)
    scene = own_matrices(HELD_CHAIN, A, f, g)
    x = solve(scene).x
    (result,) = solve_series(scene, [LoadCase(f, g)])
    assert result.row["verdict"] == "within"
    np.testing.assert_allclose(result.gap, g - A.T @ x, atol=1e-6)
    assert judge(scene, x).verdict == "within"


def test_a_nearly_singular_sparse_K_is_refused_with_its_condition(tmp_path: Path) -> None:
    K = sp.csc_array(chain(N) + 1e-15 * sp.eye_array(N))
    code, said = run("import", *files(tmp_path, K), "--out", str(tmp_path / "mine.npz"))
    assert code == 2
    assert "K.mtx" in said
    assert "is a part held against every rigid motion?" in said
    assert not (tmp_path / "mine.npz").exists()


def test_sparse_matrices_of_op4_files_stay_sparse(tmp_path: Path) -> None:
    """Of a file that is written here, and of one of pyyeti's, in which f is sparse, too."""
    ours, theirs, f = tmp_path / "ours.op4", tmp_path / "theirs.op4", np.arange(float(N))
    data = {"K": HELD_CHAIN, "A": sp.eye_array(N, M, format="csc"), "f": f, "g": np.ones(M)}
    formats.FORMATS["op4"].write(ours, data)
    sparse = {"k": data["K"], "a": data["A"], "f": f[:, None]}
    written = {name: sp.csc_matrix(matrix) for name, matrix in sparse.items()}
    pyyeti(theirs).op4.OP4().write(str(theirs), written, binary=True, sparse="bigmat")
    for path in (ours, theirs):
        found = {name: matrix for name, (matrix, _) in formats.read_labelled(path).items()}
        for name in "KA":
            assert sp.issparse(found[name])
            assert abs(sp.csr_array(found[name]) - data[name]).max() == 0
        np.testing.assert_array_equal(formats.vector(found["f"]), f)
