# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Dense odometry of OpenCV, ``cv2.Odometry``: on depth (ICP), or on depth and colour.

It requires a pinhole camera: the images are undistorted, which on handheld Kinect sequences gains
a few hundredths of the success ratio. Of its two variants, "common" is at least as accurate as
"fast", and faster.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from aick_ros.evaluation.baselines import Estimate
from aick_ros.frames.rectification import rectified
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera


class OpencvOdometry:
    """
    Coarse to fine from the identity, with the default settings of OpenCV.

    :param colour: whether colour is used in addition to depth.
    """

    def __init__(self, colour: bool) -> None:
        self._type = cv2.OdometryType_RGB_DEPTH if colour else cv2.OdometryType_DEPTH
        self._odometry: Any = None
        self._camera: Camera | None = None

    def prepare(self, frame: RgbdFrame) -> Any:
        """Return pyramids, normals and gradients, for both roles."""
        if frame.camera != self._camera:
            self._camera, self._odometry = frame.camera, self._make(frame.camera.matrix)
        pinhole = rectified(frame)
        colour, depth = pinhole.colour, pinhole.depth
        if colour.ndim == 3:
            colour = cv2.cvtColor(colour, cv2.COLOR_RGB2BGR)
        prepared = cv2.OdometryFrame(depth, colour)
        self._odometry.prepareFrame(prepared)
        return prepared

    def register(self, source: Any, target: Any) -> Estimate:
        """Return the transform."""
        found, T_target_source = self._odometry.compute(source, target)
        if not found or not np.isfinite(T_target_source).all():
            return Estimate(None, 'OpenCV found no transform')
        return Estimate(T_target_source)

    def _make(self, matrix: np.ndarray) -> Any:
        settings = cv2.OdometrySettings()
        settings.setCameraMatrix(matrix.astype(np.float32))
        return cv2.Odometry(self._type, settings, cv2.OdometryAlgoType_COMMON)
