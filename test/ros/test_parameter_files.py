# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A parameter file for another node is not silently ignored."""

import pytest

from aick_ros.ros.parameter_files import warnings_of_files


@pytest.fixture
def warnings(tmp_path):
    def read(content, node_name='/odom_node'):
        file = tmp_path / 'parameters.yaml'
        file.write_text(content)
        return list(warnings_of_files(['odom_node', '--ros-args', '--params-file', str(file)],
                                      node_name))
    return read


@pytest.mark.parametrize('content', [
    'rgbd_odometry: {ros__parameters: {frame_id: body}}',
    '/robot/odom_node: {ros__parameters: {frame_id: body}}',
    'robot: {odom_node: {ros__parameters: {frame_id: body}}}',
    '/robot/**: {ros__parameters: {frame_id: body}}',
    '/*/odom_node: {ros__parameters: {frame_id: body}}'])
def test_a_file_for_another_node_is_named(warnings, content):
    [warning] = warnings(content)
    assert 'nothing in ' in warning and 'this node is /odom_node' in warning


@pytest.mark.parametrize('content, name', [
    ('/**: {ros__parameters: {frame_id: body}}', '/robot/odom_node'),
    ('/*: {ros__parameters: {frame_id: body}}', '/odom_node'),
    ('odom_node: {ros__parameters: {frame_id: body}}', '/odom_node'),
    ('/odom_node: {ros__parameters: {frame_id: body}}', '/odom_node'),
    ('robot: {odom_node: {ros__parameters: {frame_id: body}}}', '/robot/odom_node'),
    ('/**/odom_node: {ros__parameters: {frame_id: body}}', '/a/b/odom_node'),
    ('rtabmap: {ros__parameters: {a: 1}}\n/odom_node: {ros__parameters: {frame_id: body}}',
     '/odom_node'),
    ('', '/odom_node'), ('[', '/odom_node')])
def test_a_file_for_this_node_is_not(warnings, content, name):
    assert warnings(content, name) == []


def test_the_node_warns(rig, start_node, tmp_path):
    file = tmp_path / 'theirs.yaml'
    file.write_text('rgbd_odometry: {ros__parameters: {frame_id: body}}')
    node = start_node('--ros-args', '--params-file', str(file))
    node.wait_for_log('it is for /rgbd_odometry, and this node is /odom_node')
