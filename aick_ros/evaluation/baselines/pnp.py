# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
PnP: ORB keypoints matched by descriptor, RANSAC on the reprojection error, refined on inliers.

The usual visual odometry with OpenCV. Source keypoints are 3D points, target keypoints are rays,
so that no model of the lens distortion is needed here.
"""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.evaluation.baselines import Estimate
from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.settings.presets import preset

_MIN_INLIERS = 6  # by definition: required by the refinement of OpenCV
_MODELS = 500  # chosen
_CONFIDENCE = 0.999  # chosen


class Pnp:
    """
    Perspective-n-point on the ORB keypoints of the paper's full mode.

    :param reprojection: largest reprojection error of an inlier [px].
    """

    def __init__(self, reprojection: float) -> None:
        self._reprojection = reprojection
        settings = preset('paper-full')
        self._extractor = KeypointExtractor(settings.features, settings.sensor)
        self._matcher = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True)

    def prepare(self, frame: RgbdFrame) -> tuple[KeypointFrame, float]:
        """Return the keypoints and the focal length [px]."""
        return self._extractor.extract(frame), frame.camera.fx

    def register(self, source: tuple[KeypointFrame, float],
                 target: tuple[KeypointFrame, float]) -> Estimate:
        """Return the transform."""
        (source_frame, _), (target_frame, focal_length) = source, target
        matches = self._matcher.match(source_frame.descriptors, target_frame.descriptors)
        if len(matches) < _MIN_INLIERS:
            return Estimate(None, 'too few matches')
        points = source_frame.positions[[match.queryIdx for match in matches]].astype(float)
        rays = target_frame.positions[[match.trainIdx for match in matches]].astype(float)
        rays = rays[:, :2] / rays[:, 2:]
        found, rotation, translation, inliers = cv2.solvePnPRansac(
            points, rays, np.eye(3), None, iterationsCount=_MODELS, confidence=_CONFIDENCE,
            reprojectionError=self._reprojection / focal_length, flags=cv2.SOLVEPNP_EPNP)
        if not found or inliers is None or len(inliers) < _MIN_INLIERS:
            return Estimate(None, 'too few inliers')
        kept = inliers.ravel()
        rotation, translation = cv2.solvePnPRefineLM(
            points[kept], rays[kept], np.eye(3), None, rotation, translation)
        T_target_source = np.eye(4)
        T_target_source[:3, :3] = cv2.Rodrigues(rotation)[0]
        T_target_source[:3, 3] = translation.ravel()
        return Estimate(T_target_source)
