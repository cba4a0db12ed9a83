# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Environments and parameters with which ROS cannot start are input errors."""

import subprocess
import sys
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
    monkeypatch.setattr(program.rclpy, 'init', lambda args, **_: started.append(args))
    monkeypatch.setenv('ROS_DOMAIN_ID', '233')
    with pytest.raises(InputError, match='ROS_DOMAIN_ID'):
        program.initialise()
    assert not started
    monkeypatch.delenv('ROS_DOMAIN_ID')
    program.initialise()
    assert started == [None]


def test_a_log_that_cannot_be_written_is_an_input_error(monkeypatch):
    def init(**_):
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


@pytest.mark.parametrize('ends, is_up', [(True, False), (False, True)])
def test_a_signal_shuts_ros_down_only_if_it_is_to(ends, is_up):
    """Where it does not, KeyboardInterrupt finds a ROS that works to its end."""
    run = subprocess.run([sys.executable, '-c', f"""
import os, signal, time
import rclpy
from aick_ros.ros.process.program import initialise
signal.signal(signal.SIGINT, signal.default_int_handler)  # the background ignores it
initialise([], ends_by_signals={ends})
try:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(60)
except KeyboardInterrupt:
    end = time.monotonic() + 60
    while rclpy.ok() != {is_up} and time.monotonic() < end:
        time.sleep(0.01)
    print(rclpy.ok())
"""], capture_output=True, text=True)
    assert run.stdout.strip() == str(is_up), run.stderr
