"""The quadratic programs: the data that load cases share, a class per form in problem.py, and here the forms
by name. (Imports none of them: the command line lists the names.)
"""

from collections.abc import Sequence
from typing import Literal, get_args

Form = Literal["primal", "dual", "sparse"]
FORMS: tuple[Form, ...] = get_args(Form)
#: The forms whose matrices are dense: what a solver takes that says nothing else.
DENSE_FORMS: tuple[Form, ...] = ("primal", "dual")


def form_family(form: Form) -> Literal["condensed", "sparse"]:
    """How the matrices of a form are made: condensed onto the junction, or taken as they are."""
    return "condensed" if form in DENSE_FORMS else "sparse"


def default_form(forms: Sequence[Form]) -> Form:
    """The form in which a solver is run by default: the dual, if it takes that."""
    return "dual" if "dual" in forms else forms[0]
