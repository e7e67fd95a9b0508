"""Superelements for tests: files of K and nodes, and a scene of them."""

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from small_joints import PART, make_joint

from harness.scene.solution import Solution, solve
from problems import formats
from problems.build import prepared
from problems.model.joint import Joint
from problems.model.scene import JointScene
from problems.scene_files import scene_of

Array = NDArray[np.float64]
Tables = dict[str, Any]


def two_plates(nodes: tuple[int, int] = (9, 5)) -> Joint:
    return make_joint(PART, PART | {"name": "b", "thickness": 4.0}, nodes=nodes)


def stiffnesses(joint: Joint) -> list[Array]:
    """K of each part of the built-in joint, condensed onto its junction nodes."""
    return [np.array(K) for K in prepared(JointScene("plates", "plates", joint)).assembly.K.matrices]


def flat(nodes: Array) -> Array:
    """(c, 3) nodes at height 0."""
    return np.column_stack([nodes, np.zeros(len(nodes))])


def write_nodes(path: Path, xyz: Array, normals: Array | None = None, **columns: Any) -> None:
    """With the ids 1, 2, …, or those in `columns`."""
    table = {"id": np.arange(1, len(xyz) + 1), "x": xyz[:, 0], "y": xyz[:, 1], "z": xyz[:, 2]}
    if normals is not None:
        table |= dict(zip(("nx", "ny", "nz"), normals.T, strict=True))
    table |= columns
    rows = zip(*(np.asarray(column).tolist() for column in table.values()), strict=True)
    text = "\n".join(",".join(map(repr, row)) for row in rows)
    path.write_text(f"{','.join(table)}\n{text}\n")


def write_part(
    folder: Path,
    name: str,
    K: Any,
    xyz: Array,
    normals: Array | None = None,
    format: str = "npz",
    **more: Any,
) -> Tables:
    """The table of a part whose files are in the folder. more : columns of its nodes; dofs, rows, matrix."""
    keys = {key: more.pop(key) for key in ("dofs", "rows", "matrix") if key in more}
    if len(keys.get("dofs", "z")) > 1:
        keys.setdefault("rows", "table")
    path = folder / f"{name}{formats.FORMATS[format].suffixes[0]}"
    if format == "npz":
        np.savez(path, K=K) if not sp.issparse(K) else formats.matrix_files.write(path, {"K": K})
    else:
        n = K.shape[0]
        data = {"K": sp.csr_array(K), "A": sp.csc_array(np.eye(n, 1)), "f": np.zeros(n), "g": np.zeros(1)}
        written = folder / name if formats.FORMATS[format].is_folder else path
        formats.FORMATS[format].write(written, data)
        path = written / "K.mtx" if written.is_dir() else written
    write_nodes(folder / f"{name}.csv", xyz, normals, **more)
    return {"name": name, "superelement": str(path), "nodes": str(folder / f"{name}.csv")} | keys


def with_bay(folder: Path) -> list[Tables]:
    """Parts a and b of 100 x 100 mm with a node every 5 mm, but for a bay: 20 < x < 80, y > 20."""
    x, y = (each.ravel() for each in np.meshgrid(np.arange(0.0, 101, 5), np.arange(0.0, 101, 5)))
    nodes = flat(np.column_stack([x, y])[~((x > 20) & (x < 80) & (y > 20))])
    return [write_part(folder, name, 40 * np.eye(len(nodes)), nodes) for name in "ab"]


def write_plates(folder: Path, joint: Joint, **more: Any) -> list[Tables]:
    """The tables of the two parts of the built-in joint, as superelements. more : see `write_part`."""
    both = zip("ab", stiffnesses(joint), strict=True)
    return [write_part(folder, name, K, flat(joint.nodes), **more) for name, K in both]


def scene_from(parts: list[Tables], *effects: Tables, **joint: Any) -> JointScene:
    scene = scene_of({"joint": {"part": parts} | joint, "effect": list(effects)})
    assert isinstance(scene, JointScene)
    return scene


def solved(scene: JointScene) -> Solution:
    found = solve(scene)
    assert found.judgement.verdict == "within"
    return found
