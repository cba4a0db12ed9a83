# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The executables: each imports its program, or says which package is missing."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from signal import SIGTERM
from types import ModuleType

from aick_ros.ros.process.signals import hold

_PACKAGES = {'rosbags': 'pip install rosbags', 'cv2': 'apt install python3-opencv',
             'numpy': 'apt install python3-numpy'}
_MEMORY = 1_000_000_000  # [byte] of addresses; measured: with 850 OpenBLAS ends the process
_OPEN_FILES = 32  # chosen: the node with one neighbour has 18


def odom_node() -> None:
    """Run the odometry node."""
    _run('odom_node', 'aick_ros.ros.odom_node')


def odom_lifecycle_node() -> None:
    """Run the odometry node with a life cycle."""
    _run('odom_lifecycle_node', 'aick_ros.ros.odom_lifecycle_node')


def bag_player() -> None:
    """Play a bag."""
    _run('bag_player', 'aick_ros.ros.playback.bag_player')


def _run(name: str, module_name: str) -> None:
    # until the program has its handlers: an interrupted import fails in unexpected ways, and of
    # two signals the second would interrupt the handling of the first
    hold()
    from aick_ros.borders.allocator import keep_freed_memory
    from aick_ros.borders.parent import end_with_parent
    from aick_ros.borders.streams import flush_output, open_streams
    open_streams()
    keep_freed_memory()
    end_with_parent(SIGTERM)
    try:
        _imported(name, module_name).main()
    finally:
        flush_output()


def _imported(name: str, module_name: str) -> ModuleType:
    """Import the module of a program, or end with a sentence."""
    from aick_ros.borders import no_memory
    from aick_ros.borders.address_space import check_address_space
    from aick_ros.borders.libraries import check_libraries
    from aick_ros.borders.open_files import check_open_files
    from aick_ros.borders.streams import say
    from aick_ros.errors import InputError, installation, package_of
    from aick_ros.ros.parameter_files import check_parameter_files
    from aick_ros.ros.process.environment import check_middleware, check_variables
    try:
        check_address_space(_MEMORY, 'the libraries of this program')
        check_open_files(_OPEN_FILES, 'ROS and its libraries')
        _check_arguments(sys.argv)
        check_libraries()
        check_variables()
        check_parameter_files(sys.argv)
        check_middleware()
        return import_module(module_name)
    except InputError as error:
        say(name, str(error))
    except ModuleNotFoundError as error:
        if (error.name or '').startswith('aick_ros'):
            raise
        package = package_of(error)
        remedy = _PACKAGES.get(package, "source a ROS 2 Jazzy workspace, or "
                               + installation('ros'))
        say(name, f'{error.name} is not installed: {remedy}')
    except (ImportError, MemoryError) as error:
        if not no_memory.is_of_memory(error):
            raise
        say(name, no_memory.SENTENCE)
    sys.exit(2)


def _check_arguments(argv: Sequence[str]) -> None:
    """Raise InputError where an argument is not UTF-8, which ROS would not say."""
    from aick_ros.errors import InputError
    for argument in argv:
        try:
            argument.encode()
        except UnicodeEncodeError:
            raise InputError(f'the argument {argument} is not UTF-8, as ROS requires: rename '
                             'what it names, or give a link to it') from None
