# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Variables of the environment with which ROS would end the process, or print lines of its own."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from xml.etree import ElementTree

from aick_ros.borders.files import read_bytes
from aick_ros.borders.limits import MAX_CONFIGURATION_BYTES
from aick_ros.errors import InputError

_LAST_DOMAIN = 232  # by definition: with a higher one, the ports of DDS exceed 65535
_LOG_PLACES = ('HOME', 'ROS_HOME', 'ROS_LOG_DIR')
_SWITCHES = ('RCUTILS_LOGGING_USE_STDOUT', 'RCUTILS_COLORIZED_OUTPUT',
             'RCUTILS_LOGGING_BUFFERED_STREAM')
_ROOTS = ('dds', 'profiles')
_PROFILES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')


def check_middleware() -> None:
    """
    Check, before rclpy is imported, that it finds the middleware of ``RMW_IMPLEMENTATION``.

    Where it does not, its import ends the process, so that a child tries it; a middleware that
    the sourced workspaces have needs no trial.

    :raises InputError: where there is no such middleware.
    """
    name = os.environ.get('RMW_IMPLEMENTATION', '')
    prefixes = filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep))
    if not name or any(Path(prefix, 'share/ament_index/resource_index/rmw_typesupport', name)
                       .is_file() for prefix in prefixes):
        return
    child = os.fork()
    if not child:
        _import_silently()
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]):
        raise InputError(f'RMW_IMPLEMENTATION is {name}, which this ROS does not have: install '
                         'it, or unset the variable')


def _import_silently() -> None:
    """Import ROS and end the process, with 0 also where it is not installed."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nothing, stream)
    try:
        import_module('rclpy.impl.implementation_singleton')
    finally:
        os._exit(0)


def check_variables() -> None:
    """
    Check, before ROS is initialised, what it would end the process for or print lines about.

    :raises InputError: naming the variable.
    """
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    if domain.isdecimal() and int(domain) > _LAST_DOMAIN:
        raise InputError(f'ROS_DOMAIN_ID is {domain}: at most {_LAST_DOMAIN} is possible')
    if not any(map(os.environ.get, _LOG_PLACES)):
        raise InputError('ROS has no place for its log: set HOME or ROS_LOG_DIR')
    for name in _SWITCHES:
        if (value := os.environ.get(name, '')) not in ('', '0', '1'):
            raise InputError(f'{name} is {value}: 0 or 1 is required')
    for name in _PROFILES:
        if value := os.environ.get(name, ''):
            _check_profiles(name, value)


def _check_profiles(name: str, path: str) -> None:
    """Raise InputError where Fast DDS would print lines about its file of profiles."""
    if not os.path.isfile(path):
        raise InputError(f'{name} is {path}: there is no such file')
    try:
        root = ElementTree.fromstring(read_bytes(Path(path), 'the profiles of Fast DDS',
                                                 MAX_CONFIGURATION_BYTES))
    except (ElementTree.ParseError, LookupError) as error:  # the last of unknown encodings
        raise InputError(f'{name} is {path}: it is not XML ({error}); name a file of profiles, or '
                         'unset the variable') from None
    if root.tag.rpartition('}')[2] not in _ROOTS:
        raise InputError(f'{name} is {path}: it has no profiles of Fast DDS, as {root.tag!r} is '
                         'none of its elements; name another file, or unset the variable')
