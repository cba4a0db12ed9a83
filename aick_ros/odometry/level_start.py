# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The start of an odometry that is level by more than the first accelerations.

A camera that moves is accelerated, and its accelerometer has a bias: what it measures in one
moment is several degrees off what is up. The motion of the camera separates these within
seconds. Whoever can wait for that holds the first poses back, and turns them then.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Protocol, TypeVar

from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.inertial.level import Turn
from aick_ros.odometry.odometry import Odometry
from aick_ros.settings import ImuSettings

_KNOWN = 0.026
"""Standard deviation of the direction of gravity [rad] up to which a start is turned.

Chosen: on rendered rooms a start that is tilted by 4 to 7 deg is level by it to 1 deg within three
seconds. On two excerpts of real recordings, of an accelerometer that nobody has calibrated, 1.7
and 2.7 deg are left at the end: one start would be better by that, the other one worse."""


class Turnable(Protocol):
    """Result of an odometry at one frame; ``turned`` returns it in a frame that is level."""

    @property
    def stamp(self) -> int:
        """Stamp of the frame [ns]."""

    def turned(self: _Update, turn: Turn) -> _Update:
        """Return it in a frame that begins level."""


_Update = TypeVar('_Update', bound=Turnable)


class LevelWait:
    """
    Decides how long poses are held back.

    :param odometry: that has no frame yet, or was reset; it is left as level as it begins, until
        the wait ends.
    """

    def __init__(self, odometry: Odometry, settings: ImuSettings) -> None:
        self._odometry, self._settings = odometry, settings
        self.restart()

    def restart(self) -> None:
        """Wait again: the odometry was reset."""
        self._is_on = False  # at the frame before
        self._first: int | None = None  # stamp of the first frame that is held back
        if self._settings.level_wait > 0.0:
            self._odometry.gravity.hold()

    def configure(self, settings: ImuSettings) -> None:
        """Continue with other settings; a wait that they switch on begins with the next start."""
        self._settings = settings

    @property
    def complaint(self) -> str:
        """Reason for which poses are held back, in words; '' where none is."""
        gravity = self._odometry.gravity
        if not gravity.is_held:
            return ''
        sigma = math.degrees(gravity.tilt_sigma)
        known = f'known to {sigma:.1f} deg' if math.isfinite(sigma) else 'not known'
        return (f'odom is not published yet, to begin level: what is up is {known}, '
                f'{math.degrees(self._settings.level_sigma):.1f} deg are waited for')

    @property
    def is_interrupted(self) -> bool:
        """
        Begin of another recording at the newest frame, before the wait has ended.

        That frame is as level as it begins: :meth:`end` is for the poses before it alone.
        """
        return self._is_on and not self._odometry.gravity.is_held

    def goes_on(self, stamp: int) -> bool:
        """
        Return whether the pose of the newest frame is held back.

        It is not before a level start, where the odometry is not level, or where it has restarted.

        :param stamp: of the frame [ns].
        """
        gravity = self._odometry.gravity
        if not gravity.is_held:
            return False
        if self._first is None:
            self._first = stamp
        self._is_on = (gravity.tilt_sigma > self._settings.level_sigma
                       and seconds(self._first, stamp) < self._settings.level_wait)
        return self._is_on

    def end(self) -> Turn | None:
        """
        End the wait; the odometry has begun level then, if enough is known.

        :returns: the turn of its updates so far; None: they stay.
        """
        self._is_on = False
        return self._odometry.begin_level(max(_KNOWN, self._settings.level_sigma))


def begun_level(odometry: Odometry, settings: ImuSettings,
                updates: Iterable[_Update]) -> Iterator[_Update]:
    """
    Yield the updates of an odometry in a frame that is level from the first one on.

    They are held back until what is up is known to ``imu.level_sigma``, for ``imu.level_wait`` at
    most, or until another recording begins. Where there is no accelerometer each is yielded at
    once.

    :param updates: made as they are asked for, from the first frame of the odometry on.
    """
    wait, held = LevelWait(odometry, settings), list[_Update]()
    for update in updates:
        if wait.is_interrupted:
            yield from _turned(held, wait.end())
            held = []
        held.append(update)
        if not wait.goes_on(update.stamp):
            yield from _turned(held, wait.end())
            held = []
    yield from _turned(held, wait.end())


def _turned(updates: list[_Update], turn: Turn | None) -> list[_Update]:
    return updates if turn is None else [update.turned(turn) for update in updates]
