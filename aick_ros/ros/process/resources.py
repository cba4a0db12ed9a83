# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Paths of the files of the package, however it was installed."""

from __future__ import annotations

import os
import sys
from importlib.metadata import PackageNotFoundError as NotInstalled
from importlib.metadata import version
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from aick_ros.errors import InputError

_OF_JAZZY, _OF_KILTED = 'FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE'


def profiles_variable() -> str:
    """Return the name of the environment variable with the profile, as this Fast DDS reads it."""
    try:
        is_jazzy = int(version('rclpy').split('.')[0]) < 8  # 7.1 in Jazzy, 9.1 in Kilted
    except NotInstalled:
        is_jazzy = True
    return _OF_JAZZY if is_jazzy else _OF_KILTED


def config_file(name: str) -> Path:
    """
    Return the path of a file in the folder ``config``.

    :raises InputError: where it is not installed.
    """
    places = [Path(sys.prefix) / 'share' / 'aick_ros', Path(__file__).parents[3]]
    try:
        places.insert(0, Path(get_package_share_directory('aick_ros')))
    except (PackageNotFoundError, OSError):  # OSError: there is no ament environment
        pass
    for place in places:
        if (place / 'config' / name).is_file():
            return place / 'config' / name
    raise InputError(f'config/{name} is in none of {", ".join(map(str, places))}: install '
                     'aick_ros again')


def fastdds_profile() -> dict[str, str]:
    """
    Return the variable of the environment that names the profile; none where the user set one.

    With the default shared-memory segment of 512 KiB most best-effort images are lost.
    """
    if {_OF_JAZZY, _OF_KILTED} & set(os.environ):  # Kilted reads both
        return {}
    return {profiles_variable(): str(config_file('fastdds.xml'))}


def use_fastdds_profile() -> None:
    """Set the profile of this process; to be called before rclpy.init()."""
    os.environ.update(fastdds_profile())
