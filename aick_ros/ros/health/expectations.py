# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Expectations of RTAB-Map's nodes of rgbd_odometry that are not met here."""

from __future__ import annotations

from collections.abc import Iterator

from rclpy.node import Node

from aick_ros.ros.rtabmap_messages import INSTALL_RTABMAP_MSGS, OdomInfo, ResetPose
from aick_ros.settings.node import NodeSettings

_INFO_TOPICS = ('odom_info', 'odom_info_lite')
_RGBD_TOPIC = 'odom_rgbd_image'
_SENSOR_DATA_TOPICS = tuple(f'odom_sensor_data/{kind}'
                            for kind in ('raw', 'features', 'compressed'))
_SCAN_TOPIC = 'odom_local_scan_map'
_THEIR_NODE = 'rgbd_odometry'
_SERVICES = ('reset_odom', 'reset_odom_to_pose', 'pause_odom', 'resume_odom')


class Expectations:
    """Watches the graph for whoever uses in vain what ``rgbd_odometry`` has."""

    def __init__(self, node: Node, settings: NodeSettings) -> None:
        self._node, self._logger = node, node.get_logger()
        self._has_twist_of_velocity = settings.twist_covariance == 'velocity'
        self._told: set[str] = set()

    def complaint(self) -> str:
        """Return which topic or service somebody waits for in vain, '' for none."""
        return next(self._complaints(), '')

    def report_differences(self) -> None:
        """Log, each once, what is not used of what others offer, and what differs for them."""
        for difference in self._differences():
            if difference not in self._told:
                self._told.add(difference)
                self._logger.warning(difference)

    def _complaints(self) -> Iterator[str]:
        for topic in self._subscribed(*_SENSOR_DATA_TOPICS):
            yield (f'somebody subscribes to {topic}, which is not published here: subscribe to '
                   f'{_RGBD_TOPIC} (subscribe_rgbd) in its place')
        if OdomInfo is None:
            for topics, remedy in ((_INFO_TOPICS, ', or set subscribe_odom_info to false there'),
                                   ((_RGBD_TOPIC,), '')):
                for topic in self._subscribed(*topics):
                    yield (f'somebody subscribes to {topic}, but rtabmap_msgs is not installed: '
                           f'{INSTALL_RTABMAP_MSGS}{remedy}')
        yield from self._uncalled_services()

    def _uncalled_services(self) -> Iterator[str]:
        node = self._node
        service = node.resolve_service_name('~/reset_odom_to_pose')
        if ResetPose is None and node.count_clients(service):
            yield (f'somebody calls {service}, but rtabmap_msgs is not installed: '
                   f'{INSTALL_RTABMAP_MSGS}, or publish the pose on set_pose')
        for name in _SERVICES if node.get_name() != _THEIR_NODE else ():
            service = node.resolve_service_name(f'{_THEIR_NODE}/{name}')
            if node.count_clients(service) and not node.count_services(service):
                yield (f'somebody calls {service}, but this node is {node.get_name()}: start it '
                       f'with -r __node:={_THEIR_NODE}')

    def _differences(self) -> Iterator[str]:
        for topic in self._subscribed(_SCAN_TOPIC):
            yield (f'somebody subscribes to {topic}, which stays empty: laser scans are not used '
                   'here')
        if self._has_twist_of_velocity:
            for topic in self._subscribed(*_INFO_TOPICS):
                yield (f'somebody subscribes to {topic}, as RTAB-Map does, which takes the '
                       'covariance of the twist for that of the increment: set twist_covariance '
                       'to increment')
                break

    def _subscribed(self, *topics: str) -> Iterator[str]:
        """Yield the resolved names of those topics to which somebody subscribes."""
        resolved = map(self._node.resolve_topic_name, topics)
        return (topic for topic in resolved if self._node.count_subscribers(topic))
