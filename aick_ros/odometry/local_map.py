# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Local map: the keypoints of a keyframe, fused with measurements of later frames.

It has the form of a prepared frame. Each frame registered to it measures the depths of its
keypoints once more. The next keyframe inherits those it observes, each with its covariance, so
that they keep the positions that earlier keyframes gave them.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.frames import depth
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.registration.refinement.tracks import Tracks
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Registration
from aick_ros.settings import Settings

# chosen on the two TUM excerpts and rendered rooms
_SYSTEMATIC_FRACTION = 0.25  # of the variance of a depth: constant from frame to frame
_DEPTH_GATE = 9.0  # maximum squared Mahalanobis distance of two depths of one point
_POINT_GATE = 16.0  # maximum squared Mahalanobis distance of two positions of one point
_MIN_SPACING = 6.0  # px; a keypoint nearer to an inherited one is the same point


class LocalMap:
    """Fusion of keypoints over frames and keyframes; compare SingleFrame."""

    def __init__(self, settings: Settings) -> None:
        self._sensor = settings.sensor
        self._track_sigma = settings.refinement.track_sigma

    def register(self, registrar: Registrar, prepared: PreparedFrame, local_map: PreparedFrame,
                 expected: np.ndarray | None, elapsed: float) -> Registration:
        """Return the registration of a frame to the map, by the points of the map."""
        return registrar.place(prepared, local_map, expected, elapsed)

    def start(self, prepared: PreparedFrame) -> PreparedFrame:
        """
        Return the map of one frame.

        A point is defined by its pixel in that frame: only its depth is uncertain.
        """
        keypoints = prepared.keypoints
        positions = keypoints.positions.astype(np.float64)
        return _with(prepared, dataclasses.replace(
            keypoints, words=None, covariances=self._noise(positions, 0.0, prepared)))

    def update(self, local_map: PreparedFrame, registration: Registration) -> PreparedFrame:
        """
        Return the map fused with the depths that one more frame measured.

        :param registration: of the frame to the map.
        """
        tracks, keypoints = registration.tracks, local_map.keypoints
        if tracks is None:
            return local_map
        T_camera_map = se3.inverse(registration.T_target_source)
        points = keypoints.positions[tracks.keypoints].astype(np.float64)
        covariances = keypoints.covariances[tracks.keypoints].astype(np.float64)
        predicted = se3.transform(T_camera_map, points)[:, 2]
        cross = covariances @ T_camera_map[2, :3]  # covariance of position and predicted depth
        variances = cross @ T_camera_map[2, :3]
        variances += (depth.inverse_depth_sigma(predicted, self._sensor) * predicted ** 2) ** 2
        innovation = tracks.depths - predicted
        with np.errstate(invalid='ignore'):
            accepted = np.flatnonzero(innovation ** 2 < _DEPTH_GATE * variances)
        numbers, cross = tracks.keypoints[accepted], cross[accepted]
        gain = cross / variances[accepted, None]
        fused = covariances[accepted] - gain[:, :, None] * cross[:, None, :]
        fused *= self._inflation(points[accepted, 2], covariances[accepted], fused)[:, None, None]
        positions, all_covariances = keypoints.positions.copy(), keypoints.covariances.copy()
        positions[numbers] += gain * innovation[accepted, None]
        all_covariances[numbers] = fused
        return _with(local_map, dataclasses.replace(
            keypoints, positions=positions, covariances=all_covariances))

    def _inflation(self, z: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return the factors, N, that keep the systematic part of depth variances."""
        systematic = _SYSTEMATIC_FRACTION * (
            depth.inverse_depth_sigma(z, self._sensor) * z ** 2) ** 2
        minimum = np.minimum(systematic, before[:, 2, 2])
        factors: np.ndarray = np.maximum(minimum / np.maximum(after[:, 2, 2], 1e-12), 1.0)
        return factors

    def propagate(self, local_map: PreparedFrame, prepared: PreparedFrame,
                  registration: Registration) -> PreparedFrame:
        """
        Return the map of a new keyframe: inherited points, then its own new ones.

        :param prepared: the new keyframe.
        :param registration: of it to the map.
        """
        own, tracks = self.start(prepared).keypoints, registration.tracks
        if tracks is None or not len(tracks):
            return _with(prepared, own)
        positions, covariances, kept = self._moved(
            local_map, prepared, registration, tracks)
        numbers = tracks.keypoints[kept]
        pixels = prepared.frame.camera.project(
            np.column_stack([tracks.rays[kept], np.ones(len(numbers))])).astype(np.float32)
        distances = np.linalg.norm(own.pixels[:, None] - pixels, axis=2)
        fresh = np.flatnonzero(distances.min(axis=1, initial=np.inf) > _MIN_SPACING)
        return _with(prepared, KeypointFrame(
            own.stamp,
            np.concatenate([positions.astype(np.float32), own.positions[fresh]]),
            np.concatenate(
                [local_map.keypoints.descriptors[numbers], own.descriptors[fresh]]),
            np.concatenate([covariances.astype(np.float32), own.covariances[fresh]]),
            np.concatenate([pixels, own.pixels[fresh]])))

    def _moved(self, local_map: PreparedFrame, prepared: PreparedFrame,
               registration: Registration, tracks: Tracks
               ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """
        Return tracked points in the frame of a new keyframe, fused with what it measured.

        :returns: positions Kx3, covariances Kx3x3, and the numbers of their tracks, K.
        """
        T_camera_map = se3.inverse(registration.T_target_source)
        rotation = T_camera_map[:3, :3]
        points = local_map.keypoints.positions[tracks.keypoints].astype(np.float64)
        positions = se3.transform(T_camera_map, points)
        by_pose = se3.point_jacobian(points @ rotation.T)
        pose = registration.pose.inverse().covariance
        covariances = (rotation @ local_map.keypoints.covariances[tracks.keypoints] @ rotation.T
                       + by_pose @ pose @ by_pose.transpose(0, 2, 1))
        rays = np.column_stack([tracks.rays, np.ones(len(tracks))])
        measured = rays * tracks.depths[:, None]
        kept = np.flatnonzero(np.isfinite(measured).all(axis=1))
        positions, covariances, measured = (
            positions[kept], covariances[kept], measured[kept])
        noise = self._noise(measured, self._track_sigma, prepared)
        gain = covariances @ np.linalg.inv(covariances + noise)
        difference = measured - positions
        square = np.einsum('ni,nij,nj->n', difference, np.linalg.inv(covariances + noise),
                           difference)
        accepted = square < _POINT_GATE
        positions += np.einsum('nij,nj->ni', gain, difference)
        covariances -= gain @ covariances
        return positions[accepted], covariances[accepted], kept[accepted]

    def _noise(self, positions: np.ndarray, pixel_sigma: float,
               prepared: PreparedFrame) -> np.ndarray:
        return depth.position_covariances(
            positions, np.full(len(positions), pixel_sigma), prepared.frame.camera,
            self._sensor).astype(np.float32)


def _with(prepared: PreparedFrame, keypoints: KeypointFrame) -> PreparedFrame:
    return dataclasses.replace(prepared, keypoints=keypoints)
