# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Two types of messages on one topic, as remappings can ask for, are one sentence."""

import subprocess

import pytest
from sensor_msgs.msg import CameraInfo, Image

from aick_ros.errors import InputError
from aick_ros.ros.playback.node_process import NODE_COMMAND
from aick_ros.ros.typed_topics import TypedTopics


@pytest.fixture
def node(graph):
    return graph.add(TypedTopics('probe', namespace='robot', cli_args=[
        '--ros-args', '-r', 'depth:=colour', '-r', 'info:=/robot/colour']))


def test_a_topic_may_be_published_and_received_more_than_once(node, capfd):
    node.create_publisher(Image, 'colour', 1)
    node.create_publisher(Image, 'depth', 1)
    assert node.create_subscription(Image, 'colour', print, 1).topic_name == '/robot/colour'
    assert capfd.readouterr() == ('', '')


@pytest.mark.parametrize('second', ['publisher', 'subscription'])
@pytest.mark.parametrize('first', ['publisher', 'subscription'])
def test_a_second_type_is_rejected_by_name(node, capfd, first, second):
    def create(kind, msg_type, topic):
        if kind == 'publisher':
            return node.create_publisher(msg_type, topic, 1)
        return node.create_subscription(msg_type, topic, print, 1)

    entity = create(first, Image, 'depth')
    with pytest.raises(InputError, match='/robot/colour .* Image and CameraInfo: remap one'):
        create(second, CameraInfo, 'info')
    (node.destroy_publisher if first == 'publisher' else node.destroy_subscription)(entity)
    create(second, CameraInfo, 'info')
    assert capfd.readouterr() == ('', '')


@pytest.mark.parametrize('rule', ['depth/image:=rgb/camera_info', 'odom:=rgb/image'])
def test_the_node_says_it_and_nothing_else(ros_domain, rule):
    done = subprocess.run([*NODE_COMMAND, '--ros-args', '-r', rule], text=True,
                          capture_output=True, timeout=120)
    assert (done.returncode, done.stdout) == (2, '')
    name = rule.partition('=')[2]
    assert done.stderr.startswith(f'odom_node: /{name} would have messages of two types, ')
    assert done.stderr.count('\n') == 1
