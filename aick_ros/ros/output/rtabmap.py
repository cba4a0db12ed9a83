# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Topics for RTAB-Map and its viewer beside the odometry, where rtabmap_msgs is installed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import Quaternion, Transform
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import OdometryUpdate
from aick_ros.odometry.base_odometry import BaseState, BaseUpdate
from aick_ros.ros import conversions
from aick_ros.ros.output.views import point_cloud
from aick_ros.ros.rtabmap_messages import INSTALL_RTABMAP_MSGS, OdomInfo, Point2f

_QUEUE = 10
_FRAME_TO_FRAME = 1  # by definition, OdomInfo.type of corners that are matched to a reference
_TOPICS = ('odom_info', 'odom_info_lite')


@dataclass(frozen=True)
class Registered:
    """
    A frame that was registered.

    :param base: what is published of it.
    :param T_base_camera: extrinsic, 4x4.
    """

    update: OdometryUpdate
    base: BaseUpdate
    T_base_camera: np.ndarray


class RtabmapTopics:
    """
    Publishes ``odom_info``, ``odom_info_lite`` and ``odom_last_frame``.

    They are made only while somebody subscribes.
    """

    def __init__(self, node: Node, odom_frame: str) -> None:
        self._node, self._odom_frame = node, odom_frame
        self._distance = 0.0
        self._last_frame = node.create_publisher(PointCloud2, 'odom_last_frame', _QUEUE)
        self._infos = [] if OdomInfo is None else [
            node.create_publisher(OdomInfo, topic, _QUEUE) for topic in _TOPICS]

    def reset(self) -> None:
        """Restart the distance travelled."""
        self._distance = 0.0

    def complaint(self) -> str:
        """Return which topic somebody subscribes to in vain, '' for none."""
        if OdomInfo is None:
            for topic in _TOPICS:
                if self._node.count_subscribers(topic):
                    return (f'somebody subscribes to {self._node.resolve_topic_name(topic)}, but '
                            f'rtabmap_msgs is not installed: {INSTALL_RTABMAP_MSGS}, or set '
                            'subscribe_odom_info to false there')
        return ''

    def show(self, frame: Registered) -> None:
        """Publish what has a subscriber."""
        motion = frame.base.motion
        T_before_now = None if motion is None else motion.T_before_now
        if T_before_now is not None:
            self._distance += float(np.linalg.norm(T_before_now[:3, 3]))
        for publisher, is_full in zip(self._infos, (True, False)):
            if publisher.get_subscription_count():
                publisher.publish(self._info(frame, T_before_now, is_full))
        if frame.update.status.ok and self._last_frame.get_subscription_count():
            self._last_frame.publish(point_cloud(
                conversions.header(frame.update.stamp, self._odom_frame), se3.transform(
                    frame.base.pose.matrix @ frame.T_base_camera,
                    frame.update.keypoints.positions)))

    def _info(self, frame: Registered, T_before_now: np.ndarray | None,
              is_full: bool) -> OdomInfo:
        update, motion = frame.update, frame.base.motion
        info = OdomInfo(
            header=conversions.header(update.stamp, self._odom_frame),
            lost=frame.base.state in (BaseState.LOST, BaseState.PREDICTED),
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
                info.new_corners = _points(update.keypoints.pixels[source])
                info.ref_corners = _points(update.reference.pixels[target])
                info.corner_inliers = list(range(len(source)))
        return info


def _transform(T: np.ndarray | None) -> Transform:
    """Return the message of a transform, 4x4; None is the null transform of RTAB-Map."""
    if T is None:
        return Transform(rotation=Quaternion(x=0.0, y=0.0, z=0.0, w=0.0))
    return conversions.transform_stamped(0, '', '', T).transform


def _points(pixels: np.ndarray) -> list[Point2f]:
    return [Point2f(x=float(x), y=float(y)) for x, y in pixels]
