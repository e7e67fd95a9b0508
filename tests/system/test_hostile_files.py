"""Files that are damaged, foreign, missing or in the way: refused by name or mended, and nothing is lost."""

from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from commands import harness, wrong_usage
from refusals import refusal_of
from small_problems import make_load, make_prepared

from harness.scene.export import matrices
from harness.scene.import_files import import_matrices
from problems import formats
from problems.errors import InputError
from problems.formats.nastran import pyyeti


def own_matrices(**changes: Any) -> formats.Data:
    """K (12, 12), A (12, 7), f, g as dense arrays."""
    data = make_prepared(3, 5, tools=2)
    found = matrices(data, make_load(3, data)[0])
    return found | {name: found[name].toarray() for name in "KA"} | changes


# --- import and export --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("source", "out", "said"),
    [
        *(("bad.npz", "bad.npz", "bad.npz"), ("bad.npz", "mine.npz", "bad.npz")),
        *(("mine.npz", "mine.npz", "one of the files"), ("mine.npz", "link.npz", "one of the files")),
        ("mine.npz", "noext", "must end in .npz"),
    ],
)
def test_a_refused_import_leaves_files_as_they_are(
    source: str, out: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its input, also by a link, and another file."""
    monkeypatch.chdir(tmp_path)  # a long path would be cut in the message
    np.savez("bad.npz", **own_matrices(K=-np.eye(12)))
    np.savez("mine.npz", **own_matrices())
    Path("link.npz").symlink_to("mine.npz")
    contents = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert said in wrong_usage("import", source, "--out", out)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == contents


@pytest.mark.parametrize("form", formats.FORMATS)
def test_an_export_replaces_no_device_no_folder_and_no_input(form: str, tmp_path: Path) -> None:
    file, folder = tmp_path / "mine.npz", tmp_path / "folder"
    np.savez(file, **own_matrices())
    folder.mkdir()
    formats.FORMATS["mtx"].write(folder, own_matrices())
    scene = folder / "scene.toml"
    scene.write_text("[matrices]\n" + "".join(f'{name} = "{name}.mtx"\n' for name in "KAfg"))
    contents = {path: path.read_bytes() for path in (file, *folder.iterdir())}
    of_folders = form in ("mtx", "abaqus")
    for source, out in ((file, "/dev/null"), (file, file), (scene if of_folders else file, folder)):
        done = harness("export", source, "--format", form, "--out", out)
        assert done.exit_code == 2, done.output
        assert "--out" in done.output or out == folder
    assert Path("/dev/null").is_char_device()
    assert {path: path.read_bytes() for path in (file, *folder.iterdir())} == contents


# --- DMIG ---------------------------------------------------------------------------------------------


def cards(path: Path, **frames: pd.DataFrame) -> Path:
    pyyeti(path).wtdmig(str(path), frames)
    return path


def frame(values: Any, points: Any = None, columns: Any = None) -> pd.DataFrame:
    values = np.asarray(values, dtype=float)
    points = points or range(1, len(values) + 1)
    index = pd.MultiIndex.from_product([points, [0]], names=["id", "dof"])
    return pd.DataFrame(values, index=index, columns=columns or range(1, values.shape[1] + 1))


def stiffness(K: Any) -> pd.DataFrame:
    made = frame(K)
    made.columns = made.index
    return made


def test_an_absent_matrix_replaces_no_given_one_in_any_order(tmp_path: Path) -> None:
    data = own_matrices()
    formats.FORMATS["mtx"].write(tmp_path, data)
    files = [cards(tmp_path / "konly.pch", K=stiffness(data["K"])), *(tmp_path / f"{x}.mtx" for x in "Afg")]
    for order in list(permutations(map(str, files)))[::5]:
        import_matrices(list(order), tmp_path / "out.npz")
        with np.load(tmp_path / "out.npz") as found:
            np.testing.assert_array_equal(found["f"], data["f"])
            np.testing.assert_array_equal(found["g"], data["g"])


def test_a_matrix_in_two_files_is_refused(tmp_path: Path) -> None:
    data = own_matrices()
    formats.FORMATS["mtx"].write(tmp_path / "m", data)
    np.savez(tmp_path / "all.npz", **data)
    for files in permutations([str(tmp_path / "all.npz"), str(tmp_path / "m" / "f.mtx")]):
        with pytest.raises(InputError, match="too; say f=FILE"):
            import_matrices(list(files), tmp_path / "out.npz")


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"F": frame([[1.0], [2.0]], [1, 99])}, "F, point 99, component 0"),
        ({"G": frame([[1.0], [2.0]], [1, 8])}, "G, point 8, component 0"),
        ({"A": frame(np.vstack([np.eye(12, 7), np.ones(7)]))}, "A, point 13, component 0"),
    ],
)
def test_a_row_at_a_point_that_is_not_there_is_named(changed: Any, said: str, tmp_path: Path) -> None:
    data = own_matrices()
    whole = {"K": stiffness(data["K"]), "A": frame(data["A"]), "F": frame(data["f"][:, None])}
    path = cards(tmp_path / "p.pch", **(whole | changed))
    assert said in str(refusal_of(import_matrices, [str(path)], tmp_path / "out.npz"))


# --- own matrices -------------------------------------------------------------------------------------


FAR = np.linspace(-1, 1, 24).reshape(12, 2) * 1e308


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"K": np.zeros((0, 0)), "A": np.zeros((0, 0)), "f": np.zeros(0), "g": np.zeros(0)}, "at least one"),
        ({"K": np.zeros((2, 2, 2))}, "must be matrices"),
        ({"nodes": np.full((12, 2), np.nan)}, "nodes"),
        ({"nodes": FAR}, "nodes"),
        *(({"A": own_matrices()["A"] * a}, "choose another unit of") for a in (1e200, 1e-200, 1e-320)),
        *(({"K": own_matrices()["K"] * 10.0**k}, "choose another unit of") for k in (-311, -309, -290, 300)),
        ({"K": own_matrices()["K"] * 1e-250, "A": own_matrices()["A"] * 1e-250}, "choose another unit of"),
    ],
)
def test_matrices_beyond_double_precision_are_refused(changes: Any, said: str, tmp_path: Path) -> None:
    """By one command, and one of them by all that read it."""
    path = tmp_path / "own.npz"
    np.savez(path, **own_matrices(**changes))
    others = [["validate", path], ["import", path, "--out", tmp_path / "x.npz"]]
    for words in [["solve", path, "--out", tmp_path], *(others if "f" in changes else [])]:
        told = wrong_usage(*words)
        assert said in told
        assert str(path) in told
