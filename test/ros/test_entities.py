# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a node got since some moment is destroyed, and nothing else."""

import pytest
from rclpy.parameter import Parameter
from std_msgs.msg import Header
from std_srvs.srv import Empty

from aick_ros.ros.entities import Entities


@pytest.fixture
def node(graph):
    return graph.node()


def furnish(node, suffix):
    """Give a node one entity of each kind."""
    node.create_publisher(Header, f'out_{suffix}', 1)
    node.create_subscription(Header, f'in_{suffix}', print, 1)
    node.create_service(Empty, f'service_{suffix}', print)
    node.create_timer(1000.0, print)


def all_of(node):
    return {*node.publishers, *node.subscriptions, *node.services, *node.timers}


def test_what_was_there_before_stays(node):
    furnish(node, 'before')
    before, entities = all_of(node), Entities(node)
    furnish(node, 'after')
    node.create_publisher(Header, 'gone', 1)
    assert len(all_of(node)) == len(before) + 5
    entities.destroy()
    assert all_of(node) == before
    entities.destroy()
    assert all_of(node) == before


def test_the_clock_of_use_sim_time_goes_on(node):
    entities = Entities(node)
    node.set_parameters([Parameter('use_sim_time', value=True)])
    entities.destroy()
    assert '/clock' in [subscription.topic_name for subscription in node.subscriptions]


def test_nothing_is_kept_of_what_was_destroyed(node):
    """Rclpy itself would keep a weak reference to each entity, for ever."""
    references = node.default_callback_group.entities
    entities = Entities(node)
    kept = set(references)
    furnish(node, 'gone')
    assert len(references) > len(kept)
    entities.destroy()
    assert references == kept
