"""The cache: whole entries or none, memory-mapped, and rebuilt when what made them changes."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refusal_of
from small_joints import PART, forbid_building, make_joint, make_scene

from problems import build, storage
from problems.effects.supports import Supports
from problems.errors import InputError
from problems.reporter import Reporter, Stage
from problems.scene_files import read_scene
from problems.storage import ROOT

ARRAYS = {"one": np.arange(600.0).reshape(20, 30), "two": np.array([1, 2, 3])}
SCENE = make_scene(
    make_joint(PART, PART | {"name": "b"}),
    Supports(kind="supports", part="a", points=((200.0, 60.0),), stiffness_per_point=1e3),
)


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.mark.usefixtures("root")
def test_an_entry_comes_back_memory_mapped_and_read_only() -> None:
    assert storage.load("key") is None
    storage.store("key", ARRAYS, {"n": 3, "text": "é"})
    found = storage.load("key")
    assert found is not None
    arrays, facts = found
    assert facts == {"n": 3, "text": "é"}
    assert arrays.keys() == ARRAYS.keys()
    for name, array in arrays.items():
        assert isinstance(array, np.memmap)
        assert not array.flags.writeable
        np.testing.assert_array_equal(array, ARRAYS[name])


@pytest.mark.parametrize("kept", [0, 100, -8, None])
def test_a_truncated_or_missing_array_is_named_with_its_sizes(root: Path, kept: int | None) -> None:
    storage.store("key", ARRAYS, {})
    path = root / "key" / "one.npy"
    whole = path.read_bytes()
    path.unlink()
    if kept is not None:
        path.write_bytes(whole[:kept])
    refused = str(refusal_of(storage.load, "key"))
    found = None if kept is None else len(whole[:kept])
    for said in (str(path), str(len(whole)), str(found), "delete"):
        assert said in refused


@pytest.mark.parametrize("name", ["one.npy", storage.MANIFEST])
def test_one_changed_bit_is_named(root: Path, name: str) -> None:
    """In the header of an array, in its numbers, in the names, the sizes and the facts of the manifest."""
    storage.store("key", ARRAYS, {"bound_mm": 1e-17, "text": "é"})
    path = root / "key" / name
    whole = path.read_bytes()
    path.chmod(0o644)
    for at in range(0, len(whole), 7):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 4]) + whole[at + 1 :])
        with suppress(InputError):  # none of a space, nor of the name of the hash
            found = storage.load("key")
            assert found is None or (name == storage.MANIFEST and found[1]["bound_mm"] == 1e-17)


@pytest.mark.parametrize("content", [b"", b"[]", b"[" * 100_000, b"\xff", None, b'{"files": [], "hash": ""}'])
def test_a_damaged_manifest_is_named_with_what_to_do(root: Path, content: bytes | None) -> None:
    storage.store("key", ARRAYS, {})
    manifest = root / "key" / storage.MANIFEST
    manifest.unlink()
    if content is not None:
        manifest.write_bytes(content)
    with pytest.raises(InputError, match=r"manifest\.json.*delete"):
        storage.load("key")


def test_what_a_killed_writer_leaves_is_not_seen(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Looked at from within the writing, after each file."""
    save, seen = np.save, []

    def look(path: Path, array: Any) -> None:
        save(path, array)
        seen.append(storage.load("key"))

    monkeypatch.setattr(np, "save", look)
    storage.store("key", ARRAYS, {})
    assert seen == [None, None]
    assert storage.load("key") is not None


@pytest.mark.usefixtures("root")
def test_the_second_opening_builds_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    monkeypatch.setattr(Reporter, "building", lambda self, stage, *rest: made.append(stage))
    first = build.prepared(SCENE)
    assert first.Q.shape == (20, 20)
    assert set(made) == {Stage.CONDENSATION, Stage.FACTORS, Stage.CONDITION, Stage.Q}
    forbid_building(monkeypatch)
    made.clear()
    second = build.prepared(SCENE)
    for one, other in zip(first.assembly.K.matrices, second.assembly.K.matrices, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(first.Q, second.Q)
    assert first.facts == second.facts
    assert not made
    for array in (second.Q, *second.assembly.K.matrices, *second.assembly.K.factors):
        assert isinstance(array, np.memmap)
        assert not array.flags.writeable


OWN = "input.user_matrices"  # makes a user's matrices, no joint's


@pytest.mark.parametrize(
    "module",
    [
        *("model.plate", "model.condensation", "model.joint", "model.part"),
        *("stiffness.dense_block", "forms.preparation_stages", "effects.supports", OWN),
    ],
)
def test_a_change_of_the_code_that_builds_changes_the_key(
    module: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez(tmp_path / "own.npz", K=np.eye(2), A=np.eye(2)[:, :1], f=np.ones(2), g=np.ones(1))
    scene = read_scene(str(tmp_path / "own.npz")) if module == OWN else SCENE
    edited = (ROOT / "problems" / module.replace(".", "/")).with_suffix(".py")
    key = build.prepared(scene).key
    monkeypatch.setattr(storage, "_read", storage._read.__wrapped__)
    read = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + b"\nMORE = 1\n" * (path == edited))
    assert build.prepared(scene).key != key


def test_a_folder_that_cannot_be_made(root: Path) -> None:
    root.write_text("a file where the folder should be")
    with pytest.raises(InputError, match="RIVETBENCH_CACHE"):
        build.prepared(SCENE)


def test_a_writer_that_fails_leaves_nothing(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save = np.save

    def disk_full(path: Path, array: Any) -> None:
        if path.name == "two.npy":
            path.write_bytes(b"half")
            raise OSError("no space left on device")
        save(path, array)

    with monkeypatch.context() as patch:
        patch.setattr(np, "save", disk_full)
        with pytest.raises(OSError, match="no space"):
            storage.store("key", ARRAYS, {})
    assert list(root.iterdir()) == []
    assert storage.load("key") is None
