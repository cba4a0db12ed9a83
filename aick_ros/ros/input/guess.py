# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The guess: another odometry, the wheels' for example, that predicts a lost camera's motion."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from aick_ros.borders.names import quoted
from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.frame_tree import FrameTransform
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.ros.input.extrinsics import Extrinsic
from aick_ros.settings.node import NodeSettings

_LARGEST_GAP = NANOSECONDS // 200  # chosen: in which a robot moves by less than wheels slip
_WAITS_BETWEEN = 10  # chosen: a source that comes too late costs a tenth of the time at most
_LONGEST_UNKNOWN = NANOSECONDS  # of stamps [ns]; chosen: one late sample is no fault
_LONGEST_WAIT_AT_START = 5 * NANOSECONDS  # of stamps [ns]; chosen


class Finder(Protocol):
    """A source of transforms."""

    def find(self, target: str, source: str, stamp: int, wait: float = 0.0,
             largest_gap: int | None = None) -> FrameTransform | None:
        """Return the transform at a stamp [ns]; None: not known yet."""


class Mounted(Protocol):
    """A source of the pose of a camera on the robot."""

    def camera_in_base(self, camera_frame: str, stamp: int, wait: bool = True) -> Extrinsic:
        """Return pose and mount at a stamp [ns]."""


class Guess:
    """
    Pose of ``frame_id`` in ``guess_frame_id``, as TF reports it.

    It is known where its samples reach the stamp: the last one before would say that the robot
    stands still. It may wait for TF: never call it on the executor's thread. After a wait in vain
    there is none for ten times as long, or until one sample is in time: a silent source must not
    delay every frame.
    """

    def __init__(self, transforms: Finder, extrinsics: Mounted, settings: NodeSettings) -> None:
        self._transforms, self._extrinsics = transforms, extrinsics
        self._guess_frame, self._base_frame = settings.guess_frame_id, settings.frame_id
        self._longest_wait = settings.wait_for_transform
        self._waited_in_vain_at: int | None = None  # since it was last known
        self._unknown: tuple[int, int] | None = None  # first and last stamp since then
        self._was_known = False
        self._found(0)  # subscribes to /tf from the start

    @property
    def complaint(self) -> str:
        """That the pose has not been known for more than a second of stamps, '' where it is."""
        unknown = self._unknown
        if unknown is None or unknown[1] - unknown[0] <= _LONGEST_UNKNOWN:
            return ''
        since = ('has never been known' if not self._was_known else
                 f'has not been known for {(unknown[1] - unknown[0]) / NANOSECONDS:.0f} s')
        return (f'the transform from {quoted(self._base_frame)} to {quoted(self._guess_frame)} '
                f'(guess_frame_id) {since}: check that it is published on /tf and that the clocks '
                'agree, or raise wait_for_transform')

    def T_guess_base(self, stamp: int) -> np.ndarray | None:
        """Return the pose at a stamp [ns], 4x4; None: it is not known."""
        wait = self._wait_at(stamp)
        found = self._found(stamp, wait)
        if found is not None:
            self._waited_in_vain_at, self._unknown, self._was_known = None, None, True
            return found
        if wait > 0.0:
            self._waited_in_vain_at = stamp
        first = stamp if self._unknown is None else min(self._unknown[0], stamp)
        self._unknown = first, stamp
        return None

    def _wait_at(self, stamp: int) -> float:
        """Return how long to wait for the pose at a stamp [ns], in seconds."""
        if self._waited_in_vain_at is None:
            return self._longest_wait
        since = stamp - self._waited_in_vain_at
        pause = _WAITS_BETWEEN * self._longest_wait * NANOSECONDS
        return self._longest_wait if since < 0 or since >= pause else 0.0

    def _found(self, stamp: int, wait: float = 0.0) -> np.ndarray | None:
        try:
            found = self._transforms.find(self._guess_frame, self._base_frame, stamp, wait,
                                          _LARGEST_GAP)
        except InputError:
            return None
        return None if found is None else found.T_target_source

    def base_motion(self, before: int, now: int) -> np.ndarray | None:
        """Return ``T_base0_base1`` between two stamps [ns], 4x4; None: it is not known."""
        T_guess_base1 = self.T_guess_base(now)
        T_guess_base0 = self._found(before)  # what is not known by now never will be
        if T_guess_base0 is None or T_guess_base1 is None:
            return None
        motion: np.ndarray = se3.inverse(T_guess_base0) @ T_guess_base1
        return motion

    def camera_motion(self, camera_frame: str, before: int, now: int) -> np.ndarray | None:
        """
        Return ``T_camera0_camera1`` between two stamps [ns], 4x4; None: it is not known.

        A camera that moves on the robot has another extrinsic at each of the stamps.

        :param camera_frame: frame of the colour images.
        """
        T_base0_base1 = self.base_motion(before, now)
        if T_base0_base1 is None:
            return None
        try:
            start = self._extrinsics.camera_in_base(camera_frame, before, wait=False)
            end = self._extrinsics.camera_in_base(camera_frame, now)
        except InputError:
            return None
        motion: np.ndarray = (se3.inverse(start.T_base_camera) @ T_base0_base1
                              @ end.T_base_camera)
        return motion


class StartByGuess:
    """
    The pose at which the odometry starts: that of ``frame_id`` in ``guess_frame_id``.

    So both odometries begin in one frame. ``initial_pose`` takes precedence.

    :param guess: None: there is none.
    """

    def __init__(self, guess: Guess | None, settings: NodeSettings) -> None:
        self._guess = None if settings.initial_pose else guess
        self._frame = settings.guess_frame_id
        self.reset()

    def reset(self) -> None:
        """Look for the pose again, at the next frame."""
        self._since: int | None = None
        self._is_pending = self._guess is not None

    def cancel(self) -> None:
        """Go on where the odometry is: it has started, or been placed."""
        self._is_pending = False

    def pose(self, stamp: int) -> PoseWithCovariance | None:
        """
        Return the pose to start at with the frame of a stamp [ns]; None: where the odometry is.

        It is that of each frame until :meth:`cancel`: the first ones may be lost.

        :raises InputError: while the guess is not known; after 5 s it is no longer waited for.
        """
        if not self._is_pending or self._guess is None:
            return None
        T_guess_base = self._guess.T_guess_base(stamp)
        if T_guess_base is not None:
            return PoseWithCovariance(T_guess_base)
        if self._since is None or stamp < self._since:  # a bag that loops begins anew
            self._since = stamp
        if stamp - self._since < _LONGEST_WAIT_AT_START:
            raise InputError(
                f'the odometry starts at the pose in guess_frame_id = {self._frame!r}, which '
                'is not known yet: publish it on /tf, or set initial_pose')
        self._is_pending = False
        return None
