# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Notices topics that are silent, and says why where that can be seen."""

from __future__ import annotations

import math
import time

from rclpy.node import Node
from rclpy.qos import QoSCompatibility, qos_check_compatible
from rclpy.topic_endpoint_info import TopicEndpointInfo

from aick_ros.ros.subscriptions import AdaptiveSubscription
from aick_ros.settings import NodeSettings

_SILENT_AFTER = 5.0  # seconds


class Watchdog:
    """
    Watches subscriptions by the steady clock.

    :param subscriptions: name as in the node's contract -> subscription.
    """

    def __init__(self, node: Node, subscriptions: dict[str, AdaptiveSubscription],
                 settings: NodeSettings) -> None:
        self._node = node
        self._settings = settings
        self._paired = time.monotonic()
        self._refused: tuple[float, str] = (-math.inf, '')
        self._subscriptions = subscriptions
        self._last = dict.fromkeys(subscriptions, time.monotonic())

    def saw(self, name: str) -> None:
        """Take note of a message."""
        self._last[name] = time.monotonic()

    def wants_no_more(self, name: str) -> None:
        """Take note that a topic may be silent from now on."""
        self._last[name] = math.inf

    def refused(self, sentence: str) -> None:
        """Take note of why an image was not even paired."""
        self._refused = time.monotonic(), sentence

    def saw_pair(self) -> None:
        """Take note of a colour and a depth image that belong together."""
        self._paired = time.monotonic()

    def quiet_for(self) -> float:
        """Return for how long no message has come on any topic [s]."""
        return time.monotonic() - max(last for last in self._last.values() if last < math.inf)

    def complaint(self) -> str:
        """Return what is wrong with topics that are silent or do not fit, '' where none is."""
        now = time.monotonic()
        silent = [name for name, last in self._last.items() if now - last > _SILENT_AFTER]
        publishers = {name: self._subscriptions[name].publishers() for name in silent}
        unpublished = [name for name in silent if not publishers[name]]
        sentences = [self._explain(name, publishers[name])
                     for name in silent if publishers[name]]
        if unpublished:
            topics = ', '.join(self._subscriptions[name].topic_name for name in unpublished)
            sentences.append(f'nobody publishes {topics}: start the camera, or remap '
                             f'{", ".join(unpublished)} to its topics')
        if now - self._refused[0] < _SILENT_AFTER:
            sentences.append(self._refused[1])
        elif not silent and now - self._paired > _SILENT_AFTER:
            sentences.append(self._explain_unpaired())
        return '; '.join(sentences)

    def _explain_unpaired(self) -> str:
        both = f'colour and depth images come, but for {_SILENT_AFTER:g} s no two of them have '
        if not self._settings.approx_sync:
            return both + 'the same stamp: set approx_sync to true'
        return both + (f'stamps within approx_sync_max_interval = '
                       f'{self._settings.approx_sync_max_interval:g} s: synchronize the camera, '
                       'or raise it')

    def _explain(self, name: str, publishers: list[TopicEndpointInfo]) -> str:
        subscription = self._subscriptions[name]
        silence = f'nothing on {subscription.topic_name} for {_SILENT_AFTER:g} s'
        for publisher in publishers:
            compatibility, reason = qos_check_compatible(
                publisher.qos_profile, subscription.qos_profile)
            if compatibility == QoSCompatibility.ERROR:  # each is a new object
                return (f'{silence}: the QoS of {publisher.node_name} does not match ours '
                        f'({reason.strip()}); set qos_reliability to auto')
        return f'{silence}: {publishers[0].node_name} is there but sends nothing'
