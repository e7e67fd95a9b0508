"""Numbers as text: three significant digits, '–' if there is none."""

import math
from collections.abc import Callable, Mapping, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

MISSING = "–"
ROUNDING = 2.0**-44  # of the largest value: what is smaller is rounding


def significant(value: object, digits: int = 3) -> str:
    """0.0912, 12.3, 1230; with a power of ten (4.1e-9) below 0.001 and from 100 000."""
    number = as_number(value)
    if not number:
        return power(number)
    rounded = nearest(number, digits)
    exponent = math.floor(math.log10(abs(rounded)))
    if not -3 <= exponent < 5:
        return power(number, digits)
    return f"{rounded:.{max(0, digits - 1 - exponent)}f}"


def nearest(value: float, digits: int = 3) -> float:
    """A value rounded to so many digits."""
    return float(f"{value:.{digits - 1}e}")


def raised(bound: object, digits: int = 3) -> float | None:
    """A bound rounded upwards to so many digits, so that what is printed is no less; None without one."""
    number = as_number(bound)
    if not number:
        return number
    rounded = Decimal(f"{number:.{digits - 1}e}")
    return float(rounded if float(rounded) >= number else rounded.next_plus(Context(prec=digits)))


def upwards(bound: float, digits: int = 2) -> str:
    """3.3e-16: a bound above 3.2e-16, never less than it is."""
    shown = raised(bound, digits)
    return f"{bound if shown is None else shown:.{digits - 1}e}"


def percent_interval(interval: Sequence[float], decimals: int = 1) -> str:
    """'94.0 to 98.5 %' of two shares, rounded outwards, so that what is printed covers the interval."""
    ways = zip(interval, (ROUND_FLOOR, ROUND_CEILING), strict=True)
    low, high = (Decimal(100 * share).quantize(Decimal(10) ** -decimals, way) for share, way in ways)
    return f"{low} to {high} %"


def position(place: Sequence[float], nodes: NDArray[np.float64]) -> str:
    """'(1077.93, 0) mm', to 0.01 mm; on nodes within less than a metre, to 1e-5 of their extent."""
    extent = float(np.ptp(nodes, axis=0).max())
    decimals = max(2, 5 - math.ceil(math.log10(extent))) if extent > 0 else 2
    return f"({', '.join(f'{round(float(value), decimals) + 0.0:.10g}' for value in place)}) mm"


def coordinate(value: object) -> str:
    """1077.93, 30: a place on a part, mm, to 0.01 mm."""
    number = as_number(value)
    return MISSING if number is None else f"{round(number, 2) + 0.0:.10g}"


def extent(values: NDArray[np.float64]) -> str:
    """'0.012 … 0.73': the least and the largest value. Zero, where the least is but rounding."""
    low, high = float(values.min()), float(values.max())
    return f"{significant(without_rounding(low, high))} … {significant(high)}"


def without_rounding(least: float, largest: float) -> float:
    """The least of some values, or zero where it is but rounding of the largest."""
    return 0.0 if abs(least) <= ROUNDING * abs(largest) else least


def digits_beside(
    limit: float, value: float, least: int = 3, rounded: Callable[[float, int], float | None] = nearest
) -> int:
    """How many digits, at least so many, show a rounded value on its side of a limit."""
    return next(k for k in range(least, 18) if ((rounded(value, k) or 0.0) > limit) == (value > limit))


def error_beside(limit: float, error: float) -> str:
    """1.00004e-07 beside 1e-07: four digits, or as many as show an error on its side of a limit."""
    return f"{error:.{digits_beside(limit, error, least=4) - 1}e}"


def limit_beside(error: float | None, limit: float) -> str:
    """1e-07: three digits, or as many as show a limit on its side of an error."""
    return f"{limit:.{3 if error is None else digits_beside(error, limit)}g}"


def beside(limit: float, rounded: Callable[[float, int], float | None] = nearest) -> Callable[[object], str]:
    """Shows values with the digits that show them on their sides of a limit, and infinite ones as inf.

    rounded : `raised` for bounds, so that what is shown is never less than the bound.
    """

    def shown(value: object) -> str:
        number = as_number(value)
        if number is None:
            return "inf" if value == math.inf else MISSING
        digits = digits_beside(limit, number, rounded=rounded)
        return significant(rounded(number, digits), digits)

    return shown


def proven_to(error: object, unit: str = "mm") -> str:
    """'proven to 3.3e-16 mm', or 'not proven' without an error or with an infinite one."""
    number = as_number(error)
    return "not proven" if number is None else f"proven to {upwards(number)} {unit}"


def power(value: object, digits: int = 3) -> str:
    """4.10e-9: always with a power of ten, without leading zeros in it."""
    number = as_number(value)
    if number is None:
        return MISSING
    if number == 0:
        return "0"
    mantissa, exponent = f"{number:.{digits - 1}e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def tidy_power(value: object) -> str:
    """1e-7, 2.5e-7: with a power of ten and no more digits than needed."""
    mantissa, _, exponent = power(value).partition("e")
    return f"{float(mantissa):g}e{exponent}" if exponent else mantissa


def whole(value: object) -> str:
    number = as_number(value)
    return MISSING if number is None else f"{number:.0f}"


def as_number(value: object) -> float | None:
    """The value as a float; None if it is missing, not finite or not a number."""
    if isinstance(value, bool) or value is None:
        return None
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None


def listed(words: list[str]) -> str:
    """'a', 'a and b', 'a, b and c'."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def span(least: str, most: str) -> str:
    """'3 to 8', or '3' if both are the same."""
    return least if least == most else f"{least} to {most}"


def spread(name: str) -> Callable[[Mapping[str, Any]], str]:
    """For a row, '0.12 (0.1 to 0.2)': its value of that name, and those with the endings _least and _most."""

    def text(row: Mapping[str, Any]) -> str:
        middle = significant(row[name])
        least, most = (significant(row[f"{name}_{end}"], 2) for end in ("least", "most"))
        return middle if middle == MISSING else f"{middle} ({span(least, most)})"

    return text


def counted(number: int, word: str) -> str:
    """'1 scene', '2 scenes'."""
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def out_of(number: int, whole: int, word: str) -> str:
    """'2 of 60 rows', 'none of 60 rows'."""
    return f"{number or 'none'} of {counted(whole, word)}"
