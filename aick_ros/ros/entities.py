# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Entities of a node: publishers, subscriptions, services, timers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from rclpy.node import Node


class Entities:
    """
    The publishers, subscriptions, services and timers that a node gets from now on.

    The subscription of /clock is not one of them: it comes and goes with ``use_sim_time``.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._before = {id(entity): entity for entities, _ in self._all() for entity in entities}

    def destroy(self) -> None:
        """Destroy those that are still there."""
        for entities, destroy in self._all():
            self._destroy(list(entities), destroy)
        # rclpy keeps a weak reference to each for ever, 5 kB per life cycle of the odometry
        references = self._node.default_callback_group.entities
        references -= {reference for reference in references if reference() is None}

    def _destroy(self, entities: list[Any], destroy: Callable[[Any], bool]) -> None:
        for entity in entities:
            if id(entity) not in self._before and not _is_of_clock(entity):
                destroy(entity)

    def _all(self) -> Iterable[tuple[Iterable[Any], Callable[[Any], bool]]]:
        node = self._node
        return ((node.publishers, node.destroy_publisher),
                (node.subscriptions, node.destroy_subscription),
                (node.services, node.destroy_service),
                (node.timers, node.destroy_timer))


def _is_of_clock(entity: Any) -> bool:
    return getattr(entity, 'topic_name', '') == '/clock'
