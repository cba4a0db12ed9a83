# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Arguments of the node that are not those of ROS: help, and parameters of rgbd_odometry."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from aick_ros.errors import InputError

HELP = """\
usage: odom_node [--Group/Name VALUE ...] [--ros-args ...]
       odom_lifecycle_node [--Group/Name VALUE ...] [--ros-args ...]

Odometry from the colour and depth images of one camera.

  --Group/Name VALUE        a parameter of rtabmap_odom's rgbd_odometry, such as --Odom/Strategy 0;
                            the node says what it means here
  -d, --delete_db_on_start  arguments of the SLAM node of RTAB-Map, which change nothing here
  --udebug, --uinfo,        the level of the log, as of rgbd_odometry
  --uwarn, --uerror
  --ros-args -p NAME:=VALUE         a parameter; `ros2 param list` shows all
             --params-file FILE     a parameter file, such as config/odom_node.yaml
             -r rgb/image:=TOPIC    another name of a topic; also depth/image, rgb/camera_info
             -r __node:=NAME        another name of the node
"""
_LEVELS = {'--udebug': 'debug', '--uinfo': 'info', '--uwarn': 'warn', '--uerror': 'error'}
_OF_SLAM = ('-d', '--delete_db_on_start')
_OF_ROS = ('-p', '--param', '-r', '--remap', '--params-file', '--log-level', '-e', '--enclave')
_PARAMETER = re.compile(r'--(\w+/\w+)')


@dataclass(frozen=True)
class Arguments:
    """
    What the arguments say beside those of ROS.

    :param parameters: of ``rgbd_odometry``, value by name.
    :param level: least severity that is logged, '' for that of ROS.
    :param of_slam: those of the SLAM node of RTAB-Map, with which launch files share them.
    """

    parameters: dict[str, str] = field(default_factory=dict)
    level: str = ''
    of_slam: tuple[str, ...] = ()


def read_arguments(argv: Sequence[str]) -> Arguments:
    """
    Return what the arguments of the process say; those of ROS are left to ROS.

    With ``--help`` it prints the help and ends the process.

    :param argv: with the program at the front.
    :raises InputError: for an argument that means nothing.
    """
    # launch passes several arguments in one where they are one substitution
    words = [word for argument in _outside_of_ros(argv[1:]) for word in argument.split()]
    if {'-h', '--help'} & set(words):
        _print_help()
        sys.exit(0)
    parameters, level, of_slam = {}, '', []
    while words:
        word = words.pop(0)
        name = _PARAMETER.fullmatch(word)
        if word in _LEVELS:
            level = _LEVELS[word]
        elif word in _OF_SLAM:
            of_slam.append(word)
        elif name is None:
            raise InputError(_explain(word))
        elif not words or words[0].startswith('--'):
            raise InputError(f'{word} has no value: give one after it')
        else:
            parameters[name[1]] = words.pop(0)
    return Arguments(parameters, level, tuple(of_slam))


def _print_help() -> None:
    try:
        print(HELP, end='', flush=True)
    except OSError as error:
        raise InputError(f'the help cannot be written: {error.strerror}') from None


def _outside_of_ros(arguments: Sequence[str]) -> Iterator[str]:
    """Yield what is not between --ros-args and --; ROS itself would also take away a:=b."""
    is_of_ros = False
    for argument in arguments:
        if argument == '--ros-args':
            is_of_ros = True
        elif is_of_ros and argument == '--':
            is_of_ros = False
        elif not is_of_ros:
            yield argument


def _explain(word: str) -> str:
    if word == '--params':
        return '--params is not known: all parameters are in config/odom_node.yaml'
    if word in _OF_ROS or ':=' in word:
        return f'{word} is an argument of ROS: put --ros-args before it'
    return f'the argument {word} is not known: see --help'
