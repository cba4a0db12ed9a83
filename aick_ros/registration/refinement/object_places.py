# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Where the tracks of two frames show objects that move by themselves.

Tracks far from where a pose puts them are on such an object if most of their neighbours are far
off, too; wrong tracks lie scattered. To the object belongs the depth around its tracks that is
nearer to them than to those of the scene, where the source sees it and where the target did. The
window of a keypoint of the scene beside the object shows a part of both, and follows neither.
"""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM, Tracks

# All chosen on rendered rooms through which boards, people and stacks of cartons move.
_NEIGHBOURS = 15  # of a track, it among them
_REACH = 0.45  # of an object around its tracks, as a ratio to the distance from the camera


def on_objects(tracks: Tracks, are_far_off: np.ndarray, least_share: float) -> np.ndarray:
    """
    Return which tracks are on objects that move by themselves; none where too few are, or all.

    :param are_far_off: K bool, by the pose of the scene.
    :param least_share: of the tracks.
    :returns: K bool.
    """
    count = len(tracks)
    none = np.zeros(count, bool)
    fewest = max(FEWEST_TO_CONFIRM, least_share * count)
    if np.count_nonzero(are_far_off) < fewest:
        return none
    moving = as_neighbours(tracks.points, are_far_off)
    number = np.count_nonzero(moving)
    return moving if fewest <= number <= count - FEWEST_TO_CONFIRM else none


def as_neighbours(points: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return which points, Kx3, have mostly neighbours that are chosen, K bool."""
    size = min(_NEIGHBOURS, len(points))
    distances = _squared_distances(points, points)
    neighbours = np.argpartition(distances, size - 1, axis=1)[:, :size]
    mostly: np.ndarray = 2 * np.count_nonzero(chosen[neighbours], axis=1) > size
    return mostly


def places(tracks: Tracks, T_target_source: np.ndarray) -> np.ndarray:
    """Return where both frames see tracks, Nx3 in the source [m]."""
    return np.vstack([tracks.points, _seen(tracks, T_target_source)[1]])


def displacement(tracks: Tracks, T_target_source: np.ndarray) -> np.ndarray:
    """Return how far tracks have moved in the scene, the median in the source's axes, 3 [m]."""
    measured, seen = _seen(tracks, T_target_source)
    if not len(seen):
        return np.zeros(3)
    moved: np.ndarray = np.median(seen - tracks.points[measured], axis=0)
    return moved


def _seen(tracks: Tracks, T_target_source: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which tracks the target has a depth of, K bool, and where, Nx3 in the source [m]."""
    measured = np.isfinite(tracks.depths)
    return measured, se3.transform(
        se3.inverse(T_target_source), tracks[measured].seen_by_target(T_target_source))


def are_of_scene(points: np.ndarray, scene: np.ndarray, objects: np.ndarray) -> np.ndarray:
    """
    Return which points are not on objects, N bool.

    :param points: Nx3 [m]; ``scene`` and ``objects``: places of either, likewise.
    """
    to_scene, to_objects = (_squared_distances(points, to).min(axis=1, initial=np.inf)
                            for to in (scene, objects))
    of_scene: np.ndarray = (to_scene < to_objects) | (to_objects > (_REACH * points[:, 2]) ** 2)
    return of_scene


def are_beside(tracks: Tracks, points: np.ndarray, camera: Camera, reach: float) -> np.ndarray:
    """
    Return which tracks appear beside points of objects, K bool.

    :param points: Nx3, in the source [m].
    :param reach: in its image [px].
    """
    at, of_objects = (camera.fx * each[:, :2] / each[:, 2:] for each in (tracks.points, points))
    beside: np.ndarray = _squared_distances(at, of_objects).min(
        axis=1, initial=np.inf) < reach ** 2
    return beside


def _squared_distances(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the squared distances between points, NxM."""
    first, second = first.astype(np.float32), second.astype(np.float32)
    squares: np.ndarray = -2.0 * first @ second.T
    squares += np.square(first).sum(axis=1)[:, None]
    squares += np.square(second).sum(axis=1)
    return squares
