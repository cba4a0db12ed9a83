# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The last results of a function of a frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from aick_ros.frames.rgbd import RgbdFrame

_Result = TypeVar('_Result')


class LastResults(Generic[_Result]):
    """
    Remembers what a function has returned for the last frames.

    Other than by ``functools.lru_cache``, whoever has one can be pickled.

    :param make: the function, pure.
    :param count: number of frames that are remembered.
    """

    def __init__(self, make: Callable[[RgbdFrame], _Result], count: int) -> None:
        self._make, self._count = make, count
        self._known: list[tuple[RgbdFrame, _Result]] = []

    def __call__(self, frame: RgbdFrame) -> _Result:
        """Return what the function returns for a frame."""
        for i, (known, result) in enumerate(self._known):
            if known is frame:
                self._known.append(self._known.pop(i))
                return result
        result = self._make(frame)
        self._known = [*self._known, (frame, result)][-self._count:]
        return result
