# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Dense odometry of Open3D: the hybrid of colour and depth (Park et al. 2017), and point to plane.

Measured on handheld Kinect sequences, undistorted images: the hybrid of Open3D's older pipeline is
more accurate than that of its tensor pipeline (and slower); point to plane is more accurate with
twice the default iterations and with depth up to four metres instead of three.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import open3d

from aick_ros.evaluation.baselines import Estimate
from aick_ros.frames.rectification import rectified
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera

_MAX_DEPTH = 4.0  # [m]; measured on freiburg1_xyz_150 and freiburg1_rpy_100
_MIN_DEPTHS = 100  # pixels with depth; without any it returns the identity; chosen
_ITERATIONS = (20, 10, 5)  # from the coarsest level to the finest; measured on the same

_dense = open3d.t.pipelines.odometry
_older = open3d.pipelines.odometry


class Open3dHybrid:
    """Photometric and geometric residuals together, coarse to fine from the identity."""

    def prepare(self, frame: RgbdFrame) -> tuple[Any, Camera] | None:
        """Return the intensity and depth images; pyramids are made at each registration."""
        pinhole = rectified(frame)
        colour, depth = pinhole.colour, pinhole.depth
        if not _has_depth(depth):
            return None
        images = open3d.geometry.RGBDImage.create_from_color_and_depth(
            open3d.geometry.Image(np.ascontiguousarray(colour)),
            open3d.geometry.Image(np.nan_to_num(depth)), depth_scale=1.0,
            depth_trunc=_MAX_DEPTH, convert_rgb_to_intensity=True)
        return images, frame.camera

    def register(self, source: tuple[Any, Camera] | None,
                 target: tuple[Any, Camera] | None) -> Estimate:
        """Return the transform."""
        if source is None or target is None:
            return Estimate(None, 'too few depths')
        (source_images, camera), (target_images, _) = source, target
        option = _older.OdometryOption(depth_max=_MAX_DEPTH)
        intrinsics = open3d.camera.PinholeCameraIntrinsic(
            camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
        found, T_target_source, _ = _older.compute_rgbd_odometry(
            source_images, target_images, intrinsics, np.eye(4),
            _older.RGBDOdometryJacobianFromHybridTerm(), option)
        return _estimate(found, T_target_source)


class Open3dPlane:
    """Projective point-to-plane ICP, coarse to fine from the identity."""

    def prepare(self, frame: RgbdFrame) -> tuple[Any, Any] | None:
        """Return the images as tensors; vertices and normals are made at each registration."""
        pinhole = rectified(frame)
        colour, depth = pinhole.colour, pinhole.depth
        if not _has_depth(depth):
            return None
        if colour.ndim == 2:
            colour = np.repeat(colour[:, :, None], 3, axis=2)
        image = open3d.t.geometry.Image
        return (open3d.t.geometry.RGBDImage(_image(image, colour),
                                            _image(image, np.nan_to_num(depth))),
                open3d.core.Tensor(frame.camera.matrix))

    def register(self, source: tuple[Any, Any] | None,
                 target: tuple[Any, Any] | None) -> Estimate:
        """Return the transform."""
        if source is None or target is None:
            return Estimate(None, 'too few depths')
        (source_images, matrix), (target_images, _) = source, target
        try:
            result = _dense.rgbd_odometry_multi_scale(
                source_images, target_images, matrix, depth_scale=1.0, depth_max=_MAX_DEPTH,
                criteria_list=[_dense.OdometryConvergenceCriteria(n) for n in _ITERATIONS],
                method=_dense.Method.PointToPlane)
        except RuntimeError:  # where its equations are singular
            return _estimate(False, np.eye(4))
        return _estimate(True, result.transformation.numpy())


def _has_depth(depth: np.ndarray) -> bool:
    return int(np.count_nonzero(depth > 0)) >= _MIN_DEPTHS


def _image(kind: type, pixels: np.ndarray) -> Any:
    return kind(open3d.core.Tensor(np.ascontiguousarray(pixels)))


def _estimate(found: bool, T_target_source: np.ndarray) -> Estimate:
    if not found or not np.isfinite(T_target_source).all():
        return Estimate(None, 'Open3D found no transform')
    return Estimate(np.array(T_target_source, np.float64))
