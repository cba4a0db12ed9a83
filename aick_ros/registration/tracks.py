# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keypoints of one frame found in another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros import kernels
from aick_ros.frames import depth
from aick_ros.geometry import se3
from aick_ros.settings import SensorSettings

FEWEST_TO_CONFIRM = 12
"""Tracks that confirm a pose: below this number the images say nothing about it.

Chosen: a pose needs three tracks, and up to half of all may be outliers.
"""


@dataclass(frozen=True, eq=False)
class Tracks:
    """
    Keypoints of the source seen in the target; all arrays are C-contiguous.

    :param keypoints: K indices of keypoints of the source.
    :param points: Kx3 float64, their positions in the source [m]: on the edge of a surface in
        front of another one, on that surface.
    :param rays: Kx2 float64, where the target sees them on the plane z = 1.
    :param depths: K float64, depth that the target measures there [m]; NaN where it has none.
    :param sigmas: K float64, standard deviation of the inverse depths of the points [1/m].
    """

    keypoints: np.ndarray
    points: np.ndarray
    rays: np.ndarray
    depths: np.ndarray
    sigmas: np.ndarray

    def __len__(self) -> int:
        """Return the number of tracks."""
        return len(self.keypoints)

    def displacement(self, focal_length: float) -> float:
        """Return the mean displacement of the tracks in an image of a focal length [px]."""
        return focal_length * kernels.mean_displacement(self.points, self.rays)

    def count_near(self, T_target_source: np.ndarray, most: float) -> int:
        """
        Return the number of tracks that are about where a pose puts them.

        :param most: distance on the plane z = 1.
        """
        return kernels.agreeing_tracks(self.points, self.rays, T_target_source, most)

    def reversed(self, sensor: SensorSettings) -> Tracks:
        """Return tracks with source and target swapped, where the target measures a depth."""
        most = len(self)
        keypoints, points = np.empty(most, np.int64), np.empty((most, 3))
        rays, depths, sigmas = np.empty((most, 2)), *np.empty((2, most))
        count = kernels.reversed_tracks(
            self.keypoints, self.points, self.rays, self.depths, self.sigmas,
            depth.noise(sensor), keypoints, points, rays, depths, sigmas)
        return Tracks(keypoints[:count], points[:count], rays[:count], depths[:count],
                      sigmas[:count])

    def __getitem__(self, chosen: np.ndarray) -> Tracks:
        """Return some of the tracks, by their indices or by a mask."""
        rows = np.arange(len(self))[chosen]
        return Tracks(self.keypoints.take(rows), self.points.take(rows, axis=0),
                      self.rays.take(rows, axis=0), self.depths.take(rows), self.sigmas.take(rows))

    def joined(self, others: Tracks) -> Tracks:
        """Return these tracks and others."""
        return Tracks(*(np.concatenate(both) for both in (
            (self.keypoints, others.keypoints), (self.points, others.points),
            (self.rays, others.rays), (self.depths, others.depths),
            (self.sigmas, others.sigmas))))

    def seen_by_target(self, T_target_source: np.ndarray) -> np.ndarray:
        """Return where the target sees them, Kx3 [m]: without a depth of its own, by the pose."""
        by_pose = se3.transform(T_target_source, self.points)[:, 2]
        depths = np.where(np.isfinite(self.depths), self.depths, by_pose)
        seen: np.ndarray = np.column_stack([self.rays, np.ones(len(self))]) * depths[:, None]
        return seen
