"""Files of other codes, in all spellings of one K: the same K, or one sentence that names the place."""

import gzip
import struct
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
import scipy.sparse as sp
from commands import onto

from harness.scene.export import export
from harness.scene.import_files import import_matrices
from problems import formats
from problems.errors import InputError
from problems.formats.nastran import pyyeti
from problems.input.user_matrices import checked, holds_sparse, read_matrices

K = np.array([[4.0, -1.0], [-1.0, 3.0]])
LOWER, UPPER = [(1, 1, 4.0), (2, 1, -1.0), (2, 2, 3.0)], [(1, 1, 4.0), (1, 2, -1.0), (2, 2, 3.0)]
BOTH = [*LOWER, (1, 2, -1.0)]
NAMES = {"mtx": "K.mtx", "dmig": "KAA.pch", "abaqus": "K.mtx", "npz": "K.npz", "op4": "KAA.op4"}


def text(form: str, entries: list[tuple[int, int, float]], symmetric: bool = True) -> bytes:
    """The entries of a 2 × 2 matrix as a file; an .npz is always general, and Abaqus' text says nothing."""
    if form == "npz":
        i, j, values = zip(*entries, strict=True)
        sp.save_npz(file := BytesIO(), sp.coo_matrix((values, (np.array(i) - 1, np.array(j) - 1))))
        return file.getvalue()
    if form == "op4":
        M, forms = np.zeros((2, 2)), [6 if symmetric else 1]
        for i, j, value in entries:
            M[i - 1, j - 1] = value
        pyyeti(Path()).op4.OP4().write("made.op4", ["kaa"], [M], binary=False, forms=forms)
        return Path("made.op4").read_bytes()
    header, entry = {
        "mtx": ("%%MatrixMarket matrix coordinate real {}\n% made\n2 2 {}\n", "{} {} {}\n"),
        "dmig": ("$ made\nDMIG,KAA,0,{},2,0\n", "DMIG,KAA,{1},0,,{0},,{2}\n"),
        "abaqus": ("** made\n", "{},3,{},3,{}\n"),
    }[form]
    said = {"mtx": ("general", "symmetric"), "dmig": (1, 6)}.get(form, ("", ""))[symmetric]
    return (header.format(said, len(entries)) + "".join(entry.format(*each) for each in entries)).encode()


def read(content: bytes, name: str, matrix: str | None = None) -> Any:
    Path(name).write_bytes(content)
    M, *_ = formats.read_stiffness(Path(name), matrix)
    data = {"K": M, "A": sp.csc_array((2, 0)), "f": np.zeros(2), "g": np.zeros(0)}
    return checked(data, {"K": name}, sparse=True)[0].K.matrix.toarray()


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("form", NAMES)
def test_both_triangles_one_or_contradictory_ones(form: str, symmetric: bool) -> None:
    np.testing.assert_array_equal(read(text(form, BOTH, symmetric), NAMES[form]), K)
    for entries in (LOWER, UPPER):
        if form == "abaqus" or (symmetric and form != "npz"):
            np.testing.assert_array_equal(read(text(form, entries), NAMES[form]), K)
        else:
            with pytest.raises(InputError, match=r"\[-?[01].0, -?[01].0\]: K must be symm.* only a triangle"):
                read(text(form, entries, symmetric), NAMES[form])
    stiff = [(i, j, 1e12 if i == j == 1 else value) for i, j, value in LOWER]
    with pytest.raises(InputError, match=r"and .* = \[-.*\]: (K )?must be (equal|symmetric)"):
        read(text(form, [*stiff, (1, 2, -2.0)], symmetric), NAMES[form])


@pytest.mark.parametrize("form", ["mtx", "dmig", "abaqus", "npz"])
def test_zeros_that_are_listed_are_read_and_stay_in_the_callers_matrix(form: str) -> None:
    zeros = [(1, 1, 4.0), (1, 2, 0.0), (2, 1, 0.0), (2, 2, 3.0)]
    np.testing.assert_array_equal(read(text(form, zeros, symmetric=False), NAMES[form]), np.diag([4.0, 3.0]))
    M, *_ = formats.read_stiffness(Path(NAMES[form]))
    checked({"K": M, "A": sp.csc_array((2, 0)), "f": np.zeros(2), "g": np.zeros(0)}, {})
    np.testing.assert_array_equal(sp.coo_array(M).toarray(), np.diag([4.0, 3.0]))


def test_a_plus_is_a_sign() -> None:
    signed = [(i, j, f"{value:+e}") for i, j, value in BOTH]
    np.testing.assert_array_equal(read(text("mtx", signed, symmetric=False), "K.mtx"), K)  # type: ignore[arg-type]


@pytest.mark.parametrize("form", ["mtx", "dmig", "abaqus", "npz"])
def test_an_entry_that_is_listed_twice_is_refused_with_its_place(form: str) -> None:
    for again in (3.0, 1.0):
        with pytest.raises(InputError, match=r"(line [456].* and .*line [678]|\[1, 1\] and).*listed once"):
            read(text(form, [*BOTH, (2, 2, again)], symmetric=False), NAMES[form])


@pytest.mark.parametrize("form", ["mtx", "dmig", "abaqus", "op4"])
def test_text_of_any_program(form: str) -> None:
    plain, name = text(form, LOWER), NAMES[form]
    comment = plain.replace(b"made", b"pr\xfcft, von Hand")
    ways = [b"\xef\xbb\xbf" + plain, plain.replace(b"\n", b"\r\n"), plain.replace(b"\n", b"\r"), comment]
    ways.append(plain.replace(b"MatrixMarket matrix", b"MATRIXMARKET Matrix").replace(b"KAA,", b"K-A,"))
    for content in ways:
        np.testing.assert_array_equal(read(content, name), K)
    np.testing.assert_array_equal(read(gzip.compress(plain), f"{name}.gz"), K)
    with pytest.raises(InputError, match="UTF-16"):
        read(plain.decode().encode("utf-16"), name)
    if form in ("dmig", "op4"):
        tiny = plain.replace(b"-1.0000000000000000E+00", b"-1.0000000000000000-101")
        assert read(tiny.replace(b",-1.0", b",-1.0-101"), name)[0, 1] == -1e-101


@pytest.mark.parametrize(
    ("content", "name", "said"),
    [
        (b"*USER ELEMENT, NODES=2\n1,2\n*MATRIX, TYPE=STIFFNESS\n4,1\n", "K.mtx", "line 1 .*MATRIX OUTPUT"),
        (b"*Matrix input, name=K, scale factor=3\n1,3,1,3,4.0\n", "K.mtx", "line 1 .*=3.: is not applied"),
        (b"1,3,1,3,4.0\n2,3,2,3,1.e36\n", "K.mtx", "node 2, dof 3.*a degree of freedom that is held"),
        (b"-1,3,-1,3,4.0\n1,3,1,3,3.0\n", "K.mtx", "= -1: 1 or more"),
        (b"1,1,4.0\n4,4,3.0\n", "K.mtx", "row 2"),
        (b"2000000001,2000000001,4.0\n", "K.mtx", "row 1"),
        (
            b"DMIG,K,0,6,2,0\nDMIG,K,1,0,,1,0,4.,,2,0,-1.\nDMIG,K,2,0,,2,0,3.\n",
            "K.pch",
            "line 2 .* at most 8 ",
        ),
        (b"DMIG,K,0,9,2,0\nDMIG,K,99999999,0,,1,0,1.0\n", "K.pch", "K, column 1 = None: .* 1 … 99999999"),
        (
            b"%%MatrixMarket matrix coordinate integer general\n1 1 1\n1 1 4.0\n",
            "K.mtx",
            "whole numbers, none",
        ),
        (b"DMIG,K,0,6,2,0\nDMIG,K,1,,,1,,4,\n,2,,-1\n", "K.pch", "point 2, component 0.*cut off"),
        (b"DMIG,K,0,6,2,0\nDMIG,K,1,,,1,,4,0\n", "K.pch", "line 2 = '0'"),
        (b"DMIG,K,0,6,2,0\nINCLUDE 'f.pch'\n", "K.pch", "line 2 = .INCLUDE .*not followed"),
        (b"DMIG,K,0,6,2,0\n  include 'f.pch'\n", "K.pch", "line 2 = .*include .*not followed"),
        (b"PARAM,CK2,1e3\nDMIG,K,0,6,2,0\nDMIG,K,1,,,1,,4.\n", "K.pch", "line 1 = .PARAM,CK2.*not applied"),
        (b"DMIG,K,0,6,2,0\nDMIG,K,1,,,1,,4.\n 2,2,,-1.\n", "K.pch", "line 3 = . 2,2,,-1..: a continuation"),
        (text("mtx", [(1, 1, 4.0), (2, 1, np.nan)]), "K.mtx", r"K\[\d, \d\] = .NaN or infinity"),
        (text("dmig", LOWER) * 2, "K.pch", "line 7, a header of = 'KAA': also in line 2"),
        (b"%%MatrixMarket matrix array real skew-symmetric\n2 2\n1.0\n", "K.mtx", r"= \[-1.0, 1.0\]: K must"),
        (b"%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n", "K.mtx", "pattern entries"),
        (b"hello", "K.op4", "= 'damaged, or of another format'"),
    ],
)
def test_what_is_no_stiffness_is_refused_in_one_sentence(content: bytes, name: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read(content, name)


@pytest.mark.parametrize("form", ["dmig", "npz", "op4", "op4 text"])
def test_one_matrix_of_several_is_chosen_by_name(form: str) -> None:
    """KAA, and MAA = 2 KAA."""
    made = Path("made")
    if form == "dmig":
        twice = [(i, j, 2 * value) for i, j, value in LOWER]
        made.write_bytes(text(form, LOWER) + text(form, twice).replace(b"KAA", b"MAA"))
    elif form == "npz":
        with made.open("wb") as file:
            np.savez(file, KAA=K, MAA=2 * K, title="job")
    else:
        pyyeti(made).op4.OP4().write(str(made), ["KAA", "MAA"], [K, 2 * K], binary=form == "op4")
    content, name = made.read_bytes(), NAMES[form.split()[0]]
    np.testing.assert_array_equal(read(content, name, "KAA"), K)
    np.testing.assert_array_equal(read(content, name, "maa"), 2 * K)
    formats.FORMATS["mtx"].write(Path("."), {"A": np.eye(2, 1), "f": np.ones(2), "g": np.ones(1)})
    import_matrices([f"K={name}:MAA", "A.mtx", "f.mtx", "g.mtx"], Path("out.npz"))
    np.testing.assert_array_equal(np.load("out.npz")["K"], 2 * K)
    with pytest.raises(InputError, match=r"\['KAA', 'MAA'\].*matrix = \"NAME\" in a part, K=FILE:NAME"):
        read(content, name)
    if form.startswith("op4"):
        with pytest.raises(InputError, match="matrix 2 of 2 = 'KAA'"):
            read(content.replace(b"MAA", b"kaa"), name)


def test_an_indented_card_does_not_continue_the_one_above() -> None:
    np.testing.assert_array_equal(read(text("dmig", LOWER) + b" SPC1,1,,1.0\n", "KAA.pch"), K)


def test_an_op4_file_of_one_matrix_with_nan_has_no_other_one_of_its_name() -> None:
    pyyeti(Path()).op4.OP4().write("KAA.op4", ["kaa"], [np.diag([4.0, np.nan])], forms=[1])
    with pytest.raises(InputError, match=r"K\[1, 1\] = .NaN or infinity"):
        read(Path("KAA.op4").read_bytes(), "KAA.op4")


def test_a_name_in_an_op4_file_of_64_bits_has_no_blanks() -> None:
    """Nastran puts four letters into a word of eight bytes."""
    content = struct.pack("<i4q16si", 48, 2, 2, 6, 2, b"STIF    FNES    ", 48)
    for j, column in enumerate(K.T.tolist(), start=1):
        content += struct.pack("<i3q2di", 40, j, 1, 2, *column, 40)
    content += struct.pack("<i3qdi", 32, 3, 1, 1, 1.0, 32)
    np.testing.assert_array_equal(read(content, "KAA.op4", "STIFFNES"), K)


def test_signs_in_paths_are_no_names() -> None:
    Path("run=3").mkdir()
    data = {"K": sp.csr_array(K), "A": np.eye(2, 1), "f": np.ones(2), "g": np.ones(1)}
    formats.FORMATS["mtx"].write(Path("run=3"), data)
    others = [f"run=3/{name}.mtx" for name in "Afg"]
    for stiffness in ("K=run=3/K.mtx", "run=3/K.mtx", "K=run=3/K.mtx:K"):
        import_matrices([stiffness, *others], Path("out.npz"))
    for drive in ("C:\\job.op4", "C:job.op4", "C:\\job.op4:KAA"):
        with pytest.raises(InputError, match="no such file") as error:
            import_matrices([f"K={drive}", *others], Path("out.npz"))
        assert error.value.faults[0].where == drive.removesuffix(":KAA")


def test_labelled_rows_are_said_and_digits_of_dmig_kept() -> None:
    data = {"A": sp.csc_array(np.eye(2, 1)), "f": np.array([1.0, -1.23456789e-101]), "g": np.ones(1)}
    formats.FORMATS["dmig"].write(Path("rest.pch"), data | {"K": sp.csr_array(K)})
    f, _ = formats.read_labelled(Path("rest.pch"))["f"]
    np.testing.assert_array_equal(formats.vector(f), data["f"])
    formats.FORMATS["mtx"].write(Path("."), data)
    Path("K.mtx").write_text("9,1,9,1,4.0\n4,2,4,2,3.0\n")
    shown = StringIO()
    import_matrices([f"{name}.mtx" for name in "KAfg"], Path("out.npz"), reporter=onto(shown))
    assert "from node 4, dof 2 to node 9, dof 1: those of A and f must, too" in shown.getvalue()
    formats.FORMATS["dmig"].write(Path("rest.pch"), data | {"K": sp.csr_array(K), "f": np.zeros(2)})
    import_matrices(["rest.pch"], Path("out.npz"), reporter=onto(shown))
    assert "f is in none of the files: zero, as rest.pch leaves zeros out" in shown.getvalue()


def test_files_of_a_folder_and_of_other_formats_are_not_named_alike() -> None:
    for form, out in (("mtx", "q.mps"), ("op4", "q.npz"), ("npz", "q")):
        with pytest.raises(InputError, match="no suffix" if form == "mtx" else "must end in"):
            export("gallery/installed-fasteners", Path(out), format=form)


def test_arrays_beside_a_problem_are_refused_or_said() -> None:
    problem = {"K": K, "A": np.eye(2, 1), "f": np.ones(2), "g": np.ones(1)}
    np.savez("mine.npz", **problem, x=np.ones(2), title="mine")
    assert "Not read: x;" in read_matrices({"problem": Path("mine.npz")})[0].notes[0]
    np.savez("mine.npz", **problem, lb=np.zeros(2), ub=np.ones(2))
    with pytest.raises(InputError, match=r"lb = .* a bound is a column of A") as error:
        read_matrices({"problem": Path("mine.npz")})
    assert len(error.value.faults) == 2
    parts = {f"K_{part}": getattr(sp.csc_array(K), part) for part in ("data", "indices", "indptr", "shape")}
    np.savez("mine.npz", **problem, **parts)
    with pytest.raises(InputError, match=r"K = .*one of the two: the matrix alone, or its four parts"):
        read_matrices({"problem": Path("mine.npz")})


def test_parts_that_say_that_they_are_compressed_rows_are_refused() -> None:
    """Those of a square matrix would be read as its transpose."""
    A = np.array([[1.0, -1.0], [0.0, 1.0]])
    problem = {"K": K, "f": np.ones(2), "g": np.ones(2)}
    for kind in (sp.csc_array, sp.csr_array):
        parts = {f"A_{part}": getattr(kind(A), part) for part in ("data", "indices", "indptr", "shape")}
        np.savez("mine.npz", **problem, **parts)
        with pytest.raises(InputError, match=r"A_format = None: .csc., if the parts are its columns"):
            read_matrices({"problem": Path("mine.npz")})
        np.savez("mine.npz", **problem, **parts, A_format=kind(A).format)
        if kind is sp.csc_array:
            read_back = read_matrices({"problem": Path("mine.npz")})[0].A
            np.testing.assert_array_equal(read_back.toarray(), A)
        else:
            with pytest.raises(InputError, match=r"A_format = .csr.: csc"):
                read_matrices({"problem": Path("mine.npz")})


@pytest.mark.parametrize("kind", [">f8", "f2"])
def test_numbers_that_sparse_matrices_do_not_hold_are_imported(kind: str) -> None:
    """Of a machine with another byte order, or of half precision."""
    problem = {"K": K, "A": np.eye(2, 1), "f": np.ones(2), "g": np.ones(1)}
    np.savez("mine.npz", **{name: values.astype(kind) for name, values in problem.items()})
    import_matrices(["mine.npz"], "out.npz")
    for name, values in problem.items():
        np.testing.assert_array_equal(np.load("out.npz")[name], values)


def test_a_damaged_array_beside_the_one_that_is_read_is_refused() -> None:
    np.savez("job.npz", K=K, A=np.full((2, 1), 7.0))
    content = Path("job.npz").read_bytes()
    Path("job.npz").write_bytes(content.replace(np.float64(7.0).tobytes(), np.float64(8.0).tobytes()))
    with pytest.raises(InputError, match=r"job.npz: file = 'damaged.*a readable matrix file"):
        formats.read_stiffness(Path("job.npz"))


def test_a_text_that_was_put_into_an_npz_is_no_array() -> None:
    np.savez("job.npz", KAA=K)
    with ZipFile("job.npz", "a") as archive:
        archive.writestr("README.txt", "made by hand")
    np.testing.assert_array_equal(formats.read_stiffness(Path("job.npz"))[0], K)


def test_a_load_is_a_vector() -> None:
    problem = {"K": np.eye(6), "A": np.eye(6, 2), "f": np.ones((6, 1)), "g": np.ones((1, 2))}
    assert checked(problem, {})[1].f.shape == (6,)
    np.savez("mine.npz", **problem | {"f": np.ones((2, 3))})
    for refused in (
        lambda: read_matrices({"problem": Path("mine.npz")}),
        lambda: import_matrices(["mine.npz"], "o.npz"),
    ):
        with pytest.raises(InputError, match=r"f = .*\(2, 3\).*f and g vectors"):
            refused()


def test_a_large_sparse_K_is_one_in_any_spelling() -> None:
    content = b"\xef\xbb\xbf%%matrixmarket matrix coordinate real symmetric\n3000 3000 1\n"
    Path("K.mtx.gz").write_bytes(gzip.compress(content))
    assert holds_sparse({"K": Path("K.mtx.gz")})
