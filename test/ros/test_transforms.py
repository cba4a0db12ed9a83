# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The camera's pose from chains of static transforms."""

import numpy as np
import pytest
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile

from aick_ros import rigid
from aick_ros.errors import InputError
from aick_ros.ros.messages import transform_stamped
from aick_ros.ros.transforms import StaticTransforms

tf2_msgs = pytest.importorskip('tf2_msgs.msg', reason='tf2_msgs is not installed')
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def pose(seed):
    return rigid.exp(np.random.default_rng(seed).normal(0, 1, 6))


@pytest.fixture
def publish(ros_domain):
    """Publish static transforms {(parent, child): T_parent_child}; return what hears them."""
    rclpy.init(args=[])
    node = rclpy.create_node('probe')

    def publish(links, given=None):
        heard = []
        transforms = StaticTransforms(node, 'base_link', given, lambda: heard.append(True))
        publisher = node.create_publisher(tf2_msgs.TFMessage, '/tf_static', LATCHED)
        publisher.publish(tf2_msgs.TFMessage(transforms=[
            transform_stamped(0, *frames, T) for frames, T in links.items()]))
        for _ in range(100):
            if heard or given is not None:
                break
            rclpy.spin_once(node, timeout_sec=0.1)
        return transforms

    yield publish
    node.destroy_node()
    rclpy.shutdown()


def test_down_a_chain_and_up_another(publish):
    links = {('map', 'base_link'): pose(1), ('map', 'mast'): pose(2), ('mast', 'head'): pose(3),
             ('head', 'camera'): pose(4)}
    T_map_camera = pose(2) @ pose(3) @ pose(4)
    np.testing.assert_allclose(publish(links).camera_in_base('camera'),
                               np.linalg.inv(pose(1)) @ T_map_camera, atol=1e-9)


def test_a_loop_of_frames_ends(publish):
    links = {('base_link', 'camera'): pose(1), ('a', 'base_link'): pose(2),
             ('base_link', 'a'): pose(3)}
    transforms = publish(links)
    np.testing.assert_allclose(transforms.camera_in_base('camera'), pose(1), atol=1e-9)
    with pytest.raises(InputError, match="no transform from 'elsewhere'"):
        transforms.camera_in_base('elsewhere')


def test_the_parameter_goes_first(publish):
    transforms = publish({('base_link', 'camera'): pose(1)}, given=pose(2))
    np.testing.assert_array_equal(transforms.camera_in_base('camera'), pose(2))


def test_a_leading_slash_of_old_drivers_does_not_matter(publish):
    transforms = publish({('base_link', '/camera'): pose(1)})
    for frame in ('camera', '/camera'):
        np.testing.assert_allclose(transforms.camera_in_base(frame), pose(1), atol=1e-9)


def test_the_base_itself_needs_no_transform(publish):
    transforms = publish({('base_link', 'camera'): pose(1)})
    np.testing.assert_array_equal(transforms.camera_in_base('base_link'), np.eye(4))
