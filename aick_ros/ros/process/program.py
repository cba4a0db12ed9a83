# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Start and end of a program that uses ROS."""

from __future__ import annotations

import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

import rclpy
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from aick_ros.borders.streams import say
from aick_ros.errors import InputError
from aick_ros.ros.process.environment import check_variables
from aick_ros.ros.process.signals import ENDINGS, held, ignore

RCLError = rclpy_implementation.RCLError
_Node = TypeVar('_Node', bound=Node)
_Prepared = TypeVar('_Prepared')

_REMEDIES = {'Sequence should be of same type':
             '; write each number of the list with a point, as 0.0'}  # by what rcl says
_UNUSABLE_INPUT = 2  # by definition, the exit code of every command of this package


@contextmanager
def program(name: str, prepare: Callable[[], _Prepared],
            interrupt: bool = False) -> Iterator[_Prepared]:
    """
    Use ROS, with the arguments of the command line, until SIGINT or SIGTERM.

    Either signal shuts the ROS context down, which ends :func:`rclpy.spin`. It does not raise
    KeyboardInterrupt, which could leave a clean-up half done and a thread alive at the end of
    the interpreter. Failures after the shutdown are no errors. An unusable input is reported in
    one line and ends the process with exit code 2.

    :param name: of the program.
    :param prepare: called before ROS is initialised; what it returns is given to the block.
    :param interrupt: whether the first signal raises KeyboardInterrupt as well, for a program
        that blocks outside of ROS.
    """
    try:
        with held():
            prepared = prepare()
            _handle_signals(interrupt)
            initialise()
            if signal.sigpending() & set(ENDINGS):
                ignore()
                sys.exit()  # nothing has begun that had to end
        yield prepared
    except InputError as error:
        say(name, str(error))
        sys.exit(_UNUSABLE_INPUT)
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit()  # also where the block has not begun
    except Exception:
        if rclpy.ok():
            raise  # otherwise a consequence of the shutdown
    finally:
        _finish()


def make_node(make: Callable[[], _Node]) -> _Node:
    """
    Return a node, of any class.

    :raises InputError: where ROS cannot create it, as with security that is not installed.
    """
    try:
        with warnings.catch_warnings():  # of what fails after the reason that is raised
            warnings.simplefilter('ignore', RuntimeWarning)
            return make()
    except (RCLError, InvalidParameterTypeException) as error:
        if not rclpy.ok():
            raise  # a consequence of the shutdown
        reason = ' '.join(str(error).split())
        raise InputError(f'ROS cannot create the node: {reason}') from None


def _handle_signals(interrupt: bool) -> None:
    """Set Python's part of the handling; ROS adds its own, which shuts the context down."""
    is_first = True

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal is_first
        if interrupt and is_first:
            is_first = False
            raise KeyboardInterrupt

    for ending in ENDINGS:
        signal.signal(ending, handle)


def initialise(arguments: list[str] | None = None, ends_by_signals: bool = True) -> None:
    """
    Start ROS.

    :param arguments: None: those of the process.
    :param ends_by_signals: whether SIGINT and SIGTERM shut it down; otherwise they do what Python
        does, so that what uses ROS meanwhile does not fail before.
    :raises InputError: where arguments or environment do not let it start.
    """
    check_variables()
    try:
        # where it parses them first, rcl logs no line of its own about what it rejects
        remove_ros_args(sys.argv if arguments is None else arguments)
        rclpy.init(args=arguments, signal_handler_options=(
            SignalHandlerOptions.ALL if ends_by_signals else SignalHandlerOptions.NO))
    except Exception as error:  # rcl's errors have no common base class
        what = 'the environment' if arguments == [] else 'these arguments'
        remedy = next((remedy for words, remedy in _REMEDIES.items() if words in str(error)), '')
        raise InputError(f'ROS rejects {what}: {error}{remedy}') from None


def _finish() -> None:
    with held():  # those that come now end in ignore()
        try:
            rclpy.try_shutdown()
        except Exception:
            if rclpy.ok():
                raise  # otherwise the signal handler has shut the context down meanwhile
        ignore()
