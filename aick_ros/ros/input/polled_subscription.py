# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A subscription whose messages are taken together, by whoever needs them."""

from __future__ import annotations

from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile

from aick_ros.ros.input.waiting_messages import waiting_messages


class _NeverExecuted(CallbackGroup):
    """Keeps a subscription out of what an executor waits for."""

    def can_execute(self, entity: object) -> bool:
        return False

    def beginning_execution(self, entity: object) -> bool:
        return False

    def ending_execution(self, entity: object) -> None:
        pass


class PolledSubscription:
    """
    Leaves messages in the queue of the middleware until they are taken, by one thread at a time.

    An executor wakes up for each message of any other subscription, which costs more than the
    message itself.

    :param kind: type of the messages.
    :param qos: its depth is the number of messages that are kept.
    """

    def __init__(self, node: Node, kind: Any, topic: str, qos: QoSProfile) -> None:
        self._node = node
        self._subscription = node.create_subscription(
            kind, topic, lambda message: None, qos, callback_group=_NeverExecuted(), raw=True)

    def take(self) -> list[bytes]:
        """Return the messages that have come since the last call, as they were sent."""
        return list(waiting_messages(self._subscription))

    def destroy(self) -> None:
        """Unsubscribe."""
        self._node.destroy_subscription(self._subscription)
