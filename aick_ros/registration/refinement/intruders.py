# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Objects that have moved into the view since an earlier frame.

That frame has seen through the space before its surfaces: what a later one has there is no part of
a static scene. The earlier frame has no keypoints on it, so that no track shows how it moves.
"""

from __future__ import annotations

import numpy as np

from aick_ros.frames import depth
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.registration.refinement import object_places
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM
from aick_ros.settings import SensorSettings

_NEARER = 1.0 + depth.LEAST_RISE
"""Ratio of the depths of a surface and of a point from which on the point is before it."""

_THERE = np.zeros((1, 2))
_AROUND = np.stack(np.meshgrid(*2 * [np.linspace(-0.0125, 0.0125, 5)]), -1).reshape(-1, 2)
"""Places around a point by the width of the image; the edge of a surface may be at any of them.
Chosen: 8 px at 640x480. On an excerpt of a real recording without objects, in which depth is taken
14 ms earlier than colour, some are found in 33 of 144 frames without it, and in none with it."""

_LEAST_SHARE = 0.1  # chosen: of the keypoints


def on_intruders(frame: PreparedFrame, earlier: PreparedFrame, T_earlier_frame: np.ndarray,
                 sensor: SensorSettings) -> np.ndarray:
    """
    Return which keypoints of a frame are on objects that have moved in since, N bool.

    None are where few are: errors at the edges of surfaces look alike, but lie scattered.

    :param T_earlier_frame: 4x4.
    """
    positions = frame.keypoints.positions
    points = se3.transform(T_earlier_frame, positions)
    are_nearer = np.ones(len(points), bool)
    for places in (_THERE, _AROUND):  # where nothing has moved in, the first alone is fast
        left = points[are_nearer]
        are_nearer[are_nearer] = _NEARER * left[:, 2] < np.fmin.reduce(
            _depths(earlier, left, places, sensor))
        if _are_few(are_nearer):
            return np.zeros(len(points), bool)
    return _together(positions, are_nearer)


def hidden_by_intruders(frame: PreparedFrame, earlier: PreparedFrame,
                        T_earlier_frame: np.ndarray, sensor: SensorSettings) -> np.ndarray:
    """
    Return which keypoints of an earlier frame are hidden by what is nearer now, N bool.

    That may be a part of the scene that the camera has moved behind, too.
    """
    positions = earlier.keypoints.positions
    points = se3.transform(se3.inverse(T_earlier_frame), positions)
    farthest = np.fmax.reduce(_depths(frame, points, _AROUND, sensor))
    return _together(positions, _NEARER * farthest < points[:, 2])


def _together(positions: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return which of some positions lie among others that are chosen, N bool; none if few do."""
    none = np.zeros(len(chosen), bool)
    if _are_few(chosen):
        return none
    together = object_places.as_neighbours(positions, chosen)
    return none if _are_few(together) else together


def _are_few(chosen: np.ndarray) -> bool:
    return int(np.count_nonzero(chosen)) < max(FEWEST_TO_CONFIRM, _LEAST_SHARE * len(chosen))


def _depths(frame: PreparedFrame, points: np.ndarray, places: np.ndarray,
            sensor: SensorSettings) -> np.ndarray:
    """Return the depths of a frame at K places around points, KxN [m]; NaN where it sees none."""
    depths, camera = np.full((len(places), len(points)), np.nan), frame.frame.camera
    ahead = np.flatnonzero(points[:, 2] > sensor.min_depth)
    pixels = camera.project(points[ahead])
    are_seen = np.all((pixels >= 0) & (pixels <= (camera.width - 1, camera.height - 1)), axis=1)
    around = pixels[are_seen] + camera.width * places[:, None]
    depths[:, ahead[are_seen]] = depth.sample(
        frame.frame.depth, around.reshape(-1, 2), sensor).reshape(around.shape[:2])
    return depths
