"""The rows of measurements.jsonl and problems.jsonl: names, kinds and vocabulary. The standard library alone.

A row of measurements.jsonl is one measurement. The harness writes its fields and the report reads them; both
take the names from here. A field that does not apply to a measurement is null.
"""

from dataclasses import dataclass
from types import NoneType
from typing import Any, Literal, TypedDict, get_args, get_origin, get_type_hints

#: In the key of a row that was measured in a round, before the time when that began.
ROUND = " round="

#: The file of a series, see series_file.py.
SERIES = "series.sqlite"

#: How a measurement ended. The first four are a solver's report on its answer.
Status = Literal[
    "solved",  # to its tolerance
    "inaccurate",  # an answer that misses the tolerance
    "iteration_limit",
    "failed",
    "time_limit",
    "memory_limit",
    "crashed",
    "unsupported",  # the solver does not take this form
    "not_run",  # not started; in rows until version 0.3.0
]
STATUSES: tuple[Status, ...] = get_args(Status)

#: The judge's verdict on an answer, from best to worst.
Verdict = Literal["within", "outside", "cannot_be_judged", "no_answer"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
ANSWERED = VERDICTS[:-1]

#: The words for whether an answer exceeds a limit of its user; None: its error is too large to tell.
EXCEEDED: dict[bool | None, str] = {True: "FAIL", False: "PASS", None: "cannot be told"}

#: The forms of the quadratic program, in the order of every table.
FORMS = ("sparse", "dual", "primal")
#: Those of the matrices condensed onto the junction.
DENSE_FORMS = ("dual", "primal")

#: The scenes that are rungs of ladders: hard/<ladder>/<rung> and hard-full/<ladder>/<rung>.
LADDERS = ("hard/", "hard-full/")
#: Those drawn at random: drawn/<n>/<k>, and sparse problems, sparse/<family>/<n>-<k>.
DRAWN, SPARSE = "drawn/", "sparse/"

#: The steps of a measurement, s; `form_s` is what the form costs per load case beside the solver.
STEPS = ("convert_s", "prepare_s", "setup_s", "solve_s", "form_s")

#: Who stands behind a solver, in the order of every table.
OWNERS = ("ours", "textbook", "library")


@dataclass(frozen=True)
class Judgement:
    """The judge's figures on an answer; one that does not apply is None.

    The formulas are in harness/verification/judge.py.

    Parameters
    ----------
    verdict : str
        "within" or "outside" the limit, "cannot_be_judged" or "no_answer".
    reference_bound_mm, displacement_error_mm : float, optional
        Proven error bound of the reference, and the distance of the answer to it, mm.
    contact_mismatch : int, optional
        Contacts open or closed by mistake.
    min_gap_mm, primal_residual : float, optional
        The smallest gap, and the largest overlap, mm.
    dual_residual : float, optional
        The largest unbalanced or pulling force, N.
    duality_gap : float, optional
        The primal minus the dual objective, N·mm.
    backward_error : float, optional
        Residual of the optimality conditions relative to their terms.
    objective : float, optional
        The primal objective, N·mm.
    """

    verdict: Verdict
    reference_bound_mm: float | None = None
    displacement_error_mm: float | None = None
    contact_mismatch: int | None = None
    min_gap_mm: float | None = None
    primal_residual: float | None = None
    dual_residual: float | None = None
    duality_gap: float | None = None
    backward_error: float | None = None
    objective: float | None = None


class Report(TypedDict, total=False):
    """The fields that the measuring process reports."""

    status: Status
    message: str | None  # why there is no answer, or no good one
    kernels: str | None  # the BLAS libraries loaded
    stderr: str | None  # its end
    device: str | None  # the CPU, or what the solver names
    answer: str | None  # the file of the answer, in the directory
    stages: str  # K, and which of `factors` and `Q` of the dense forms were opened
    iterations: int | None
    inner_iterations: int | None
    convert_s: float
    prepare_s: float
    setup_s: float
    solve_s: float
    form_s: float
    load_s: float  # to open or make the matrices and the loads, imports included
    model_s: float  # of load_s, to make them; null where they come from the cache
    solver_reported_s: float | None  # the solver's own figure
    data_mib: float | None  # memory before the solver begins
    peak_rss_mib: float | None
    threads: int | None  # in effect
    cholesky_s: float  # of Q, and
    product_s: float  # of Qv: how fast the machine is
    details: dict[str, Any]  # as the solver names them
    batched: int | None  # of a series: how many load cases were solved at once
    warm: bool  # of a series: whether others were solved before


class Provenance(TypedDict):
    """The code that made something."""

    commit: str  # the last that changed code, or the installed version
    clean: bool | None  # whether the code has no other changes; null if that is not known


class Origin(Provenance):
    """The code and the machine."""

    machine: str


class MeasurementRow(Report, Origin, total=False):
    """A row of measurements.jsonl, without the fields of its Judgement."""

    key: str  # identity of the measurement
    suite: str
    scene: str
    source: str  # what the scene is read from
    solver: str
    owner: str  # of OWNERS
    form: str
    variant: str
    tolerance: float
    iteration_limit: int | None  # in a suite with `trace`
    searched: bool  # the tolerance is one of those tried for the loosest that suffices
    repeat: int
    round: str | None  # when the round began in which it was measured again, beside others of its scene
    beside_round: str | None  # the round beside which it was measured
    options: dict[str, Any]
    gated: bool
    threads_asked: int
    batched_asked: int | None  # of a series: how many load cases were to be solved at once
    case: int | None  # of a series, its law:
    series: dict[str, Any] | None
    time_limit_s: float
    memory_limit_mib: int
    stop: str | None  # why time_limit_s is tighter than the suite's; in rows until version 0.3.0
    limit_mm: float  # for the displacement error, on a rung of a ladder computed; in the suite:
    limit_asked_mm: float

    n: int
    m: int
    active: int  # contacts closed
    scene_key: str  # a hash of what the scene is made of

    solver_version: str
    solver_code: str  # a hash of this project's code for the solver
    rivetbench_version: str
    recorded_at: str
    overhead_s: float | None  # of the measurement, beside load_s and the steps
    log: str | None  # the file of what the process printed, in the directory


#: The kind of a field in JSON. An object's names depend on the solver, the series or the scene.
Kind = Literal["number", "text", "flag", "object"]
KINDS: dict[Any, Kind] = {
    **dict.fromkeys((int, float), "number"),
    **dict.fromkeys((str, Literal), "text"),
    bool: "flag",
    dict: "object",
}


def kinds(row: type) -> dict[str, Kind]:
    """The kind of each field of a row."""
    hints = get_type_hints(row)
    types = {name: get_args(hint)[0] if NoneType in get_args(hint) else hint for name, hint in hints.items()}
    return {name: KINDS[get_origin(one) or one] for name, one in types.items()}


FIELDS = kinds(MeasurementRow) | kinds(Judgement)
#: Of a row of problems.jsonl, a scene and its reference. build_s : by step, see BUILDING. sparse : the facts
#: of a reference in the sparse form. refused : the message for a rung that the model should refuse, "" if it
#: is accepted.
PROBLEM_FIELDS: dict[str, Kind] = {
    **dict.fromkeys(("scene", "title", "scene_key", "reference_route", "refused", "printed_source"), "text"),
    "machine": "text",  # whose seconds these are; null in older rows, and in those of `refused`
    **dict.fromkeys(("n", "m", "active", "cond_K", "lambda_min", "lambda_max", "reference_s"), "number"),
    **dict.fromkeys(("reference_bound_mm", "printed_objective", "printed_digits"), "number"),
    **dict.fromkeys(("build_s", "stored_mib", "sparse"), "object"),
}
MEASURED = tuple(kinds(Report))

#: The steps of `build_s` by the stage that they make in the dense forms; the sparse form has one, `model`.
#: (`condition`, the spectrum of K, is for the report alone.)
BUILDING = {"K": ("condensation", "ties"), "factors": ("cholesky",), "Q": ("Q",)}


def fields_of_kind(kind: Kind) -> list[str]:
    """The names of the fields of a kind."""
    return [name for name, of in FIELDS.items() if of == kind]
