# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The last results of a function of an object, as of a frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

_Object = TypeVar('_Object')
_Result = TypeVar('_Result')


class LastResults(Generic[_Object, _Result]):
    """
    Remembers what a function has returned for the last objects, which must not change.

    Other than by ``functools.lru_cache``, whoever has one can be pickled.

    :param make: the function, pure.
    :param count: number of objects whose results are remembered.
    """

    def __init__(self, make: Callable[[_Object], _Result], count: int) -> None:
        self._make, self._count = make, count
        self._known: list[tuple[_Object, _Result]] = []

    def __call__(self, item: _Object) -> _Result:
        """Return what the function returns for an object."""
        for i, (known, result) in enumerate(self._known):
            if known is item:
                self._known.append(self._known.pop(i))
                return result
        result = self._make(item)
        self._known = [*self._known, (item, result)][-self._count:]
        return result
