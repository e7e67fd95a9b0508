"""Problems from outside: printed optima, closed forms, convergence."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from sample_size import ASKED
from synthetic_results import row, write_rows

from harness.solving.solver_session import answer_of
from harness.verification.judge import Reference, judge
from harness.verification.reference import best_of_candidates
from problems.build import load_case, prepared
from problems.ladders import rung_names
from problems.ladders.outside import FREE, bare_membrane, exact_membrane, journal_bearing
from problems.scene_files import read_scene
from report.results.reader import read
from report.sections import outside
from solvers.registry import make_solver

PRINTED = [
    name
    for name in rung_names("outside/")
    if not name.rpartition("/")[2].isdigit() and (ASKED or read_scene(name).expected_size[0] < 5000)
]


def solved(name: str) -> tuple[Reference, float]:
    """The reference, from newton's answer in the sparse form, and the objective."""
    scene = read_scene(name)
    data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
    answer = answer_of("newton", make_solver("newton", {}), data, "sparse", load, 1e-11)
    assert answer.status == "solved"
    reference = best_of_candidates(data, load, first=[("newton", answer.lam)])
    judged = judge(data, load, reference, np.asarray(answer.x), np.asarray(answer.lam), 1e-7)
    assert judged.verdict == "within"
    assert judged.objective is not None
    return reference, judged.objective


@pytest.mark.parametrize("name", PRINTED)
def test_the_optimum_is_the_printed_one(name: str) -> None:
    """To the last printed digit, rounded or cut off: the sources stopped at tolerances of their own."""
    printed = read_scene(name).printed
    _, objective = solved(name)
    last_digit = 10.0 ** (np.floor(np.log10(abs(printed.value))) + 1 - printed.digits)
    assert abs(objective - printed.value) <= 1.5 * last_digit


def test_the_membrane_over_a_hemisphere_converges_to_its_closed_form() -> None:
    errors, radii = [], []
    for cells in (8, 20, 40, 80):
        reference, _ = solved(f"outside/hemisphere/{cells}")
        assembly = prepared(read_scene(f"outside/hemisphere/{cells}"), form="sparse").assembly
        at, covered = assembly.nodes, assembly.nodes[assembly.A.indices]
        errors.append(float(abs(reference.x + bare_membrane(cells) - exact_membrane(at)).max()))
        radii.append(float(np.hypot(*covered[reference.active].T).max()) - FREE)
    # Bueler's example prints this for the same grid: 1.334e-02.
    assert errors[0] == pytest.approx(1.334e-2, abs=5e-6)
    assert errors[-1] < errors[0] * 8 / 80  # better than first order
    assert errors == sorted(errors, reverse=True)
    assert abs(radii[-1]) <= 4 / 80


def test_the_matrices_are_those_of_linear_triangles() -> None:
    """∫ w ∇φ·∇φ summed over each triangle alone, for the journal bearing."""
    nx, ny, eccentricity = 3, 2, 0.1
    hx, hy = 2 * np.pi / (nx + 1), 20.0 / (ny + 1)
    K = np.zeros(((nx + 2) * (ny + 2),) * 2)
    for i in range(nx + 1):
        for j in range(ny + 1):
            for corners in (((i, j), (i + 1, j), (i, j + 1)), ((i + 1, j + 1), (i, j + 1), (i + 1, j))):
                p = np.array([(a * hx, b * hy) for a, b in corners])
                gradients = np.linalg.solve(np.column_stack([p, np.ones(3)]), np.eye(3))[:2]
                w = np.mean((1 + eccentricity * np.cos(p[:, 0])) ** 3)
                at = [a * (ny + 2) + b for a, b in corners]
                K[np.ix_(at, at)] += w * hx * hy / 2 * gradients.T @ gradients
    inner = [a * (ny + 2) + b for a in range(1, nx + 1) for b in range(1, ny + 1)]
    made = journal_bearing(nx, ny, eccentricity).assembly.K.matrices[0]
    assert sp.issparse(made)
    np.testing.assert_allclose(made.toarray(), K[np.ix_(inner, inner)], rtol=1e-12, atol=1e-14)


def test_the_report_shows_printed_values_and_the_order(tmp_path: Path) -> None:
    values = {"20": 1.0, "40": 1.4, "80": 1.5, "petsc-8x12": -0.18343}
    rows = [
        row("1/1", "newton", "sparse") | {"scene": f"outside/made/{size}", "objective": value}
        for size, value in values.items()
    ]
    rows += [row("1/1", "newton", "sparse") | {"scene": "outside/made/160", "verdict": "outside"}]
    write_rows(tmp_path, rows)
    problem = {"scene": "outside/made/petsc-8x12", "printed_objective": -0.183437, "printed_digits": 6}
    (tmp_path / "problems.jsonl").write_text(
        json.dumps(problem | {"printed_source": "PETSc"}) + "\n", "utf-8"
    )
    section = outside.section(read(tmp_path))
    printed, refined = section.blocks
    for shown in ("-0.183437", "4e-5", "PETSc"):
        assert shown in printed.markdown
    last = [cell.strip() for cell in refined.markdown.splitlines()[-1].split("|")[1:-1]]
    assert last[:2] == ["made", "80"]
    assert last[6] == "2.00"  # changes 0.4, then 0.1
    assert outside.section(read(write_rows(tmp_path / "none", [row()]))) is None
