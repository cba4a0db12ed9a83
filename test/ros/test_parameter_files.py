# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A parameter file for another node, or that never ends, is not silently accepted."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from aick_ros.borders.limits import MAX_CONFIGURATION_BYTES
from aick_ros.errors import InputError
from aick_ros.ros.parameter_files import check_parameter_files, warnings_of_files

CAMERAS = Path(__file__).parents[2] / 'config' / 'cameras'


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


def test_all_nodes_of_a_file_are_named_with_the_remedy(warnings, tmp_path):
    [warning] = warnings('a: {ros__parameters: {x: 1}}\n'
                         '/b/: {c: {ros__parameters: {x: 1}}, d: {e: {ros__parameters: {}}}}')
    assert warning == (
        f'nothing in {tmp_path}/parameters.yaml is read: it is for /a, /b/c, /b/d/e, and this '
        'node is /odom_node; rename one of them (-r __node:=NAME), or write /** in the file')


@pytest.mark.parametrize('pattern', ['/odom_nodes', '/odom.node', '/*', '/a/*', '/odom_node/*'])
def test_only_the_whole_name_is_that_of_the_node(warnings, pattern):
    """A dot is no wild card, and * stands for one part, which must be there."""
    assert len(warnings(f'{pattern}: {{ros__parameters: {{x: 1}}}}', '/a/odom_node')) == (
        pattern != '/a/*')


def test_each_file_is_read_by_itself(tmp_path):
    for name, node in (('a', 'odom_node'), ('b', 'other'), ('c', 'another')):
        (tmp_path / name).write_text(f'{node}: {{ros__parameters: {{x: 1}}}}')
    argv = ['odom_node', '--ros-args']
    for name in 'abc':
        argv += ['--params-file', str(tmp_path / name), '-r', 'x:=y']
    found = list(warnings_of_files(argv, '/odom_node'))
    assert [warning.split(' is read')[0] for warning in found] == [
        f'nothing in {tmp_path / name}' for name in 'bc']


def test_the_node_warns(rig, start_node, tmp_path):
    file = tmp_path / 'theirs.yaml'
    file.write_text('rgbd_odometry: {ros__parameters: {frame_id: body}}')
    node = start_node('--ros-args', '--params-file', str(file))
    node.wait_for_log('it is for /rgbd_odometry, and this node is /odom_node')


def _pipe(path):
    os.mkfifo(path)


def _device(path):
    path.symlink_to('/dev/zero')


def _large(path):
    path.write_text('/**: {ros__parameters: {}}\n' + '#' * MAX_CONFIGURATION_BYTES)


@pytest.mark.parametrize('make, sentence', [
    (_pipe, 'is not a regular file'), (_device, 'is not a regular file'),
    (_large, f'is larger than {MAX_CONFIGURATION_BYTES} bytes'),
    (lambda path: path.mkdir(), 'Is a directory'), (lambda path: None, 'No such file')])
def test_files_that_ros_would_read_for_ever_are_rejected_before(tmp_path, make, sentence):
    path = tmp_path / 'parameters.yaml'
    make(path)
    with pytest.raises(InputError, match=sentence):
        check_parameter_files(['bag_player', '--ros-args', '--params-file', str(path)])


def test_a_file_that_can_be_read_is_accepted(tmp_path):
    path = tmp_path / 'parameters.yaml'
    path.write_text('/**: {ros__parameters: {frame_id: body}}')
    check_parameter_files(['odom_node', '--ros-args', '--params-file', str(path)])


@pytest.mark.parametrize('program', ['odom_node', 'odom_lifecycle_node', 'bag_player'])
def test_each_program_ends_with_one_sentence(tmp_path, program):
    _pipe(path := tmp_path / 'parameters.yaml')
    done = subprocess.run(
        [sys.executable, '-c', f'from aick_ros.ros.process.entry_points import {program}\n'
         f'{program}()', '--ros-args', '--params-file', str(path)],
        text=True, capture_output=True, timeout=60)
    assert done.returncode == 2
    assert done.stdout + done.stderr == (
        f'{program}: cannot read the parameters {path}: it is not a regular file\n')


@pytest.mark.parametrize('file', sorted(CAMERAS.glob('*.yaml')), ids=lambda file: file.stem)
def test_the_file_of_a_camera_is_for_the_launch_file(file):
    with pytest.raises(InputError) as caught:
        check_parameter_files(['odom_node', '--ros-args', '--params-file', str(file)])
    assert str(caught.value).startswith(f'{file} is the file of a camera')
    assert f'camera:={file.stem}' in str(caught.value)
