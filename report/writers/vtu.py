"""The answer as an unstructured grid for ParaView, by meshio (optional: pip install 'rivetbench[vtu]')."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from report.figures.maps import Array, grid_of


def write_vtu(path: Path, record: dict[str, Any], arrays: dict[str, Any]) -> str:
    """Write the parts' junction nodes with their fields. Returns the file's name, or why it was not written,
    since meshio is optional.

    Point data: displacement (0, 0, x) in mm, to warp by; part; Aλ, the force with which the node pushes on
    what it touches, N; the smallest gap before and after at its contacts, mm, NaN if it has none.
    """
    try:
        import meshio
    except ModuleNotFoundError:
        return "not written: meshio is not installed (pip install 'rivetbench[vtu]')"
    meshio.Mesh(*grid_with_fields(record, arrays)).write(path)
    return path.name


def grid_with_fields(
    record: dict[str, Any], arrays: dict[str, Any]
) -> tuple[Array, list[tuple[str, Any]], dict[str, Array]]:
    """Points (n, 3), cells and point data for meshio."""
    nodes, n = arrays["nodes"], record["n"]
    force, before, after = np.zeros(n), np.full(n, np.nan), np.full(n, np.nan)
    columns = np.repeat(np.arange(record["m"]), np.diff(arrays["A_indptr"]))
    np.add.at(force, arrays["A_indices"], arrays["A_data"] * np.nan_to_num(arrays["lam"])[columns])
    np.fmin.at(before, arrays["A_indices"], arrays["gap_before"][columns])
    np.fmin.at(after, arrays["A_indices"], arrays["gap_after"][columns])
    part = np.concatenate([np.full(p["stop"] - p["start"], k) for k, p in enumerate(record["parts"])])
    data = {
        "displacement_mm": np.column_stack([np.zeros((n, 2)), arrays["x"]]),
        "part": part.astype(float),
        "contact_force_N": force,
        "gap_before_mm": before,
        "gap_after_mm": after,
    }
    points = np.column_stack([nodes, np.zeros(n)])
    blocks = [_cells(nodes[p["start"] : p["stop"]], p["start"]) for p in record["parts"]]
    return points, blocks, data


def _cells(nodes: Array, start: int) -> tuple[str, Any]:
    """Quadrilaterals if the nodes are a grid, else the nodes themselves."""
    grid = grid_of(nodes)
    if grid is None:
        return "vertex", start + np.arange(len(nodes))[:, None]
    x, y, place = grid
    at = np.empty(len(place), dtype=int)
    at[place] = start + np.arange(len(place))
    rows = at.reshape(len(y), len(x))
    corners = [rows[:-1, :-1], rows[:-1, 1:], rows[1:, 1:], rows[1:, :-1]]
    return "quad", np.column_stack([corner.ravel() for corner in corners])
