# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Errors of a pose by rolling shutters and by a delay, which displace what moving cameras see.

What a row sees is displaced by the velocity of the frame times the time from the stamp to the row.
Each residual follows that as it follows the pose, times that time, and the pose follows by the
normal equations. It is corrected; but velocities err, as they change within the intervals that
show them, and what is not known of a readout is not corrected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry.pose import at_point, in_axes
from aick_ros.registration.refinement.misalignment import Misalignment, image_height
from aick_ros.registration.refinement.residuals import (
    PRIOR, NormalEquations, PlaneResiduals, Residuals)
from aick_ros.registration.tracks import Tracks


@dataclass(frozen=True, eq=False)
class Solution:
    """
    A pose with the residuals that it is determined by.

    :param T_target_source: 4x4.
    :param keypoints: reprojection errors of the tracks.
    :param depth: distances between the depth images; one or none.
    :param gain: 6x6, by which the pose follows depth; keypoints by the rest.
    """

    T_target_source: np.ndarray
    tracks: Tracks
    keypoints: Residuals
    depth: Sequence[PlaneResiduals]
    gain: np.ndarray


class Shutters:
    """
    How a pose follows the velocities of its two frames through the rows of their images.

    :param solution: the pose.
    """

    def __init__(self, solution: Solution, source: PreparedFrame, target: PreparedFrame) -> None:
        self._solution, self._frames = solution, (source, target)
        rotation, translation = solution.T_target_source[:3, :3], solution.T_target_source[:3, 3]
        self._axes = in_axes(rotation), at_point(translation)
        self._heights = [image_height(frame.frame.camera) for frame in self._frames]
        tracks = solution.tracks
        seen = tracks.points, np.insert(tracks.rays, 2, 1.0, axis=1)
        self._by_keypoints = _mean_rows(
            solution.keypoints, [np.tile(_rows(points, height), 2)
                                 for points, height in zip(seen, self._heights)])

    def by_readout(self, twists: np.ndarray) -> np.ndarray:
        """
        Return by how much a pose that is not corrected errs, by the readout of colour, 6.

        :param twists: 2x6, body velocities of the source and of the target [m/s, rad/s].
        :returns: [m/s, rad/s].
        """
        source, target = (rows @ axes @ twist for rows, axes, twist in zip(
            self._by_keypoints, self._axes, twists))
        by_keypoints = source - target
        errors: np.ndarray = by_keypoints - self._solution.gain @ by_keypoints
        return errors

    def errors(self, misalignment: Misalignment, lag: float) -> np.ndarray:
        """
        Return the covariance of a pose by the errors of the two velocities, 6x6.

        :param misalignment: that the pose is corrected by, with its delay and its readouts.
        :param lag: mean time from the colour to the depth images, by their stamps [s].
        """
        gain, covariance = self._solution.gain, np.zeros((6, 6))
        by_depth = self._by_depth(misalignment.depth_readout)
        for number, (frame, axes) in enumerate(zip(self._frames, self._axes)):
            if frame.twist_variances is None:
                continue
            times = misalignment.colour_readout * self._by_keypoints[number]
            for rows in by_depth:
                late = (misalignment.delay + lag) * np.eye(6) + rows[number]
                times = times + gain @ (late - times)
            response = times @ axes
            covariance += (response * frame.twist_variances) @ response.T
        return covariance

    def _by_depth(self, readout: float) -> list[np.ndarray]:
        """Return the mean times of the rows of depth, one or none, 2x6x6 [s]."""
        if not readout:
            return [np.zeros((2, 6, 6)) for _ in self._solution.depth]
        pose = self._solution.T_target_source
        return [readout * _mean_rows(each, [_rows(points, height) for points, height in zip(
            ((each.points - pose[:3, 3]) @ pose[:3, :3], each.points), self._heights)])
            for each in self._solution.depth]


def _mean_rows(residuals: Residuals, rows: Sequence[np.ndarray]) -> np.ndarray:
    """
    Return the means of rows of residuals, weighted as the pose follows the residuals, 2x6x6.

    :param rows: of the source and of the target, N each.
    """
    late = [NormalEquations.of([replaced(residuals, weights=each * residuals.weights)]).information
            for each in rows]
    means: np.ndarray = np.linalg.solve(
        NormalEquations.of([residuals], PRIOR).information, np.array(late))
    return means


def _rows(points: np.ndarray, height: float) -> np.ndarray:
    """Return the rows that points project to, N: 0 on the optical axis, 1 is all rows."""
    rows: np.ndarray = np.clip(points[:, 1] / (points[:, 2] * height), -1.0, 1.0)
    return rows
