# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Environments and parameters with which ROS cannot start are input errors."""

import warnings
from pathlib import Path

import pytest
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.parameter import Parameter

from aick_ros.errors import InputError
from aick_ros.ros.playback import live_run
from aick_ros.ros.process import program


def test_ros_does_not_start_where_it_would_end_the_process(monkeypatch):
    started = []
    monkeypatch.setattr(program.rclpy, 'init', lambda args: started.append(args))
    monkeypatch.setenv('ROS_DOMAIN_ID', '233')
    with pytest.raises(InputError, match='ROS_DOMAIN_ID'):
        program.initialise()
    assert not started
    monkeypatch.delenv('ROS_DOMAIN_ID')
    program.initialise()
    assert started == [None]


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


def test_a_node_that_cannot_be_made_is_one_sentence(monkeypatch, recwarn):
    monkeypatch.setattr(program.rclpy, 'ok', lambda: True)

    def make():
        warnings.warn('Failed to fini rosout publisher', RuntimeWarning)
        raise InvalidParameterTypeException(Parameter('use_sim_time', value='x'), 'BOOL')
    with pytest.raises(InputError, match='ROS cannot create the node'):
        program.make_node(make)
    assert not recwarn.list
