"""python mat_arrays.py FILE.mat OUT.npz NAME…: those arrays of a .mat, for sparse_npz, and the names of all.

A program of its own that needs SciPy alone, because SciPy's reader can crash on a damaged file.
"""

from __future__ import annotations

import sys

import numpy as np
import scipy.io
import scipy.sparse as sp


def main(path: str, out: str, wanted: list[str]) -> None:
    found = scipy.io.loadmat(path)
    arrays = {"names": np.array(sorted(name for name in found if name[0] != "_"), dtype=str)}
    for name in wanted:
        M = found.get(name)
        if sp.issparse(M):
            M = sp.csc_array(M)
            arrays |= {f"{name}_{part}": getattr(M, part) for part in ("data", "indices", "indptr")}
            arrays[f"{name}_shape"] = np.array(M.shape)
        elif M is not None:
            arrays[name] = np.asarray(M)
    np.savez(out, allow_pickle=False, **arrays)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3:])
