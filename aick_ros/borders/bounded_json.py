# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""JSON of results, with numbers that can be computed with."""

from __future__ import annotations

import json
from typing import Any, NoReturn

_LARGEST = 1e100  # chosen: squares of numbers, and sums of these, do not overflow


def bounded_json(text: str) -> Any:
    """
    Return the content of JSON.

    :raises ValueError: where it is none, is nested too deep for Python, or has NaN or a number
        that is too large.
    """
    try:
        return json.loads(text, parse_constant=_rejected, parse_float=_bounded,
                          parse_int=_bounded_integer)
    except RecursionError:
        raise ValueError('it is nested too deep') from None


def _bounded(text: str) -> float:
    number = float(text)
    if not abs(number) <= _LARGEST:
        raise ValueError(f'{text[:30]} is too large')
    return number


def _bounded_integer(text: str) -> int:
    _bounded(text)
    return int(text)


def _rejected(name: str) -> NoReturn:
    raise ValueError(f'{name} is no number of JSON')
