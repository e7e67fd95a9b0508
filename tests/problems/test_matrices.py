"""A user's own K, A, f, g: both formats, the blocks found in K, and what is said of bad ones."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp
from matrix_files import DATA, K1, write_mtx
from refusals import refusal_of

from harness.api import own_matrices, solve
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.input import user_matrices
from problems.input.matrix_files import read_mtx
from problems.input.user_matrices import checked, read_matrices
from problems.scene_files import read_scene


def opened(path: Path) -> tuple[Prepared, LoadCase]:
    scene = read_scene(str(path))
    made = prepared(scene)
    assert made.Q.shape == (made.assembly.m,) * 2
    return made, load_case(scene)


def write_npz(folder: Path, **changes: Any) -> Path:
    path = folder / "mine.npz"
    np.savez(path, **{key: value for key, value in (DATA | changes).items() if value is not None})
    return path


def test_a_file_that_is_replaced_while_it_is_read_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The matrices of one file would be kept under the hash of the other."""

    def read_slowly(*arguments: Any) -> Any:
        write_npz(tmp_path, f=2 * DATA["f"])
        return read_matrices(*arguments)

    scene = read_scene(str(write_npz(tmp_path)))
    monkeypatch.setattr(user_matrices, "read_matrices", read_slowly)
    with pytest.raises(InputError, match="the file that it was when the scene was read"):
        prepared(scene)


def check_data(made: Prepared, load: LoadCase) -> None:
    assert [block.shape for block in made.assembly.K.matrices] == [(8, 8)]
    np.testing.assert_allclose(sla.block_diag(*made.assembly.K.matrices), DATA["K"], rtol=1e-15)
    np.testing.assert_array_equal(made.assembly.A.toarray(), DATA["A"])
    np.testing.assert_array_equal(load.f, DATA["f"])
    np.testing.assert_array_equal(load.g, DATA["g"])
    np.testing.assert_allclose(made.Q, DATA["A"].T @ np.linalg.solve(DATA["K"], DATA["A"]), rtol=1e-12)
    values = np.linalg.eigvalsh(DATA["K"])
    assert made.facts["cond_K"] == pytest.approx(values[-1] / values[0], rel=1e-6)


def test_npz(tmp_path: Path) -> None:
    made, load = opened(write_npz(tmp_path))
    check_data(made, load)
    assert made.assembly.nodes is None


@pytest.mark.parametrize("sparse", [(), ("K", "A", "f")])
def test_matrix_market(tmp_path: Path, sparse: tuple[str, ...]) -> None:
    given = {key: sp.coo_array(DATA[key].reshape(8, -1)) for key in sparse}
    check_data(*opened(write_mtx(tmp_path, **given)))


def test_a_named_npz_in_a_scene(tmp_path: Path) -> None:
    write_npz(tmp_path)
    path = tmp_path / "mine.toml"
    path.write_text('title = "my own"\n[matrices]\nproblem = "mine.npz"\n')
    check_data(*opened(path))
    assert read_scene(str(path)).title == "my own"


@pytest.mark.parametrize(
    ("bodies", "blocks"),
    [
        ([1, 4, 3], [8]),  # small bodies share a block
        ([300, 212, 1, 500], [512, 501]),
        ([1] * 1100, [512, 512, 76]),
        ([100, 700, 100, 600], [100, 700, 700]),  # no larger than the largest body
    ],
)
def test_blocks_of_different_sizes(bodies: list[int], blocks: list[int]) -> None:
    K = sp.csr_array(sp.block_diag([np.ones((size, size)) + np.eye(size) for size in bodies]))
    n = K.shape[0]
    data = {"K": K, "A": sp.eye_array(n, 1), "f": np.zeros(n), "g": np.zeros(1)}
    where = dict.fromkeys("KAfg", "mine")
    made, _ = checked(data, where)
    assert [len(block) for block in made.K.matrices] == blocks
    assert len(made.parts) == len(blocks)
    assert (sp.block_diag(made.K.matrices) != K).nnz == 0
    (whole,) = checked(data, where, sparse=True)[0].K.matrices
    assert (whole != K).nnz == 0


@pytest.mark.parametrize("key", ["K", "A", "f", "g"])
def test_a_changed_entry_makes_another_problem(tmp_path: Path, key: str) -> None:
    before = read_scene(str(write_npz(tmp_path))).key
    changed = DATA[key].copy()
    changed.flat[0] *= 1.5
    assert read_scene(str(write_npz(tmp_path, **{key: changed}))).key != before


def changed(key: str, index: Any, value: float) -> dict[str, Any]:
    array = DATA[key].copy()
    array[index] = value
    return {key: array}


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "NaN in K": (changed("K", (2, 2), np.nan), "K[2, 2] = 'NaN or infinity'"),
    "infinity in g": (changed("g", 1, np.inf), "g[1] = 'NaN or infinity'"),
    "asymmetric": (changed("K", (0, 1), 9.0), "K[0, 1] and K[1, 0] = [9.0, "),
    "indefinite": (changed("K", (5, 5), -1.0), "the pivot of unknown 5"),
    "negative": ({"K": -DATA["K"]}, "K of part 1"),
    "singular": ({"K": sla.block_diag(K1, np.ones((4, 4)))}, "positive definite"),
    "ill-conditioned": ({"K": np.eye(8) + 5e13}, "cond(K), in balanced units = "),
    "K of one dimension": ({"K": np.ones(8)}, "K = 'float64 array of shape (8,)'"),
    "A too short": ({"A": DATA["A"][:5]}, "A.shape = (5, 4): must be (8, 4)"),
    "f too short": ({"f": np.ones(7)}, "f.shape = (7,): must be (8,)"),
    "nodes": ({"nodes": np.ones((4, 2))}, "nodes.shape = (4, 2): must be (8, 2)"),
    "complex": ({"K": DATA["K"] * (1 + 0j)}, "complex128"),
    "text": ({"f": np.array(["a"] * 8)}, "f = '<U1 array"),
    "objects": ({"f": np.array([None] * 8)}, "Object arrays"),
    "missing g": ({"g": None}, "g = None: is missing"),
    "a contact of nothing": (changed("A", (slice(None), 2), 0.0), "A[:, 2]"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_arrays_are_named_with_their_file(tmp_path: Path, case: str) -> None:
    changes, said = BAD[case]
    path = write_npz(tmp_path, **changes)
    error = refusal_of(opened, path)
    assert [fault.where for fault in error.faults] == [str(path)]
    assert said in str(error)


def test_several_wrong_shapes_at_once(tmp_path: Path) -> None:
    path = write_npz(tmp_path, K=DATA["K"][:, :5], f=np.ones(3), g=changed("g", 0, np.nan)["g"])
    assert [fault.key for fault in refusal_of(opened, path).faults] == ["K.shape", "f.shape", "g[0]"]


@pytest.mark.parametrize("key", ["K", "A", "f", "g"])
@pytest.mark.parametrize("form", ["dense", "sparse"])
def test_truncated_matrix_market(tmp_path: Path, key: str, form: str) -> None:
    """A line less than there should be, also where mmread would take it for zeros."""
    value = DATA[key].reshape(len(DATA[key]), -1)
    path = write_mtx(tmp_path, **{key: sp.coo_array(value) if form == "sparse" else value})
    file = tmp_path / f"{key}.mtx"
    file.write_text("\n".join(file.read_text().strip().splitlines()[:-1]))
    assert [(fault.where, fault.key) for fault in refusal_of(opened, path).faults] == [(str(file), key)]


@pytest.mark.parametrize("form", ["dense", "sparse"])
@pytest.mark.parametrize("entry", ["3k", "3,5", "3D5", "0x3", "1_0", "1e", "3 4", "3\0"])
def test_an_entry_that_mmread_would_misread_is_named(tmp_path: Path, form: str, entry: str) -> None:
    """It reads 3,5 and 3D5 as 3, and crashes on a NUL."""
    value = DATA["f"][:, None]
    path = write_mtx(tmp_path, f=sp.coo_array(value) if form == "sparse" else value)
    file = tmp_path / "f.mtx"
    lines = file.read_text().strip().splitlines()
    lines[-1] = " ".join([*lines[-1].split()[:-1], entry])
    file.write_text("\n".join(lines) + "\n", newline="")
    with pytest.raises(InputError, match=f"f.mtx.*line {len(lines)}"):
        opened(path)


def test_a_symmetric_matrix_market_file_must_be_square(tmp_path: Path) -> None:
    """mmread would write beyond the end of its array."""
    path = write_mtx(tmp_path)
    numbers = "\n".join("12345")
    (tmp_path / "A.mtx").write_text(f"%%MatrixMarket matrix array real symmetric\n2 3\n{numbers}\n")
    with pytest.raises(InputError, match="not square"):
        opened(path)


@pytest.mark.parametrize("lines", [f"2 {10**30} 1\n1 1 1.0", f"2 2 1\n{10**30} 1 1.0"])
def test_a_number_of_a_matrix_market_file_out_of_range(tmp_path: Path, lines: str) -> None:
    """SciPy's reader raises OverflowError for some."""
    path = tmp_path / "K.mtx"
    path.write_text(f"%%MatrixMarket matrix coordinate real general\n{lines}\n")
    with pytest.raises(ValueError, match="out of range"):
        read_mtx(path)


@pytest.mark.parametrize("form", ["dual", "primal", "sparse"])
def test_a_stiff_spring_beside_a_soft_one_is_no_part_that_moves(form: Form) -> None:
    """cond(K) = 1e15 is one of the units: balanced, it is 1. x₁ = g, x₂ = f₂/k₂."""
    scene = own_matrices(np.diag([1.0, 1e15]), np.eye(2), [2.0, 1.0], [1.0, 1.0])
    np.testing.assert_allclose(solve(scene, form=form).x, [1.0, 1e-15], rtol=1e-14)


def test_a_contact_is_at_its_entries_not_at_its_zeros() -> None:
    """A lists a zero at the first unknown, and the entry of the second in two parts."""
    A = sp.csc_array(([0.0, 0.25, 0.75], [0, 1, 1], [0, 3]), shape=(2, 1))
    scene = own_matrices(np.eye(2), A, [0.0, 1.0], [0.2], nodes=[[0.0, 0.0], [5.0, 0.0]])
    assembly = prepared(scene).assembly
    np.testing.assert_array_equal(assembly.A.data, [1.0])
    np.testing.assert_array_equal(assembly.contact_nodes, [[5.0, 0.0]])


def test_sparse_loads_and_gaps_are_vectors() -> None:
    f, g = sp.csc_array(np.array([[2.0], [0.0]])), sp.coo_array(np.ones((2, 1)))
    np.testing.assert_allclose(solve(own_matrices(np.eye(2), np.eye(2), f, g)).x, [1.0, 0.0], atol=1e-15)


def test_rows_of_several_lengths_are_no_matrix() -> None:
    with pytest.raises(InputError, match=r"K = \[\[1.0, 0.0\], \[0.0\]\]: rows of one length"):
        own_matrices([[1.0, 0.0], [0.0]], np.eye(2), np.ones(2), np.ones(2))


def test_a_contact_in_a_row_of_A_is_asked_for_as_a_column() -> None:
    with pytest.raises(InputError) as caught:
        own_matrices(np.eye(2), [[1.0, 0.0]], np.ones(2), np.ones(1))
    assert [str(fault) for fault in caught.value.faults] == ["own matrices: A.shape = (1, 2): must be (2, 1)"]


def test_own_sparse_matrices_that_are_nearly_singular_are_refused_as_a_file_is() -> None:
    """A chain of 2001 masses that a spring of 1e-12 N/mm holds to the ground."""
    n = 2001
    D = sp.diags_array([1.0, -1.0], offsets=[0, 1], shape=(n - 1, n))
    K = sp.csc_array(D.T @ D + sp.csc_array(([1e-12], ([0], [0])), shape=(n, n)))
    A = sp.csc_array(([1.0], ([0], [0])), shape=(n, 1))
    with pytest.raises(InputError, match=r"cond\(K\), in balanced units"):
        solve(own_matrices(K, A, np.zeros(n), [-1.0]), form="sparse")
