"""Seconds per load case relative to the fastest library, and to one Cholesky factorisation of Q."""

from __future__ import annotations

import pandas as pd

from report.results.reader import Results

PLACED = ["scene", "threads"]


def load_cases(results: Results) -> pd.DataFrame:
    """The rows within the limit, with `method`, the seconds per load case and their ratios.

    load_case_s : set-up + solve + form
    total_s : the same with the solver's own preparation, paid once per assembly
    to_cholesky : load_case_s over one Cholesky factorisation of Q in the same process
    to_library, total_to_library : over the fastest library on the same scene, in any form, by its median
    """
    rows = results.rows
    keys = ["scene", "solver", "form", "variant", "tolerance", "threads"]
    names = results.cells_by_threads()[[*keys, "method"]]
    cases = rows[rows["verdict"] == "within"].merge(names, on=keys)
    cases["load_case_s"] = cases[["setup_s", "solve_s", "form_s"]].sum(axis=1)
    cases["total_s"] = cases["load_case_s"] + cases[["convert_s", "prepare_s"]].sum(axis=1)
    cases["to_cholesky"] = cases["load_case_s"] / cases["cholesky_s"]
    libraries = cases[~cases["in_house"]].groupby([*PLACED, "method", "tolerance"])
    library = libraries[["load_case_s", "total_s"]].median().groupby(PLACED).min()
    cases = cases.join(library.add_prefix("library_"), on=PLACED)
    cases["to_library"] = cases["load_case_s"] / cases["library_load_case_s"]
    cases["total_to_library"] = cases["total_s"] / cases["library_total_s"]
    return cases
