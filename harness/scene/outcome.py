"""What `solve` leaves: files for the report and other programs, and lines for whoever waits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from harness.results.records import replace_text, to_line
from harness.verification.judge import LIMIT_MM
from harness.verification.reference import UNPROVEN
from problems.forms.assembly import Assembly, LoadCase, Vector


def save(
    out: Path, record: dict[str, Any], assembly: Assembly, load: LoadCase, x: Vector, lam: Vector
) -> None:
    """Write DIR/solution.npz and DIR/solution.json; of x and A, what is asked for."""
    A, nodes = assembly.asked_contacts, assembly.asked_nodes
    arrays = {
        "x": assembly.at_junction(x),
        "lam": lam,
        "gap_before": load.g,
        "gap_after": load.g - assembly.A.T @ x,
        "A_data": A.data,
        "A_indices": A.indices,
        "A_indptr": A.indptr,
    }
    if nodes is not None:
        arrays |= {"nodes": nodes, "contact_nodes": assembly.contact_nodes}
    np.savez(out / "solution.npz", **arrays)
    replace_text(out / "solution.json", to_line(record) + "\n")


def show(record: dict[str, Any], console: Console) -> None:
    """Print the ledger, what was skipped, and the answer with its bound."""
    table = Table("effect", "adds", "what", "s", title="What each effect added")
    for entry in record["ledger"]:
        seconds = "–" if entry["seconds"] is None else f"{entry['seconds']:.3f}"
        table.add_row(entry["effect"], entry["adds"], entry["amount"], seconds)
    if record["ledger"]:
        console.print(table)
    if record["digits"]:
        console.print(f"{record['digits']}.")
    for line in record["skipped"]:
        console.print(f"Skipped: {line}.", style="dim")
    error, bound = record["judged_error_mm"], record["error_bound_mm"]
    proven = np.isfinite(bound)
    if error is None:
        text = f"every displacement within {bound:.1e} mm, proven" if proven else f"a bound {UNPROVEN}"
    else:
        known = f"with a proven bound ({bound:.1e} mm)" if proven else f"whose bound {UNPROVEN}"
        text = (
            f"{record['status']}, {error:.1e} mm from the answer {known}: {record['verdict']} {LIMIT_MM:g} mm"
        )
    console.print(f"{record['method']}: {text}.", style="green" if record["verdict"] == "within" else "red")
