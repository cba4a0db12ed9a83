# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Detection of stray stamps in a stream of images, live or recorded."""

from __future__ import annotations

from aick_ros.geometry.stamps import MAX_STAMP, NANOSECONDS
from aick_ros.messages.missing_images import MissingImages

_FAR = 10 * NANOSECONDS  # [ns] beyond the time passed; chosen


class StampMonitor:
    """Checks the stamps of one stream as its images arrive, and counts the missing ones."""

    def __init__(self) -> None:
        self._last: tuple[int, float] | None = None  # accepted stamp [ns] and its arrival [s]
        self._stray: int | None = None  # the previous stamp [ns], where it was rejected
        self._missing = MissingImages()

    def check(self, stamp: int, now: float) -> str:
        """
        Return why the next image cannot be used, '' where it can.

        A stamp is stray where it is more than 10 s further ahead of the last one than the time
        that has passed. If the next stamp follows it within 10 s, the clock was set, and the
        stream goes on from there. One stray stamp, if accepted, would make consumers of TF
        reject everything that follows.

        :param stamp: of the image [ns]; going back is no fault here.
        :param now: when the image arrived or was recorded, by a steady clock [s].
        """
        if stamp <= 0:
            return f'its stamp is {stamp} ns; the driver must stamp its images'
        if stamp > MAX_STAMP - NANOSECONDS:
            return (f'its stamp of {stamp} ns is in the last second that a message can have; the '
                    'driver must stamp its images')
        if self._is_stray(stamp, now):
            self._stray = stamp
            return (f'its stamp of {stamp} ns is far ahead of those before; if the clock was set, '
                    'the next one is taken')
        self._last, self._stray = (stamp, now), None
        self._missing.add(stamp)
        return ''

    @property
    def missing(self) -> int:
        """Number of images missing so far, as :attr:`MissingImages.count`."""
        return self._missing.count

    @property
    def missing_share(self) -> float:
        """Share of images missing in the last 100 gaps, as :attr:`MissingImages.share`."""
        return self._missing.share

    def _is_stray(self, stamp: int, now: float) -> bool:
        if self._last is None:
            return False
        passed = round((now - self._last[1]) * NANOSECONDS)
        confirms_stray = self._stray is not None and 0 <= stamp - self._stray <= _FAR
        return stamp - self._last[0] - passed > _FAR and not confirms_stray
