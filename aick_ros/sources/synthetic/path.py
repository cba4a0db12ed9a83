# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The path of a camera in somebody's hand."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import se3
from aick_ros.sources.synthetic.scene import Zone
from aick_ros.sources.synthetic.wander import Wander

# shares of the amplitude and frequencies [Hz]: walking about, swaying, reaching
_POSITION = ((0.6, 0.05, 0.09), (0.3, 0.12, 0.2), (0.07, 0.3, 0.5))
_YAW = ((0.75, 0.02, 0.035), (0.2, 0.08, 0.14), (0.05, 0.3, 0.5))
_TILT = ((0.7, 0.08, 0.15), (0.25, 0.25, 0.4), (0.05, 0.6, 0.9))
_TREMOR = ((0.5, 2.0, 3.5), (0.5, 3.5, 6.0))

_YAW_SWEEP, _PITCH_SWEEP, _ROLL_SWEEP = np.radians([150.0, 17.0, 5.0])
_MEAN_PITCH = np.radians(-18.0)
_HAND_SHAKE = 0.001  # [m]
_HAND_TURN = np.radians(0.12)


class HandheldPath:
    """
    A smooth, endless path in six degrees of freedom through a zone.

    Walks slowly, looks around and a little down, and trembles.
    """

    def __init__(self, rng: np.random.Generator, zone: Zone) -> None:
        self._zone = zone
        half = (zone.high - zone.low) / 2 - _HAND_SHAKE
        self._position = [Wander(rng, amplitude, _POSITION) for amplitude in half]
        self._heading = rng.uniform(-np.pi, np.pi)
        sweeps = (_YAW_SWEEP, _YAW), (_PITCH_SWEEP, _TILT), (_ROLL_SWEEP, _TILT)
        self._attitude = [Wander(rng, *sweep) for sweep in sweeps]
        self._shake = [Wander(rng, _HAND_SHAKE, _TREMOR) for _ in range(3)]
        self._turn = [Wander(rng, _HAND_TURN, _TREMOR) for _ in range(3)]

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` of the optical frame at a time [s]."""
        yaw, pitch, roll = (wander.at(time) for wander in self._attitude)
        pose = np.eye(4)
        pose[:3, :3] = attitude(self._heading + yaw, _MEAN_PITCH + pitch, roll)
        pose[:3, :3] = pose[:3, :3] @ se3.exp_rotation([w.at(time) for w in self._turn])
        pose[:3, 3] = self._zone.centre + [
            walk.at(time) + shake.at(time) for walk, shake in zip(self._position, self._shake)]
        return pose


def attitude(yaw: float, pitch: float, roll: float) -> np.ndarray:
    """Return the rotation of an optical frame that looks along yaw, upwards by pitch."""
    forward = np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
    right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    level = np.column_stack([right, np.cross(forward, right), forward])
    rotation: np.ndarray = level @ se3.exp_rotation((0, 0, roll))
    return rotation
