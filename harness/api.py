"""rivetbench from Python.

    from rivetbench import load_scene, solve, judge

    scene = load_scene("gallery/three-part-stack")
    answer = solve(scene)                            # the certified reference: x, λ, gaps, error bound
    answer = solve(scene, "piqp", tolerance=1e-9)    # a solver by name, judged
    judge(scene, x, lam)                             # an x that came from elsewhere

A problem is min ½xᵀKx − fᵀx subject to Aᵀx ≤ g: x (n,) displacements in mm, λ (m,) contact forces in N,
g (m,) initial gaps in mm, f (n,) loads in N. A `scene` argument is a Scene, the name of a packaged one, the
path of a .toml or .npz file, or a dict with the content of a scene's file. `place` and `shim` need a scene
that has a file, whose text they write anew; `random_gaps` takes a Scene only. All faults of an input are in
one InputError. Matrices are cached as by the command line. Arrays are copied, and threads take turns
(solving/call_lock.py).
"""

from harness.commands import limit_search, load_case_series, plain_arrays, run_comparison, suite_runs
from harness.commands.limit_search import Tolerance
from harness.commands.load_case_series import SeriesOutcome
from harness.commands.suite_runs import SuiteOutcome
from harness.conformance import check
from harness.explore.live_answers import Explorer, LiveAnswer, Settings
from harness.placement import run as placement
from harness.placement.run import Placement
from harness.planning.overrides import Overrides
from harness.results.comparison import Incomparable
from harness.scene import export as files
from harness.scene import import_files, solution
from harness.scene import stress as plate_stress
from harness.scene import validate as checks
from harness.scene.solution import Solution
from harness.scene.stages import StageAnswer
from harness.scene.stress import Stresses
from harness.series.load_case_source import GapCases
from harness.series.session import SeriesOptions
from harness.shimming import shim_run as shimming
from harness.shimming.shim_run import Shimming
from harness.solving.call_lock import in_turn
from harness.terminal.console import ConsoleReporter
from harness.verification import gate as gates
from harness.verification.gate import GateOutcome
from harness.verification.judge import Judgement
from problems.errors import InputError
from problems.forms.assembly import DualLoadCase, LoadCase
from problems.load_cases import random_gaps as random_fields
from problems.model.scene import Scene
from problems.reporter import Reporter
from solvers.base import Answer, Solver

__all__ = [
    "Answer",
    "ConsoleReporter",
    "DualLoadCase",
    "Explorer",
    "GapCases",
    "GateOutcome",
    "Incomparable",
    "InputError",
    "Judgement",
    "LiveAnswer",
    "LoadCase",
    "Overrides",
    "Placement",
    "Reporter",
    "Scene",
    "SeriesOptions",
    "SeriesOutcome",
    "Settings",
    "Shimming",
    "Solution",
    "Solver",
    "StageAnswer",
    "Stresses",
    "SuiteOutcome",
    "Tolerance",
    "check_solver",
    "compare",
    "export",
    "gate",
    "import_matrices",
    "judge",
    "load_scene",
    "own_matrices",
    "place",
    "random_gaps",
    "report",
    "run",
    "run_series",
    "shim",
    "solve",
    "solve_dual",
    "solve_series",
    "stresses",
    "tolerance",
    "validate",
]

check_solver = in_turn(check.run)
compare = in_turn(run_comparison.compare)
export = in_turn(files.export)
gate = in_turn(gates.gate)
import_matrices = in_turn(import_files.import_matrices)
judge = in_turn(plain_arrays.judge)
load_scene = in_turn(solution.load_scene)
own_matrices = in_turn(plain_arrays.own_matrices)
place = in_turn(placement.place)
random_gaps = in_turn(random_fields.random_gaps)
report = in_turn(suite_runs.report)
run = in_turn(suite_runs.run)
run_series = in_turn(load_case_series.run_series)
shim = in_turn(shimming.shim)
solve = in_turn(solution.solve)
solve_dual = in_turn(plain_arrays.solve_dual)
solve_series = in_turn(plain_arrays.solve_series)
stresses = in_turn(plate_stress.stresses)
tolerance = in_turn(limit_search.tolerance)
validate = in_turn(checks.validate)
