# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Environments and parameters with which ROS cannot start are input errors."""

import signal
import subprocess
import sys
import warnings
from contextlib import nullcontext
from pathlib import Path

import pytest
import rclpy
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.executors import ExternalShutdownException
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from aick_ros.errors import InputError
from aick_ros.ros.playback import live_run
from aick_ros.ros.process import program
from aick_ros.ros.process.signals import ENDINGS


def test_ros_does_not_start_where_it_would_end_the_process(ros_domain, monkeypatch):
    with monkeypatch.context() as patched:
        patched.setenv('ROS_DOMAIN_ID', '233')
        with pytest.raises(InputError, match='ROS_DOMAIN_ID'):
            program.initialise()
        assert not rclpy.ok()
    program.initialise()
    assert rclpy.ok()
    rclpy.shutdown()


def test_a_log_that_cannot_be_written_is_an_input_error(monkeypatch):
    def init(**_):
        raise RuntimeError("Failed to create log directory '/proc/none'")
    monkeypatch.setattr(live_run.rclpy, 'init', init)
    with pytest.raises(InputError, match='ROS rejects the environment: .*log directory'):
        live_run.run_live(Path('bag'), {}, {}, lambda stamp: None)


def test_parameters_of_the_wrong_type_are_input_errors(graph):
    def make():
        raise InvalidParameterTypeException(Parameter('use_sim_time', value='x'), 'BOOL')
    with pytest.raises(InputError, match='ROS cannot create the node: .*use_sim_time'):
        program.make_node(make)


def test_a_node_that_cannot_be_made_is_one_sentence(graph, recwarn):
    def make():
        warnings.warn('Failed to fini rosout publisher', RuntimeWarning)
        raise program.RCLError('error creating node: no keystore\n  at node.cpp:73')
    with pytest.raises(InputError, match='ROS cannot create the node: error creating node: '
                                         'no keystore at node.cpp:73$'):
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


@pytest.fixture
def done(ros_domain, monkeypatch):
    """Return what a program does with ROS and with signals, which stay as the tests have them."""
    done, shut_down = [], rclpy.try_shutdown
    monkeypatch.setattr(program, '_handle_signals', lambda interrupt: done.append(
        ('handle_signals', interrupt)))
    monkeypatch.setattr(program, 'ignore', lambda: done.append('ignore'))
    monkeypatch.setattr(program, 'initialise', lambda: (
        done.append('initialise'), rclpy.init(args=[])))
    monkeypatch.setattr(program.rclpy, 'try_shutdown', lambda: (
        done.append('shut down'), shut_down()))
    yield done
    shut_down()


STARTED, ENDED = [('handle_signals', False), 'initialise'], ['shut down', 'ignore']


def test_a_program_prepares_itself_before_ros_starts_and_ends_it(done):
    def prepare():
        done.append('prepare')
        return 'prepared'
    with program.program('x', prepare) as prepared:
        assert done == ['prepare', *STARTED]
        assert rclpy.ok()
        assert not signal.pthread_sigmask(signal.SIG_BLOCK, ()) & set(ENDINGS)
    assert prepared == 'prepared'
    assert done == ['prepare', *STARTED, *ENDED]
    assert not rclpy.ok()


def test_a_program_that_blocks_elsewhere_is_interrupted(done):
    with program.program('x', lambda: None, interrupt=True):
        pass
    assert done[0] == ('handle_signals', True)


def test_an_unusable_input_is_one_line_and_exit_code_2(done, capsys):
    for where in ('prepare', 'block'):
        def fail():
            raise InputError('it is\nno bag')
        with pytest.raises(SystemExit) as end:
            with program.program('x', fail if where == 'prepare' else lambda: None):
                fail()
        assert end.value.code == 2
        assert capsys.readouterr() == ('', 'x: it is no bag\n')
        assert done[-2:] == ENDED


@pytest.mark.parametrize('error', [KeyboardInterrupt, ExternalShutdownException])
def test_an_end_by_a_signal_is_no_error(done, error, capsys):
    with pytest.raises(SystemExit) as end:
        with program.program('x', lambda: None):
            raise error
    assert end.value.code in (None, 0)
    assert capsys.readouterr() == ('', '')
    assert done[-2:] == ENDED


@pytest.mark.parametrize('is_up', [True, False])
def test_a_failure_is_an_error_unless_it_follows_from_the_shutdown(done, is_up):
    with pytest.raises(ZeroDivisionError) if is_up else nullcontext():
        with program.program('x', lambda: None):
            if not is_up:
                rclpy.shutdown()
            raise ZeroDivisionError
    assert done[-2:] == ENDED


@pytest.mark.parametrize('is_up', [True, False])
def test_a_shutdown_that_fails_is_an_error_unless_it_has_happened(done, monkeypatch, is_up):
    def fail():
        raise RuntimeError
    monkeypatch.setattr(program.rclpy, 'try_shutdown', fail)
    with pytest.raises(RuntimeError) if is_up else nullcontext():
        with program.program('x', lambda: None):
            if not is_up:
                rclpy.shutdown()
    assert ('ignore' in done) is not is_up


def test_a_signal_during_the_start_ends_it_before_anything_begins(done, monkeypatch):
    monkeypatch.setattr(program.signal, 'sigpending', lambda: {signal.SIGTERM})
    with pytest.raises(SystemExit) as end:
        with program.program('x', lambda: None):
            done.append('begun')
    assert end.value.code in (None, 0)
    assert done == [*STARTED, 'ignore', *ENDED]


@pytest.mark.parametrize('interrupt', [True, False])
def test_only_the_first_signal_interrupts_and_only_where_it_is_to(monkeypatch, interrupt):
    handlers = {}
    monkeypatch.setattr(program.signal, 'signal', handlers.__setitem__)
    program._handle_signals(interrupt)
    assert set(handlers) == {signal.SIGINT, signal.SIGTERM}
    with pytest.raises(KeyboardInterrupt) if interrupt else nullcontext():
        handlers[signal.SIGTERM](signal.SIGTERM, None)
    handlers[signal.SIGINT](signal.SIGINT, None)


@pytest.mark.parametrize('arguments, ends, what', [
    ([], True, 'the environment'), (['--ros-args', '-r', 'x'], False, 'these arguments'),
    (None, True, 'these arguments')])
def test_what_ros_rejects_is_named(monkeypatch, arguments, ends, what):
    given = []

    def init(**options):
        given.append(options)
        raise RuntimeError('no')
    monkeypatch.setattr(program.rclpy, 'init', init)
    monkeypatch.setattr(program, 'remove_ros_args', lambda arguments: None)
    with pytest.raises(InputError, match=f'^ROS rejects {what}: no$'):
        program.initialise(arguments, ends)
    options = SignalHandlerOptions.ALL if ends else SignalHandlerOptions.NO
    assert given == [{'args': arguments, 'signal_handler_options': options}]


def test_a_list_of_whole_and_other_numbers_is_named_with_the_remedy():
    with pytest.raises(InputError, match='; write each number of the list with a point, as 0.0$'):
        program.initialise(['--ros-args', '-p', 'camera_in_base:=[0, 0, 0.3, 0, 0, 0, 1]'])


def test_a_node_that_fails_because_ros_ends_is_no_input_error(graph):
    def make():
        rclpy.shutdown()
        raise InvalidParameterTypeException(Parameter('use_sim_time', value='x'), 'BOOL')
    with pytest.raises(InvalidParameterTypeException):
        program.make_node(make)


def test_a_node_that_can_be_made_is_returned():
    assert program.make_node(lambda: 'node') == 'node'
