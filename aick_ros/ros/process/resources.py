# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Paths of the files of the package, however it was installed."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from aick_ros.errors import InputError

PROFILES_VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'


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


def use_fastdds_profile() -> None:
    """
    Set the Fast DDS profile of this process, unless the user set one.

    With the default shared-memory segment of 512 KiB most best-effort images are lost. Call it
    before rclpy.init().
    """
    if PROFILES_VARIABLE not in os.environ:
        os.environ[PROFILES_VARIABLE] = str(config_file('fastdds.xml'))
