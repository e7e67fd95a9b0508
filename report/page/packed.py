"""Columns and arrays in few bytes, as the page unpacks them."""

from __future__ import annotations

import zlib
from base64 import b64encode
from typing import Any

import numpy as np
import pandas as pd

from report.results.series import Array

Data = dict[str, Any]
DIGITS = 1 << 11  # what is dropped of a float32's mantissa: 3.6 decimal digits are left


def column(values: pd.Series[Any]) -> list[Any] | Data:
    """Numbers as they are, missing ones null; texts as their distinct values and the place of each."""
    if pd.api.types.is_numeric_dtype(values.dtype):
        return [None if pd.isna(value) else float(value) for value in values]
    texts = ["" if value is None or value != value else str(value) for value in values]
    distinct = {text: place for place, text in enumerate(dict.fromkeys(texts))}
    return {"distinct": list(distinct), "places": [distinct[text] for text in texts]}


def packed(values: Array) -> str:
    """An array for a map, of about four digits: base64 of deflated little-endian float32."""
    bits = np.ascontiguousarray(values, "<f4").view("<u4")
    finite = np.isfinite(values).ravel()
    rounded = bits.ravel().copy()
    rounded[finite] = (rounded[finite] + DIGITS // 2) & ~np.uint32(DIGITS - 1)
    return b64encode(zlib.compress(rounded.tobytes(), 9)).decode()


def exact(values: Array) -> str:
    """The same with all digits of a float32, for coordinates."""
    return b64encode(zlib.compress(np.ascontiguousarray(values, "<f4").tobytes(), 9)).decode()
