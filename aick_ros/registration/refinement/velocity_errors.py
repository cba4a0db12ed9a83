# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Errors of a pose by those of the velocities that it is corrected by.

A delay and a rolling shutter displace what a frame sees by its velocity, in proportion to the time
between the frame and a row. The velocity errs, as it changes within the interval that shows it.
Each residual follows that error as it follows the pose, times that time, and the pose follows by
the normal equations.
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

_BOTH_COORDINATES = 2  # by definition: of a reprojection error


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


def errors_of_velocities(solution: Solution, source: PreparedFrame, target: PreparedFrame,
                         misalignment: Misalignment, lag: float) -> np.ndarray:
    """
    Return the covariance of a pose by the errors of the velocities of its two frames, 6x6.

    :param misalignment: that the pose is corrected by, with its delay and its readouts.
    :param lag: mean time from the colour to the depth images, by their stamps [s].
    """
    rotation, translation = solution.T_target_source[:3, :3], solution.T_target_source[:3, 3]
    tracks, points = solution.tracks, [each.points for each in solution.depth]
    seen = ((tracks.points, [(each - translation) @ rotation for each in points]),
            (np.insert(tracks.rays, 2, 1.0, axis=1), points))
    covariance = np.zeros((6, 6))
    for frame, (of_keypoints, of_depth), axes in zip(
            (source, target), seen, (in_axes(rotation), at_point(translation))):
        if frame.twist_variances is None:
            continue
        height = image_height(frame.frame.camera)
        times = _mean_times(solution.keypoints, of_keypoints, height, misalignment.colour_readout)
        by_depth = [
            (misalignment.delay + lag) * np.eye(6)
            + _mean_times(residuals, there, height, misalignment.depth_readout)
            for residuals, there in zip(solution.depth, of_depth)]
        for each in by_depth:
            times = times + solution.gain @ (each - times)
        response = times @ axes
        covariance += (response * frame.twist_variances) @ response.T
    return covariance


def _mean_times(residuals: Residuals, points: np.ndarray, height: float,
                readout: float) -> np.ndarray:
    """
    Return the weighted mean of the times of rows, by which a pose follows a velocity, 6x6 [s].

    :param points: of the residuals, seen by a frame: 0 is the time of its optical axis.
    :param height: of the image on the plane z = 1.
    :param readout: from the first to the last row [s].
    """
    if not readout:
        return np.zeros((6, 6))
    times = readout * np.clip(points[:, 1] / (points[:, 2] * height), -1.0, 1.0)
    if residuals.dimensions == _BOTH_COORDINATES:
        times = np.tile(times, _BOTH_COORDINATES)
    late = replaced(residuals, weights=times * residuals.weights)
    mean: np.ndarray = np.linalg.solve(NormalEquations.of([residuals], PRIOR).information,
                                       NormalEquations.of([late]).information)
    return mean
