# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Reports silent topics, and why they are silent where that can be seen."""

from __future__ import annotations

import time
from collections.abc import Sequence

from rclpy.node import Node
from rclpy.qos import QoSCompatibility, qos_check_compatible
from rclpy.topic_endpoint_info import TopicEndpointInfo

from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.ros.input.pairing import Pairing
from aick_ros.ros.input.subscriptions import AdaptiveSubscription
from aick_ros.ros.process.resources import profiles_variable
from aick_ros.settings.node import NodeSettings

_SILENT_AFTER = 5.0  # seconds; chosen
_TOLERATED_LOSS = 0.2  # share of the images; chosen
_TOLERATED_AHEAD = 1.0  # seconds; chosen
_IMAGE = 'sensor_msgs/msg/Image'
_RGBD_IMAGE = 'rtabmap_msgs/msg/RGBDImage'
_MOST_NAMED = 6  # topics; chosen
_FEWEST = 10  # images in 5 s; chosen: a camera sends more
_IF_LOST = ('if Fast DDS loses them, start the driver with config/fastdds.xml of this package, on '
            f'another host with config/fastdds_wireless.xml ({profiles_variable()}; on this '
            "node's side it changes nothing)")
_ON_ANOTHER_HOST = ('; one on another host is found only with the same ROS_DOMAIN_ID, within '
                    'ROS_AUTOMATIC_DISCOVERY_RANGE, and if the network loses little')


class Watchdog:
    """
    Watches the subscriptions and the pairing of images by the steady clock.

    :param subscriptions: of images and calibrations.
    """

    def __init__(self, node: Node, settings: NodeSettings,
                 subscriptions: Sequence[AdaptiveSubscription], pairing: Pairing) -> None:
        self._node = node
        self._settings = settings
        self._subscriptions = {subscription.name: subscription for subscription in subscriptions}
        self._pairing = pairing

    def silent_for(self) -> float:
        """Return for how long no message was received on any topic [s]."""
        return time.monotonic() - max(self._last().values())

    def complaint_about_topics(self) -> str:
        """Return which topics are silent or do not match, and why; '' where none is."""
        now = time.monotonic()
        silent = [name for name, last in self._last().items() if now - last > _SILENT_AFTER]
        publishers = {name: self._subscriptions[name].publishers() for name in silent}
        unpublished = [name for name in silent if not publishers[name]]
        sentences = [self._explain(name, publishers[name])
                     for name in silent if publishers[name]]
        if unpublished:
            sentences.append(self._explain_unpublished(unpublished))
        if now - self._pairing.rejected_at < _SILENT_AFTER:
            sentences.append(self._pairing.rejection)
        elif not silent and now - self._pairing.paired_at > _SILENT_AFTER:
            sentences.append(self._explain_unpaired())
        return '; '.join(sentences)

    def complaint_about_losses(self) -> str:
        """Return on which topics too many images do not arrive, '' where none is."""
        lost = [f'{share:.0%} of the images on {self._subscriptions[name].topic_name}'
                for name, share in self._pairing.missing_shares.items()
                if share > _TOLERATED_LOSS]
        if not lost:
            return ''
        return f'{" and ".join(lost)} do not arrive: {_IF_LOST}'

    def complaint_about_clocks(self) -> str:
        """Return how the clocks of camera and node differ, '' where they do not."""
        if self._node.get_clock().now().nanoseconds == 0:
            return ('use_sim_time is true, and nobody publishes /clock: play the bag with '
                    '--clock, or set use_sim_time to false')
        ahead = self._pairing.ahead / NANOSECONDS
        if ahead <= _TOLERATED_AHEAD:
            return ''
        remedy = ('let /clock and the images come from one bag or simulator'
                  if self._node.get_parameter('use_sim_time').value else
                  'let the clocks of both computers be synchronized (chrony), or set use_sim_time '
                  'where a bag is played')
        return f"images are stamped {ahead:.1f} s ahead of this node's clock: {remedy}"

    def _last(self) -> dict[str, float]:
        return {name: subscription.received_at
                for name, subscription in self._subscriptions.items()
                if not subscription.may_be_silent}

    def _explain_unpublished(self, names: list[str]) -> str:
        topics = ', '.join(self._subscriptions[name].topic_name for name in names)
        remedy = f'start the camera, or remap {", ".join(names)} to its topics'
        losses = self._losses_of_others()
        sentence = (  # who loses images also loses the announcements of publishers
            f'no publisher of {topics} is found, and {losses}; otherwise {remedy}' if losses
            else f'nobody publishes {topics}: {remedy}')
        others = ''.join(map(self._published_instead, names))
        if not others and any('image' in name for name in names):
            others = self._published_elsewhere()
        return sentence + (others or ('' if losses else _ON_ANOTHER_HOST))

    def _published_instead(self, name: str) -> str:
        """Return under which name of image_transport a topic is published, and what to do."""
        other, transport = self._subscriptions[name].published_instead()
        if not other:
            return ''
        if self._settings.subscribe_rgbd:
            return f'; there is {other}: remap {name} to it'
        parameter = 'image_transport' if name == 'rgb/image' else 'depth_transport'
        return f'; there is {other}: set {parameter} to {transport}'

    def _published_elsewhere(self) -> str:
        """Return on which topics other nodes publish images, and what to do."""
        images, rgbd = self._topics_of(_IMAGE), self._topics_of(_RGBD_IMAGE)
        if self._settings.subscribe_rgbd:
            found = rgbd and f'; there is an rgbd_image on {rgbd}'
            return found or (images and f'; there are images on {images}: set subscribe_rgbd to '
                             'false for them')
        found = images and f'; there are images on {images}'
        return found or (rgbd and f'; there is an rgbd_image on {rgbd}: set subscribe_rgbd to '
                         'true for it')

    def _topics_of(self, kind: str) -> str:
        """Return the first unused topics on which other nodes publish messages of a type."""
        used = {subscription.topic_name for subscription in self._subscriptions.values()}
        topics = [topic for topic, kinds in self._node.get_topic_names_and_types()
                  if kind in kinds and topic not in used and self._node.count_publishers(topic)
                  # of this package
                  and not topic.endswith(('/debug_image', '/odom_rgbd_image'))]
        return ', '.join(sorted(topics)[:_MOST_NAMED])

    def _explain_unpaired(self) -> str:
        losses = self.complaint_about_losses()
        if losses:  # no two images that belong together have arrived
            return losses
        both = f'colour and depth images come, but for {_SILENT_AFTER:g} s no two of them have '
        few = self._few_images()
        if few:
            return f'{few}, and no two of them are a pair: {_IF_LOST}'
        if not self._settings.approx_sync:
            return both + 'the same stamp: set approx_sync to true'
        return both + (f'stamps within approx_sync_max_interval = '
                       f'{self._settings.approx_sync_max_interval:g} s: synchronize the camera, '
                       'or raise it')

    def _losses_of_others(self) -> str:
        """Return how many images are lost on topics that are not silent, '' for none."""
        if not any(self._pairing.recent_counts(_SILENT_AFTER).values()):
            return ''
        few = self._few_images()
        return self.complaint_about_losses() or (f'{few}: {_IF_LOST}' if few else '')

    def _few_images(self) -> str:
        """Return on which topics too few arrive to say how many are missing, '' for none."""
        few = [f'{count} on {self._subscriptions[name].topic_name}'
               for name, count in self._pairing.recent_counts(_SILENT_AFTER).items()
               if 0 < count < _FEWEST]
        return (f'in {_SILENT_AFTER:g} s only few images arrive ({", ".join(few)})' if few
                else '')

    def _explain(self, name: str, publishers: list[TopicEndpointInfo]) -> str:
        subscription = self._subscriptions[name]
        silence = f'nothing on {subscription.topic_name} for {_SILENT_AFTER:g} s'
        for publisher in publishers:
            compatibility, reason = qos_check_compatible(
                publisher.qos_profile, subscription.qos_profile)
            if compatibility == QoSCompatibility.ERROR:  # each is a new object
                return (f'{silence}: the QoS of {publisher.node_name} does not match ours '
                        f'({reason.strip()}); set qos_reliability to auto')
        sender = publishers[0].node_name
        if 'image' in name:
            return (f'{silence}, though {sender} is there: it sends no images, or none arrives; '
                    f'{_IF_LOST}')
        return f'{silence}: {sender} is there but sends nothing'
