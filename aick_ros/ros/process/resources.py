# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files that come with the package: where they are, however it was installed."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from aick_ros.errors import InputError

PROFILES_VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'


def config_file(name: str) -> Path:
    """
    Return the path of a file of the folder ``config``.

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
    Give this process the shared-memory segment that images need, unless the user chose one.

    With Fast DDS's default of 512 KiB most best-effort images are lost. It must be called before
    rclpy.init().
    """
    if PROFILES_VARIABLE not in os.environ:
        os.environ[PROFILES_VARIABLE] = str(config_file('fastdds.xml'))
