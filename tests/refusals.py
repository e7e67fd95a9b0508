"""The error for an input that is refused."""

from collections.abc import Callable
from typing import Any

import pytest

from problems.errors import InputError


def refusal_of(call: Callable[..., Any], *arguments: Any, **options: Any) -> InputError:
    """The error that the call raises, with its faults."""
    with pytest.raises(InputError) as caught:
        call(*arguments, **options)
    return caught.value
