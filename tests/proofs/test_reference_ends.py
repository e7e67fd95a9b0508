"""Where the reference ends: on families that take pivoting methods exponentially many steps, and in a row."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.measurement.row import _why_not_judged
from harness.planning.plan import expand
from harness.planning.suite import read_suite
from harness.verification.judge import Judgement
from harness.verification.reference import STOPPED, best_of_candidates
from harness.verification.reference_problem import reference_problem
from problems.forms.prepared import Prepared
from problems.scene import read_scene


@pytest.mark.parametrize("m", [32, 64, 128, 256])
def test_an_exponential_family_is_proven(m: int) -> None:
    made = read_scene(f"hard/pivoting/fathi-{m:03d}").made
    found = best_of_candidates(Prepared(made.assembly), made.load)
    assert abs(found.x - np.asarray(made.x)).max() <= found.bound_mm < 1e-12


def test_a_row_says_why_it_cannot_be_judged(tmp_path: Path) -> None:
    suite = tmp_path / "mine.toml"
    suite.write_text(
        'scenes = ["hard/pivoting/fathi-008"]\nreference_limit_s = 0.001\n[[solver]]\nname = "newton"\n'
    )
    assert read_suite(str(suite)).reference_limit_s == 0.001
    assert {m.reference_limit_s for m in expand(read_suite(str(suite)))} == {0.001}
    judgement = Judgement("cannot_be_judged", 1e-3)
    problem = reference_problem("hard/pivoting/fathi-008")
    wide = replace(problem)
    vars(wide)["reference"] = replace(problem.reference, bound_mm=1e-3, route=f"proven, {STOPPED}")
    assert _why_not_judged(judgement, wide) == f"reference error bound 1e-03 mm: proven, {STOPPED}"
    assert _why_not_judged(Judgement("within"), problem) is None
