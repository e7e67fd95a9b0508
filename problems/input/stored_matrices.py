"""A user's matrices, read and checked once, then from the cache."""

import time
from pathlib import Path

import numpy as np
import scipy.io

from problems.forms.assembly import Assembly, LoadCase
from problems.stiffness.operator import Stiffness
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from . import sparse_npz, user_matrices

SMALL = 2000  # unknowns up to which a K is solved in the dense forms


def stored_matrices(
    files: dict[str, Path], files_key: str, sparse: bool
) -> tuple[Assembly, LoadCase, float, str]:
    """The assembly, its blocks dense and memory-mapped or `sparse`, the load case, the seconds that reading
    took, and the key.

    files_key : a hash of the files' content. Raises InputError.
    """
    code = fingerprint([Path(__file__)], within=("problems/input",))
    key = cache.digest("own", files_key, sparse, code)

    def made() -> cache.Entry:
        start = time.perf_counter()
        assembly, load = user_matrices.read_matrices(files, sparse)
        arrays = {f"K{k}": matrix for k, matrix in enumerate(assembly.K.matrices)}
        arrays |= {"A": assembly.A, "f": load.f, "g": load.g}
        if assembly.nodes is not None:
            arrays["nodes"] = assembly.nodes
        facts = {"parts": assembly.parts, "notes": assembly.notes, "seconds": time.perf_counter() - start}
        return sparse_npz.packed(arrays), facts

    arrays, facts = cache.load_or_make(key, made)
    nodes, names = arrays.get("nodes"), [f"K{k}" for k in range(len(facts["parts"]))]
    K = Stiffness.of(*(sparse_npz.unpacked(arrays, k) if sparse else arrays[k] for k in names), nodes=nodes)
    A = sparse_npz.unpacked(arrays, "A")
    assembly = Assembly(K, A, nodes, tuple(facts["parts"]), tuple(facts["notes"]))
    return assembly, LoadCase(np.array(arrays["f"]), np.array(arrays["g"])), facts["seconds"], key


def holds_sparse(files: dict[str, Path]) -> bool:
    """Whether K is stored as a sparse matrix, and large; a file that cannot be read does not."""
    try:
        if "problem" in files:
            with np.load(files["problem"]) as archive:
                return "K_shape" in archive.files and archive["K_shape"][0] > SMALL
        rows, _, _, layout, _, _ = scipy.io.mminfo(files["K"])
        return bool(layout == "coordinate" and rows > SMALL)
    except Exception:  # zipfile, pickle and mminfo raise their own kinds; whoever reads it says what is wrong
        return False
