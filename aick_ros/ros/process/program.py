# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How a program that uses ROS begins and ends."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rclpy
from rclpy.executors import ExternalShutdownException

from aick_ros.errors import InputError

_UNUSABLE_INPUT = 2


@contextmanager
def program(name: str, prepare: Callable[[], None] = lambda: None) -> Iterator[None]:
    """
    Use ROS, with the arguments of the command line, until the program is told to end.

    Ctrl-C, SIGTERM and what fails because of them are no errors. Input that cannot be used is
    told in one line, and ends the process with exit code 2.

    :param name: of the program.
    :param prepare: called before ROS begins.
    """
    try:
        with _ending_held():
            prepare()
            _initialise()
        yield
    except InputError as error:
        print(f'{name}: {error}', file=sys.stderr)
        sys.exit(_UNUSABLE_INPUT)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:
        if rclpy.ok():
            raise  # else it was told to end in the middle of something
    finally:
        _finish()


@contextmanager
def _ending_held() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM wait until ROS handles them."""
    endings = (signal.SIGINT, signal.SIGTERM)
    signal.pthread_sigmask(signal.SIG_BLOCK, endings)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, endings)


def _initialise() -> None:
    try:
        rclpy.init()
    except Exception as error:  # rclpy has its own types for what rcl refuses
        raise InputError(f'ROS does not take these arguments: {error}') from None


def _finish() -> None:
    try:
        rclpy.try_shutdown()
    except Exception:
        if rclpy.ok():
            raise  # else the handler of a signal was faster by a moment
