# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The policy for a secured graph allows what the node does in the graph, and nothing else."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from aick_ros.geometry.camera import Camera

POLICY = Path(__file__).parents[2] / 'config' / 'sros2' / 'odom_node.policy.xml'
NODE = 'odom_node', '/'


def allowed(right):
    """Return the full names that the policy allows the node to use in one way."""
    names = set()
    for profile in ElementTree.parse(POLICY).iter('profile'):
        namespace, node = profile.get('ns'), profile.get('node')
        for name in (element.text for group in profile if group.get(right) == 'ALLOW'
                     for element in group):
            name = re.sub('^~', f'{namespace}{node}', name)
            names.add(name if name.startswith('/') else f'{namespace}{name}')
    return names


def test_the_policy_is_what_the_node_uses(rtabmap_msgs, rig, start_node):
    """With all that is optional: transforms that move, another depth camera, a clock, RTAB-Map."""
    pytest.importorskip('tf2_msgs', reason='tf2_msgs is not installed')
    start_node(register_depth='true', frame_id='base_link', use_sim_time='true')
    rig.send_camera_info(Camera(8, 8, 8.0, 8.0, 3.5, 3.5))
    rig.send(None, rig.image_message(10 ** 9, 'mono8', np.zeros((8, 8), np.uint8)),
             rig.image_message(10 ** 9, '32FC1', np.ones((8, 8), np.float32)))
    rig.wait_until(lambda: '/tf' in names(rig.node.get_subscriber_names_and_types_by_node),
                   'the node to listen to /tf')
    assert names(rig.node.get_publisher_names_and_types_by_node) == allowed('publish')
    assert names(rig.node.get_subscriber_names_and_types_by_node) == allowed('subscribe')
    assert names(rig.node.get_service_names_and_types_by_node) == allowed('reply')
    assert names(rig.node.get_client_names_and_types_by_node) == allowed('request') == set()


def names(look):
    return {name for name, _ in look(*NODE)}
