"""The rows of measurements.jsonl: names, kinds and vocabulary. The standard library alone.

One row per measurement. The harness writes these fields and the report reads them; both take the names
from here. A field that does not apply to a measurement is null.
"""

from __future__ import annotations

from typing import Literal, get_args

#: The file of a series, see series_file.py.
SERIES = "series.sqlite"

#: An object is a JSON object whose names depend on the solver or the series.
Kind = Literal["number", "text", "flag", "object"]

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
    "not_run",  # predicted to exceed the time limit, so not started
]
STATUSES: tuple[Status, ...] = get_args(Status)

#: The judge's verdict on an answer, from best to worst.
Verdict = Literal["within", "outside", "cannot_be_judged", "no_answer"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
ANSWERED = VERDICTS[:-1]

#: The forms of the quadratic program, in the order of every table.
FORMS = ("sparse", "dual", "primal")
#: Those of the matrices condensed onto the junction.
DENSE_FORMS = ("dual", "primal")

#: The scenes that are rungs of ladders: hard/<ladder>/<rung> and hard-full/<ladder>/<rung>.
LADDERS = ("hard/", "hard-full/")
#: Those drawn at random: drawn/<n>/<k>.
DRAWN = "drawn/"

#: The steps of a measurement, s; `form_s` is what the form costs per load case beside the solver.
STEPS = ("convert_s", "prepare_s", "setup_s", "solve_s", "form_s")


def _fields(kind: Kind, names: str) -> dict[str, Kind]:
    return dict.fromkeys(names.split(), kind)


#: Who stands behind a solver, in the order of every table.
OWNERS = ("ours", "textbook", "library")

#: What was requested. owner : of OWNERS; older rows have `in_house` instead.
#: stop : why time_limit_s is tighter than the suite's. searched : the tolerance is one of those tried for the
#: loosest that suffices.
ASKED: dict[str, Kind] = {
    **_fields("text", "key suite scene source solver owner form variant stop"),
    **_fields("number", "tolerance threads_asked repeat case time_limit_s memory_limit_mib"),
    **_fields("number", "limit_mm limit_asked_mm"),
    **_fields("object", "options series"),
    **_fields("flag", "gated in_house searched"),
}
#: The problem.
PROBLEM: dict[str, Kind] = {**_fields("number", "n m active"), **_fields("text", "scene_key")}
#: What the measuring process reports. load_s: to open or make the matrices and loads, imports included;
#: model_s: of that, to make them, null where they come from the cache. stages: K, and which of
#: `factors` and `Q` of the dense forms were opened.
MEASURED: dict[str, Kind] = {
    **_fields("text", "status message kernels stderr answer stages"),
    **_fields("number", "iterations inner_iterations"),
    **_fields("number", " ".join(STEPS)),
    **_fields(
        "number", "load_s model_s solver_reported_s data_mib peak_rss_mib threads cholesky_s product_s"
    ),
    **_fields("object", "details"),
}
#: The same for a case of a series: how many were solved at once, and whether others were solved before.
MEASURED_OF_CASES: dict[str, Kind] = {**_fields("number", "batched"), **_fields("flag", "warm")}
#: What the judge finds.
JUDGED: dict[str, Kind] = {
    **_fields("text", "verdict"),
    **_fields("number", "reference_bound_mm displacement_error_mm contact_mismatch min_gap_mm"),
    **_fields("number", "primal_residual dual_residual duality_gap backward_error objective"),
}
#: The checksum of a row, of older versions.
CRC = "crc32"

#: Where, when and by which code: `commit` is the project's, or the installed version's text.
ORIGIN: dict[str, Kind] = {
    **_fields("text", "machine solver_version solver_code rivetbench_version commit recorded_at"),
    **_fields("text", CRC),
    **_fields("number", "overhead_s"),
    **_fields("flag", "clean"),
}

FIELDS: dict[str, Kind] = {**ASKED, **PROBLEM, **MEASURED, **MEASURED_OF_CASES, **JUDGED, **ORIGIN}

#: The rows of problems.jsonl, one per scene.
PROBLEM_FIELDS: dict[str, Kind] = {
    **_fields("text", "scene title scene_key reference_route refused printed_source"),
    **_fields("number", "n m active cond_K lambda_min lambda_max reference_s reference_bound_mm"),
    **_fields("number", "printed_objective printed_digits"),
    **_fields("object", "build_s stored_mib sparse"),
}

#: The steps of `build_s` by the stage that they make in the dense forms; the sparse form has one, `model`.
#: (`condition`, the spectrum of K, is for the report alone.)
BUILDING = {"K": ("condensation", "ties"), "factors": ("cholesky",), "Q": ("Q",)}


def of_kind(kind: Kind) -> list[str]:
    """The names of the fields of a kind."""
    return [name for name, of in FIELDS.items() if of == kind]
