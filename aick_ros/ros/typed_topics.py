# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A node that has one type of message on each of its topics."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from aick_ros.errors import InputError


class TypedTopics(Node):
    """
    A node that rejects two types of messages on one topic, as remappings can ask for.

    ROS rejects them too, but with lines of its own beside a message that does not name them.
    """

    def create_publisher(self, msg_type: Any, topic: str, *arguments: Any,
                         **options: Any) -> Publisher:
        """
        Create a publisher.

        :raises InputError: where the topic has messages of another type.
        """
        self._check(msg_type, topic)
        return super().create_publisher(msg_type, topic, *arguments, **options)

    def create_subscription(self, msg_type: Any, topic: str, *arguments: Any,
                            **options: Any) -> Subscription:
        """
        Create a subscription.

        :raises InputError: where the topic has messages of another type.
        """
        self._check(msg_type, topic)
        return super().create_subscription(msg_type, topic, *arguments, **options)

    def _check(self, msg_type: Any, topic: str) -> None:
        name = self.resolve_topic_name(topic)
        entities: list[Any] = [*self.publishers, *self.subscriptions]
        for entity in entities:
            if entity.topic_name == name and entity.msg_type is not msg_type:
                raise InputError(
                    f'{name} would have messages of two types, {entity.msg_type.__name__} and '
                    f'{msg_type.__name__}: remap one of them to another name')
