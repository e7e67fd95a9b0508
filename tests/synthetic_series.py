"""A made-up series of load cases. Nothing in it was ever measured."""

import json
from pathlib import Path

import numpy as np

from harness.results import series_file

CASES, M = 240, 12
IDENTITY = {"solver": "newton", "form": "dual", "tolerance": 1e-11}
UNANSWERED = 17


def made(directory: Path, swept: bool = False, name: str = "made") -> np.ndarray:
    """A series of random gaps whose rows came in another order, one without an answer. name : also title."""
    rng = np.random.default_rng(0)
    gaps = rng.gamma(1.0, 0.1, (CASES, M)).astype(np.float32)
    gaps[:, 0] = 0.0
    facts = {"scene": name, "title": name, "cases": CASES, "threads": 1, "machine": name}
    series_file.write_fact(directory, "series", json.dumps({"identity": IDENTITY, **facts}))
    cases = []
    for case in rng.permutation(CASES):
        row = {"case": int(case), "verdict": "within", "setup_s": 0.001, "solve_s": 0.01, "form_s": 0.002}
        row |= {
            "max_gap_mm": float(gaps[case].max()),
            "mean_gap_mm": float(gaps[case].mean()),
            "bound_mm": 1e-9,
        }
        if swept:
            row["initial_gap.mean"] = case // 4 / 10
        if case == UNANSWERED:
            row = {"case": int(case), "verdict": "no_answer"} | {k: row[k] for k in row if "." in k}
        cases.append((row, None if case == UNANSWERED else gaps[case]))
    series_file.append(directory, cases)
    nodes = np.column_stack([np.tile(np.arange(6.0), 2), np.repeat([0.0, 1.0], 6)])
    arrays = {"m": np.array(M), "contact_nodes": nodes, "fasteners": nodes[:2]}
    series_file.write_contacts(directory, arrays)
    return np.delete(gaps, UNANSWERED, axis=0).astype(float)
