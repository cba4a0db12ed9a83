# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A recording with frames skipped, or as if colour and depth were taken at the same time."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from itertools import islice

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.sources import OnDamaged, RgbdSource


class Altered:
    """
    A source that changes another's frames.

    :param first: number of frames from the start; None: all.
    :param every: step between the frames used.
    :param one_clock: whether depth images lose their own stamps.
    """

    def __init__(self, source: RgbdSource, first: int | None = None, every: int = 1,
                 one_clock: bool = False) -> None:
        self.name, self.ground_truth = source.name, source.ground_truth
        self._source, self._one_clock = source, one_clock
        self._range = 0, first, every

    def __len__(self) -> int:
        """Return the number of frames, or an upper bound."""
        return len(range(len(self._source))[slice(*self._range)])

    def frames(self, on_damaged: OnDamaged) -> Iterator[RgbdFrame]:
        """Yield the frames that are left."""
        for frame in islice(self._source.frames(on_damaged), *self._range):
            yield dataclasses.replace(frame, depth_stamp=None) if self._one_clock else frame
