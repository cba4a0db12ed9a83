# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The IMU of a bag, whose samples go with the frames."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from aick_ros.borders.names import quoted
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.messages.imu import ImuBuffer, ImuMessage
from aick_ros.messages.imu_clock import ImuClock
from aick_ros.messages.synchronizer import Pair

Extrinsic = Callable[[str, str], np.ndarray | None]
"""From the frames of the colour images and of another sensor to ``T_colour_sensor``, or None."""

_FEWEST, _SHARE = 2, 0.25
"""Images from which the clock differs where it is another one, and their share of all.

Chosen: one may follow a stray stamp, and the first one of a camera below 1 Hz is behind; those
that reach the stamps of a clock that is ahead no longer differ."""


class BagImu:
    """
    Gives each frame the samples up to its stamp.

    Samples and images are in the order in which they were recorded, so that those of a frame may
    come after it: a pair waits for them, at most until the next pair.

    :param topic: of the samples; None: there are none.
    :param extrinsic: by which samples are turned into the axes of the camera; without it they
        are not used.
    """

    def __init__(self, topic: str | None, extrinsic: Extrinsic) -> None:
        self.topics = [] if topic is None else [topic]
        self._extrinsic = extrinsic
        self._buffer = ImuBuffer()
        self._held: Pair | None = None
        self._missing = ''
        self._clock = ImuClock()
        self._difference = ''  # of the clocks, as it was seen first
        self._compared = self._differing = 0  # images
        self._has_new = False  # whether a sample has come since the pair before

    @property
    def remarks(self) -> Sequence[str]:
        """Why the samples are not used, in one sentence; none where they are."""
        is_other = self._differing >= max(_FEWEST, _SHARE * self._compared)
        clock = self._difference if is_other else ''
        sentences = (self._missing, clock,
                     self._buffer.complaint(self.topics[0] if self.topics else ''))
        return [sentence for sentence in sentences if sentence][:1]

    def add(self, stamp: int, message: ImuMessage) -> Iterator[Pair]:
        """Add a sample with its stamp [ns], and yield the pair that it was missing for."""
        self._buffer.add(stamp, message)
        self._has_new = True
        if self._held is not None and self._is_reached(self._held):
            yield from self.flush()

    def wait(self, pairs: Iterable[Pair]) -> Iterator[Pair]:
        """Yield pairs in order, once their samples are there."""
        for pair in pairs:
            yield from self.flush()
            self._compare_clocks(pair.colour_stamp)
            if self._is_reached(pair):
                yield pair
            else:
                self._held = pair

    def flush(self) -> Iterator[Pair]:
        """Yield the pair that waits, if there is one."""
        if self._held is not None:
            pair, self._held = self._held, None
            yield pair

    def with_samples(self, frame: RgbdFrame, colour_frame: str) -> RgbdFrame:
        """Return a frame with the samples that have come since the one before."""
        if self._buffer.newest is None:
            return frame
        T_colour_imu = self._extrinsic(colour_frame, self._buffer.frame_id)
        if T_colour_imu is None:
            self._missing = (
                f'the IMU on {self.topics[0]} is not used, as no transform from '
                f'{quoted(self._buffer.frame_id)} (the IMU) to {quoted(colour_frame)} (the colour '
                'image) is on /tf_static: record it, too')
            return frame
        self._missing = ''
        return replace(frame, imu=self._buffer.take(T_colour_imu))

    def _compare_clocks(self, image: int) -> None:
        """Note whether the clock is another one, where samples still come; the image in [ns]."""
        if self._has_new and self._buffer.newest is not None:
            self._clock.compare(image, self._buffer.newest)
            complaint = self._clock.complaint(self.topics[0])
            self._compared += 1
            self._differing += bool(complaint)
            self._difference = self._difference or complaint
        self._has_new = False

    def _is_reached(self, pair: Pair) -> bool:
        newest = self._buffer.newest
        return not self.topics or newest is not None and newest >= pair.colour_stamp
