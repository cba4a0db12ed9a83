# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Environments and parameters with which ROS cannot start are input errors."""

from pathlib import Path

import pytest
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.parameter import Parameter

from aick_ros.errors import InputError
from aick_ros.ros.playback import live_run
from aick_ros.ros.process import program


@pytest.fixture
def starts(monkeypatch):
    """Return the starts of ROS, which are counted only."""
    made = []
    monkeypatch.setattr(program.rclpy, 'init', lambda args: made.append(args))
    monkeypatch.delenv('ROS_DOMAIN_ID', raising=False)
    return made


@pytest.mark.parametrize('domain', ['0', '232', ''])
def test_ros_starts_in_each_domain_that_has_ports(starts, monkeypatch, domain):
    monkeypatch.setenv('ROS_DOMAIN_ID', domain)
    program.initialise()
    assert starts


@pytest.mark.parametrize('domain', ['233', '999', '9' * 30])
def test_domains_without_ports_are_rejected(starts, monkeypatch, domain):
    monkeypatch.setenv('ROS_DOMAIN_ID', domain)
    with pytest.raises(InputError, match=f'ROS_DOMAIN_ID is {domain}: at most 232'):
        program.initialise()
    assert not starts


@pytest.mark.parametrize('place', ['HOME', 'ROS_HOME', 'ROS_LOG_DIR'])
def test_a_log_without_a_place_is_rejected(starts, monkeypatch, place):
    for name in ('HOME', 'ROS_HOME', 'ROS_LOG_DIR'):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match='set HOME or ROS_LOG_DIR'):
        program.initialise()
    monkeypatch.setenv(place, '/tmp')
    program.initialise()
    assert len(starts) == 1


def test_a_log_that_cannot_be_written_is_an_input_error(monkeypatch):
    def init(args):
        raise RuntimeError("Failed to create log directory '/proc/none'")
    monkeypatch.setattr(live_run.rclpy, 'init', init)
    with pytest.raises(InputError, match='ROS rejects the environment: .*log directory'):
        live_run.run_live(Path('bag'), {}, {}, lambda stamp: None)


def test_parameters_of_the_wrong_type_are_input_errors(monkeypatch):
    monkeypatch.setattr(program.rclpy, 'ok', lambda: True)

    def make():
        raise InvalidParameterTypeException(Parameter('use_sim_time', value='x'), 'BOOL')
    with pytest.raises(InputError, match='ROS cannot create the node: .*use_sim_time'):
        program.make_node(make)
