# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Environments with which ROS cannot start are input errors, told before it tries."""

import subprocess
import sys

import pytest

from aick_ros.errors import InputError
from aick_ros.ros.process.environment import check_middleware, check_variables
from aick_ros.ros.process.resources import config_file

SWITCHES = ('RCUTILS_LOGGING_USE_STDOUT', 'RCUTILS_COLORIZED_OUTPUT',
            'RCUTILS_LOGGING_BUFFERED_STREAM')
PROFILES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
PLACES = ('HOME', 'ROS_HOME', 'ROS_LOG_DIR')


@pytest.fixture(autouse=True)
def environment(monkeypatch):
    """Remove what the tests set."""
    for name in ('ROS_DOMAIN_ID', 'RMW_IMPLEMENTATION', 'AMENT_PREFIX_PATH', *SWITCHES, *PROFILES):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize('name, value', [
    ('ROS_DOMAIN_ID', '0'), ('ROS_DOMAIN_ID', '232'), ('ROS_DOMAIN_ID', ''),
    *((name, value) for name in SWITCHES for value in ('', '0', '1')),
    *((name, value) for name in PROFILES for value in ('', str(config_file('fastdds.xml'))))])
def test_what_ros_accepts(monkeypatch, name, value):
    monkeypatch.setenv(name, value)
    check_variables()


@pytest.mark.parametrize('name, value, reason', [
    *(('ROS_DOMAIN_ID', value, 'at most 232') for value in ('233', '999', '9' * 30)),
    *((name, value, '0 or 1') for name in SWITCHES for value in ('x', '2', 'true', '01')),
    *((name, '/no/file.xml', 'no such file') for name in PROFILES)])
def test_what_ros_rejects_is_named(monkeypatch, name, value, reason):
    monkeypatch.setenv(name, value)
    with pytest.raises(InputError, match=f'^{name} is {value}: .*{reason}'):
        check_variables()


@pytest.mark.parametrize('name', PROFILES)
@pytest.mark.parametrize('content, reason', [
    (b'root:x:0:0', 'it is not XML'), (b'', 'it is not XML'), (b'\xff\xfe', 'it is not XML'),
    (b'<?xml version="1.0" encoding="nope"?><dds/>', 'it is not XML'),
    (b'<a/>', "it has no profiles of Fast DDS, as 'a' is none of its elements")])
def test_profiles_that_are_none_are_rejected(monkeypatch, tmp_path, name, content, reason):
    file = tmp_path / 'profiles.xml'
    file.write_bytes(content)
    monkeypatch.setenv(name, str(file))
    with pytest.raises(InputError) as raised:
        check_variables()
    assert str(raised.value).startswith(f'{name} is {file}: {reason}')
    file.write_text('<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"/>')
    check_variables()


@pytest.mark.parametrize('place', PLACES)
def test_a_log_without_a_place_is_rejected(monkeypatch, place):
    for name in PLACES:
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match='set HOME or ROS_LOG_DIR'):
        check_variables()
    monkeypatch.setenv(place, '/tmp')
    check_variables()


def test_a_middleware_of_a_workspace_is_not_tried(monkeypatch, tmp_path):
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'rmw_typesupport'
    index.mkdir(parents=True)
    (index / 'rmw_nothing').touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'/none:{tmp_path}')
    monkeypatch.setenv('RMW_IMPLEMENTATION', 'rmw_nothing')
    check_middleware()


@pytest.mark.parametrize('program, name, reason', [
    ('odom_node', 'RMW_IMPLEMENTATION', 'which this ROS does not have: '),
    ('bag_player', 'RMW_IMPLEMENTATION', 'which this ROS does not have: '),
    *((program, 'RCUTILS_COLORIZED_OUTPUT', ': 0 or 1 is required')
      for program in ('odom_node', 'odom_lifecycle_node', 'bag_player'))])
def test_a_program_says_it_in_one_sentence(monkeypatch, program, name, reason):
    """Before ROS parses its arguments, at which it begins to log."""
    monkeypatch.setenv(name, 'x')
    run = outcome(f'from aick_ros.ros.process.entry_points import {program} as run; run()')
    assert run.returncode == 2
    assert run.stderr.startswith(f'{program}: {name} is x')
    assert reason in run.stderr
    assert run.stderr.count('\n') == 1


def test_a_middleware_that_can_be_loaded_is_accepted(monkeypatch):
    monkeypatch.setenv('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp')
    run = outcome('from aick_ros.ros.process.environment import check_middleware as check; '
                  'check(); import rclpy; rclpy.init()')
    assert (run.returncode, run.stdout, run.stderr) == (0, '', '')


def outcome(program):
    """Run a program in a process of its own: rclpy is imported in this one."""
    return subprocess.run([sys.executable, '-c', program], capture_output=True, text=True)
