# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The last results of a function of an object, as of a frame."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Generic, TypeVar

_Object = TypeVar('_Object')
_Result = TypeVar('_Result')


class LastResults(Generic[_Object, _Result]):
    """
    Remembers what a function has returned for the last objects, which must not change.

    A result is forgotten with its object, as those of frames before a reset are. Other than by
    ``functools.lru_cache``, whoever has one can be pickled; the copy remembers nothing.

    :param make: the function, pure, of objects that are equal to themselves alone.
    :param count: number of objects whose results are remembered.
    """

    def __init__(self, make: Callable[[_Object], _Result], count: int) -> None:
        self._make, self._count = make, count
        self._known: list[tuple[weakref.ref[_Object], _Result]] = []  # the last one at the end
        results = weakref.ref(self)  # which forgets without a cycle

        def forget(item: weakref.ref[_Object]) -> None:
            if (remembering := results()) is not None:
                remembering._known = [one for one in remembering._known if one[0] is not item]

        self._forget = forget

    def __call__(self, item: _Object) -> _Result:
        """Return what the function returns for an object."""
        for known in self._known:
            if known[0]() is item:
                if known is not self._known[-1]:
                    self._known = [*(one for one in self._known if one is not known), known]
                return known[1]
        result = self._make(item)
        self._known = [*self._known, (weakref.ref(item, self._forget), result)][-self._count:]
        return result

    def knows(self, item: _Object) -> bool:
        """Return whether the result of an object is remembered."""
        return any(reference() is item for reference, _ in self._known)

    def __getstate__(self) -> tuple[Callable[[_Object], _Result], int]:
        """Return what a copy has."""
        return self._make, self._count

    def __setstate__(self, state: tuple[Callable[[_Object], _Result], int]) -> None:
        """Become a copy."""
        LastResults.__init__(self, *state)
