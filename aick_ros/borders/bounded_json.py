# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""JSON with numbers that can be computed with, in which no name is given twice."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any, NoReturn

from aick_ros.borders.names import quoted

_LARGEST = 1e100  # chosen: squares of numbers, and sums of these, do not overflow


def bounded_json(text: str) -> Any:
    """
    Return the content of JSON.

    :raises ValueError: where it is none, is empty, is nested too deep for Python, has NaN or a
        number that is too large, or an object with a name twice.
    """
    if not text.strip():
        raise ValueError('it is empty')
    try:
        return json.loads(text, parse_constant=_rejected, parse_float=_bounded,
                          parse_int=_bounded_integer, object_pairs_hook=of_different_names)
    except RecursionError:
        raise ValueError('it is nested too deep') from None


def of_different_names(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """
    Return an object of JSON; the standard library would keep the last value of each name.

    :raises ValueError: where a name is there twice.
    """
    content = dict(pairs)
    if len(content) < len(pairs):
        twice, _ = Counter(name for name, _ in pairs).most_common(1)[0]
        raise ValueError(f'it has {quoted(twice)} twice: remove one')
    return content


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
