# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The odometry of the wheels, as TF tells it: it goes on where the camera is lost."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.settings.node import NodeSettings


class Finder(Protocol):
    """Knows the transforms of the robot."""

    def find(self, target: str, source: str, stamp: int, wait: float = 0.0) -> np.ndarray | None:
        """Return ``T_target_source`` at a stamp [ns]; None: not known yet."""


class Guess:
    """
    Where ``frame_id`` is in ``guess_frame_id``.

    It may wait: not for the executor's thread.
    """

    def __init__(self, transforms: Finder, settings: NodeSettings) -> None:
        self._transforms = transforms
        self._guess_frame, self._base_frame = settings.guess_frame_id, settings.frame_id
        self._patience, self._wait = settings.wait_for_transform, 0.0
        self.T_guess_base(0)  # so that TF is listened to from the start
        self._wait = self._patience

    def T_guess_base(self, stamp: int) -> np.ndarray | None:
        """Return the pose by the wheels at a stamp [ns], 4x4; None: they tell none."""
        try:
            found = self._transforms.find(
                self._guess_frame, self._base_frame, stamp, self._wait)
        except InputError:
            found = None
        # of what is silent one does not wait again for each frame
        self._wait = 0.0 if found is None else self._patience
        return found

    def motion(self, before: int, now: int) -> np.ndarray | None:
        """Return ``T_base0_base1`` between two stamps [ns]; None: the wheels do not tell it."""
        T_guess_base0, T_guess_base1 = self.T_guess_base(before), self.T_guess_base(now)
        if T_guess_base0 is None or T_guess_base1 is None:
            return None
        return se3.inverse(T_guess_base0) @ T_guess_base1
