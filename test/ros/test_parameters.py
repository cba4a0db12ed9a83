# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""ROS parameters are those of settings.py, with their descriptions and ranges."""

import pytest
import rclpy
from rclpy.parameter import Parameter as RosParameter

from aick_ros import settings
from aick_ros.errors import InputError
from aick_ros.ros.parameters import declare_settings
from aick_ros.settings import NodeSettings, Settings


@pytest.fixture
def make_node(ros_domain):
    rclpy.init(args=[])
    nodes = []

    def make(**overrides):
        nodes.append(rclpy.create_node('probe', parameter_overrides=[
            RosParameter(name.replace('__', '.'), value=value)
            for name, value in overrides.items()]))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()
    rclpy.shutdown()


def test_every_parameter_is_declared_with_description_range_and_unit(make_node):
    node = make_node()
    assert declare_settings(node) == (NodeSettings(), Settings())
    for group in (NodeSettings, Settings):
        for parameter in settings.parameters(group):
            descriptor = node.describe_parameter(parameter.name)
            assert descriptor.description.startswith(parameter.description)
            assert parameter.unit in descriptor.description
            assert descriptor.read_only
            if parameter.type is float:
                assert descriptor.floating_point_range[0].to_value == parameter.maximum
            if parameter.type is int:
                assert descriptor.integer_range[0].from_value == parameter.minimum


def test_what_the_user_sets_counts(make_node):
    node = make_node(aick__alpha=0.5, aick__iterations=7, frame_id='body', publish_tf=False,
                     odometry__max_speed=2, camera_in_base=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    own, core = declare_settings(node)
    assert (core.aick.alpha, core.aick.iterations, core.odometry.max_speed) == (0.5, 7, 2.0)
    assert (own.frame_id, own.publish_tf) == ('body', False)
    assert own.camera_in_base == (0, 0, 1, 0, 0, 0, 1)
    assert node.get_parameter('aick.alpha').value == 0.5


def test_an_empty_list_is_the_default(make_node):
    own, _ = declare_settings(make_node(camera_in_base=[]))
    assert own.camera_in_base == ()


def test_single_parameters_change_the_preset(make_node):
    _, core = declare_settings(make_node(preset='paper-full', aick__iterations=3))
    assert core == settings.with_values(settings.preset('paper-full'), {'aick.iterations': 3})


@pytest.mark.parametrize('overrides, sentence', [
    ({'aick__alpha': 1.5}, r'aick\.alpha = 1\.5 is outside 0 to 1'),
    ({'aick__alpha': 'high'}, "aick.alpha = 'high' is not a number"),
    ({'publish_tf': 'maybe'}, "publish_tf = 'maybe' is not true or false"),
    ({'preset': 'paper'}, "no preset is called 'paper'"),
    ({'preset': 5}, 'preset = 5 is not text'),
    ({'frame_id': ''}, 'they must be two different frames'),
    ({'frame_id': 'odom'}, 'they must be two different frames'),
    ({'camera_in_base': ['a', 'b']}, 'is not a list of numbers')])
def test_refusals_say_what_to_do(make_node, overrides, sentence):
    with pytest.raises(InputError, match=sentence):
        declare_settings(make_node(**overrides))


def test_read_only_parameters_say_so(make_node):
    node = make_node()
    declare_settings(node)
    result = node.set_parameters([RosParameter('aick.alpha', value=0.3)])[0]
    assert not result.successful
    assert 'read-only' in result.reason
