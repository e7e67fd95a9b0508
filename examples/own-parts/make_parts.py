"""Two plates in Morley's triangles (scikit-fem), reduced to their junction, as your own program reduces them.

The wing, 2.5 mm thick, 600 × 300 mm, is clamped at y = 300; the frame, 6 mm thick, at y = −100. They meet on
the strip 0 ≤ y ≤ 120, each with its own nodes. Written are, beside this script, K of each part on the
deflections at its nodes of the strip, N/mm, and the table of these nodes.
"""

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
import skfem
from skfem.helpers import dd, ddot, eye, trace

HERE = Path(__file__).parent
YOUNG, POISSON, WIDTH = 70e3, 0.33, 120.0


@skfem.BilinearForm  # type: ignore[untyped-decorator]
def bending(u: Any, v: Any, w: Any) -> Any:
    kappa = dd(u)
    return ddot((1 - POISSON) * kappa + POISSON * eye(trace(kappa), 2), dd(v))


def plate(
    x: np.ndarray, y: np.ndarray, thickness: float, clamped: float, moved: float
) -> tuple[Any, np.ndarray]:
    """K on the deflections at the nodes of the strip, and these; inner nodes are moved at random."""
    mesh = skfem.MeshTri.init_tensor(x, y)
    random, step = np.random.default_rng(1), moved * min(np.diff(x)[0], np.diff(y)[0])
    inside = (
        (mesh.p[0] > x[0])
        & (mesh.p[0] < x[-1])
        & ((mesh.p[1] % WIDTH) > 0)
        & (mesh.p[1] > y[0])
        & (mesh.p[1] < y[-1])
    )
    points = mesh.p + step * np.where(inside, random.uniform(-1, 1, mesh.p.shape), 0.0)
    basis = skfem.Basis(skfem.MeshTri(points, mesh.t), skfem.ElementTriMorley())
    K = sp.csc_array(bending.assemble(basis) * (YOUNG * thickness**3 / 12 / (1 - POISSON**2)))
    strip = np.flatnonzero((points[1] >= 0) & (points[1] <= WIDTH))
    kept = basis.nodal_dofs[0, strip]
    edge = basis.get_dofs(basis.mesh.facets_satisfying(lambda p: np.isclose(p[1], clamped))).all()
    rest = np.setdiff1d(np.arange(basis.N), np.concatenate([kept, edge]))
    S = K[kept][:, kept].toarray() - K[kept][:, rest] @ spla.splu(K[rest][:, rest]).solve(
        K[rest][:, kept].toarray()
    )
    return (S + S.T) / 2, points[:, strip].T


def write(name: str, K: np.ndarray, nodes: np.ndarray, z: float) -> None:
    np.savez(HERE / f"{name}.npz", K=K)
    lines = [f"{k},{x:.6g},{y:.6g},{z:g}" for k, (x, y) in enumerate(nodes.tolist(), start=101)]
    (HERE / f"{name}.csv").write_text("\n".join(["id,x [mm],y [mm],z [mm]", *lines]) + "\n")


def main() -> None:
    write("wing", *plate(np.linspace(0, 600, 17), np.linspace(0, 300, 11), 2.5, 300.0, 0.0), 0.0)
    write("frame", *plate(np.linspace(0, 600, 19), np.linspace(-100, 120, 12), 6.0, -100.0, 0.25), 1.25)


if __name__ == "__main__":
    main()
