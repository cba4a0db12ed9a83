# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
A small map: the keypoints of a keyframe, fused with what other frames saw of them.

It is a view whose keypoints know more than one frame can tell. Each frame registered to it tells
their depths once more; the next keyframe takes over those it sees, each with its own uncertainty,
so that its points still lie where the keyframes before it put them.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.frames import depth
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration.refinement.tracks import Tracks
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Registration
from aick_ros.settings import Settings

_LASTING = 0.25  # share of a depth's variance that does not change from frame to frame
_BELIEVED = 9.0  # squared difference of two depths of one point, by its variance
_BELIEVED_POINT = 16.0  # the same of two positions
_APART = 6.0  # px; a keypoint nearer to one of the map is that one seen anew


class LocalMap:
    """Fuses keypoints over the frames and keyframes that see them; compare SingleFrame."""

    def __init__(self, settings: Settings) -> None:
        self._sensor = settings.sensor
        self._track_sigma = settings.refinement.track_sigma

    def register(self, registrar: Registrar, view: PreparedFrame, target: PreparedFrame,
                 expected: np.ndarray | None, elapsed: float) -> Registration:
        """Return where a view was, seen from the map, by the points of the map."""
        return registrar.place(view, target, expected, elapsed)

    def start(self, view: PreparedFrame) -> PreparedFrame:
        """
        Return the map that is one view.

        A point is what the image shows there, whatever the detector took it for: what is not
        known of it is its depth.
        """
        keypoints = view.keypoints
        positions = keypoints.positions.astype(np.float64)
        return _with(view, dataclasses.replace(
            keypoints, words=None, covariances=self._noise(positions, 0.0, view)))

    def update(self, view: PreparedFrame, registration: Registration) -> PreparedFrame:
        """
        Return the map with the depths that one more frame measured.

        :param view: the map.
        :param registration: of the frame, ``T_target_source`` from it to the map.
        """
        tracks, keypoints = registration.tracks, view.keypoints
        if tracks is None:
            return view
        T_camera_map = se3.inverse(registration.T_target_source)
        points = keypoints.positions[tracks.keypoints].astype(np.float64)
        covariances = keypoints.covariances[tracks.keypoints].astype(np.float64)
        seen = se3.transform(T_camera_map, points)[:, 2]
        along = covariances @ T_camera_map[2, :3]  # of the points with the depth that is seen
        variances = along @ T_camera_map[2, :3]
        variances += (depth.inverse_depth_sigma(seen, self._sensor) * seen ** 2) ** 2
        off = tracks.depths - seen
        with np.errstate(invalid='ignore'):
            believed = np.flatnonzero(off ** 2 < _BELIEVED * variances)
        numbers, along = tracks.keypoints[believed], along[believed]
        gain = along / variances[believed, None]
        fused = covariances[believed] - gain[:, :, None] * along[:, None, :]
        fused *= self._lasting(points[believed, 2], covariances[believed], fused)[:, None, None]
        positions, all_covariances = keypoints.positions.copy(), keypoints.covariances.copy()
        positions[numbers] += gain * off[believed, None]
        all_covariances[numbers] = fused
        return _with(view, dataclasses.replace(keypoints, positions=positions,
                                               covariances=all_covariances))

    def _lasting(self, z: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return by what to enlarge covariances so that no depth gets surer than it can be, N."""
        least = _LASTING * (depth.inverse_depth_sigma(z, self._sensor) * z ** 2) ** 2
        least = np.minimum(least, before[:, 2, 2])
        return np.maximum(least / np.maximum(after[:, 2, 2], 1e-12), 1.0)

    def propagate(self, view: PreparedFrame, new: PreparedFrame,
                  registration: Registration) -> PreparedFrame:
        """
        Return the map of a new keyframe: what it sees of the one before, and what is new to it.

        :param view: the map.
        :param new: the new keyframe.
        :param registration: of it, ``T_target_source`` from it to the map.
        """
        begun, tracks = self.start(new), registration.tracks
        if tracks is None or not len(tracks):
            return begun
        positions, covariances, kept = self._moved(view, new, registration, tracks)
        numbers = tracks.keypoints[kept]
        pixels = new.frame.camera.project(
            np.column_stack([tracks.rays[kept], np.ones(len(numbers))])).astype(np.float32)
        apart = np.linalg.norm(begun.keypoints.pixels[:, None] - pixels, axis=2)
        fresh = np.flatnonzero(apart.min(axis=1, initial=np.inf) > _APART)
        own = begun.keypoints
        return _with(new, KeypointFrame(
            own.stamp,
            np.concatenate([positions.astype(np.float32), own.positions[fresh]]),
            np.concatenate([view.keypoints.descriptors[numbers], own.descriptors[fresh]]),
            np.concatenate([covariances.astype(np.float32), own.covariances[fresh]]),
            np.concatenate([pixels, own.pixels[fresh]])))

    def _moved(self, view: PreparedFrame, new: PreparedFrame, registration: Registration,
               tracks: Tracks) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """
        Return what is known of tracked points in a new keyframe's frame.

        :returns: positions Kx3, covariances Kx3x3, and the K tracks they are of.
        """
        T_camera_map = se3.inverse(registration.T_target_source)
        rotation = T_camera_map[:3, :3]
        points = view.keypoints.positions[tracks.keypoints].astype(np.float64)
        positions = se3.transform(T_camera_map, points)
        by_pose = se3.point_jacobian(points @ rotation.T)
        pose = PoseWithCovariance(registration.T_target_source,
                                  registration.covariance).inverse().covariance
        covariances = (rotation @ view.keypoints.covariances[tracks.keypoints] @ rotation.T
                       + by_pose @ pose @ by_pose.transpose(0, 2, 1))
        seen = np.column_stack([tracks.rays, np.ones(len(tracks))]) * tracks.depths[:, None]
        kept = np.flatnonzero(np.isfinite(seen).all(axis=1))
        positions, covariances, seen = positions[kept], covariances[kept], seen[kept]
        noise = self._noise(seen, self._track_sigma, new)
        gain = covariances @ np.linalg.inv(covariances + noise)
        difference = seen - positions
        square = np.einsum('ni,nij,nj->n', difference, np.linalg.inv(covariances + noise),
                           difference)
        believed = square < _BELIEVED_POINT
        positions += np.einsum('nij,nj->ni', gain, difference)
        covariances -= gain @ covariances
        return positions[believed], covariances[believed], kept[believed]

    def _noise(self, positions: np.ndarray, pixel_sigma: float, view: PreparedFrame) -> np.ndarray:
        return depth.position_covariances(
            positions, np.full(len(positions), pixel_sigma), view.frame.camera,
            self._sensor).astype(np.float32)


def _with(view: PreparedFrame, keypoints: KeypointFrame) -> PreparedFrame:
    return dataclasses.replace(view, keypoints=keypoints)
