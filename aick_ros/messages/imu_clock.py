# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Comparison of the stamps of an IMU with those of the images."""

from __future__ import annotations

from aick_ros.geometry.stamps import NANOSECONDS

_OTHER_CLOCK = NANOSECONDS  # chosen: longer than a sample is late, or an image
_INTERVALS = 3  # of the camera; chosen: an image may wait for the two after it


class ImuClock:
    """Finds out whether the samples of an IMU are stamped by another clock than the images."""

    def __init__(self) -> None:
        self._oldest: int | None = None  # stamp of the last sample at the first image [ns]
        self._image: int | None = None  # stamp of the last image [ns]
        self._behind = 0  # of the newest sample; below 0: ahead [ns]
        self._limit = _OTHER_CLOCK

    def compare(self, image: int, newest: int) -> None:
        """
        Note how far all samples are from an image.

        :param image: stamp of the image [ns].
        :param newest: stamp of the last sample that has come [ns].
        """
        if self._oldest is None or newest < self._oldest:  # a bag that loops begins anew
            self._oldest = newest
        interval = 0 if self._image is None else image - self._image
        self._image, self._limit = image, max(_OTHER_CLOCK, _INTERVALS * interval)
        # images may wait for long: newer samples alone say nothing
        behind, ahead = image - newest, self._oldest - image
        self._behind = behind if behind >= ahead else -ahead

    def complaint(self, topic: str) -> str:
        """Return how far the stamps differ, in one sentence; '' where the clock is the same."""
        if abs(self._behind) <= self._limit:
            return ''
        return (f'the samples of the IMU on {topic} are stamped '
                f'{abs(self._behind) / NANOSECONDS:.1f} s '
                f'{"behind" if self._behind > 0 else "ahead of"} the images and are not used: let '
                'both drivers stamp by one clock')
