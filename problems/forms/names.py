"""The forms of the quadratic program, by name. (Imports nothing: the command line lists them.)

A new form is a class in problem.py and its name here.
"""

from collections.abc import Sequence
from typing import Literal, get_args

Form = Literal["primal", "dual", "sparse"]
FORMS: tuple[Form, ...] = get_args(Form)
#: The forms whose matrices are dense: what a solver takes that says nothing else.
DENSE_FORMS: tuple[Form, ...] = ("primal", "dual")


FormFamily = Literal["condensed", "sparse"]


def form_family(form: Form) -> FormFamily:
    """How the matrices of a form are made: condensed onto the junction, or taken as they are."""
    return "condensed" if form in DENSE_FORMS else "sparse"


def default_form(forms: Sequence[Form]) -> Form:
    """The form in which a solver is run by default: the dual, if it takes that."""
    return "dual" if "dual" in forms else forms[0]
