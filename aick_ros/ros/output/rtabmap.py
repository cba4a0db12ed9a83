# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Topics for RTAB-Map and its viewer beside the odometry, where rtabmap_msgs is installed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from geometry_msgs.msg import Quaternion, Transform
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2

from aick_ros.frames.rectification import rectified_pixels
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import OdometryUpdate
from aick_ros.odometry.base_odometry import BaseState, BaseUpdate
from aick_ros.ros import conversions
from aick_ros.ros.output.rgbd_image import rgbd_image
from aick_ros.ros.output.views import point_cloud
from aick_ros.ros.robot_odometry import RobotUpdate
from aick_ros.ros.rtabmap_messages import OdomInfo, Point2f, RGBDImage

_QUEUE = 10
_FRAME_TO_FRAME = 1  # by definition, OdomInfo.type of corners that are matched to a reference
_INFO_TOPICS = ('odom_info', 'odom_info_lite')


class RtabmapTopics:
    """
    Publishes ``odom_info`` and its relatives, the images and the local map.

    They are made only while somebody subscribes.

    :param local_map: returns the keypoints of the keyframes in the camera's frame, Nx3 [m].
    """

    def __init__(self, node: Node, odom_frame: str, local_map: Callable[[], np.ndarray]) -> None:
        self._node, self._odom_frame, self._local_map = node, odom_frame, local_map
        self._distance = 0.0
        self._clouds = {name: node.create_publisher(PointCloud2, name, _QUEUE)
                        for name in ('odom_last_frame', 'odom_local_map')}
        self._infos, self._rgbd_images = [], []
        if OdomInfo is not None:
            self._infos = [node.create_publisher(OdomInfo, topic, _QUEUE)
                           for topic in _INFO_TOPICS]
            self._rgbd_images = [node.create_publisher(RGBDImage, 'odom_rgbd_image', _QUEUE)]

    def reset(self) -> None:
        """Restart the distance travelled."""
        self._distance = 0.0

    def show(self, update: RobotUpdate, base: BaseUpdate) -> None:
        """Publish what has a subscriber, with what is published of the base."""
        motion = base.motion
        T_before_now = None if motion is None else motion.T_before_now
        if T_before_now is not None and base.state is BaseState.TRACKED:
            self._distance += float(np.linalg.norm(T_before_now[:3, 3]))
        for publisher, is_full in zip(self._infos, (True, False)):
            if publisher.get_subscription_count():
                publisher.publish(self._info(update.camera, base, T_before_now, is_full))
        for publisher in self._rgbd_images:
            if publisher.get_subscription_count():
                publisher.publish(rgbd_image(update.frame, update.camera_frame))
        if update.camera.status.ok:
            self._show_points('odom_last_frame', update,
                              lambda: update.camera.keypoints.positions)
            self._show_points('odom_local_map', update, self._local_map)

    def _show_points(self, topic: str, update: RobotUpdate,
                     points: Callable[[], np.ndarray]) -> None:
        """Publish points in the camera's frame, Nx3 [m]."""
        if self._clouds[topic].get_subscription_count():
            self._clouds[topic].publish(point_cloud(
                conversions.header(update.camera.stamp, self._odom_frame), se3.transform(
                    update.T_odom_base @ update.T_base_camera, points())))

    def _info(self, update: OdometryUpdate, base: BaseUpdate, T_before_now: np.ndarray | None,
              is_full: bool) -> OdomInfo:
        motion = base.motion
        info = OdomInfo(
            header=conversions.header(update.stamp, self._odom_frame),
            lost=base.state in (BaseState.LOST, BaseState.PREDICTED),
            matches=len(update.matches), inliers=int(update.support),
            features=len(update.keypoints.pixels), type=_FRAME_TO_FRAME,
            time_estimation=update.timing.get('total', 0.0) / 1e3,
            stamp=update.stamp / NANOSECONDS, distance_travelled=self._distance,
            transform=_transform(T_before_now), transform_filtered=_transform(T_before_now),
            transform_ground_truth=_transform(None), guess=_transform(None))
        info.covariance = (conversions.UNKNOWN if motion is None else motion.covariance).ravel()
        if update.increment is not None:
            info.interval = update.increment.interval
        if update.reference is not None:
            info.local_map_size, info.local_key_frames = len(update.reference.pixels), 1
            if is_full:
                source, target = update.matches.T
                camera = update.prepared.frame.camera
                info.new_corners = _points(camera, update.keypoints.pixels[source])
                info.ref_corners = _points(camera, update.reference.pixels[target])
                info.corner_inliers = list(range(len(source)))
        return info


def _transform(T: np.ndarray | None) -> Transform:
    """Return the message of a transform, 4x4; None is the null transform of RTAB-Map."""
    if T is None:
        return Transform(rotation=Quaternion(x=0.0, y=0.0, z=0.0, w=0.0))
    return conversions.transform_stamped(0, '', '', T).transform


def _points(camera: Camera, pixels: np.ndarray) -> list[Point2f]:
    """Return pixels as corners of ``odom_rgbd_image``, which is rectified."""
    return [Point2f(x=float(x), y=float(y)) for x, y in rectified_pixels(camera, pixels)]
