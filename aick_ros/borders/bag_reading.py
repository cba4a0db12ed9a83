# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Checks and limits that precede the reading of any bag."""

from __future__ import annotations

from pathlib import Path

from aick_ros.borders.bag_limits import check_bag
from aick_ros.borders.bag_metadata import limit_metadata
from aick_ros.borders.bag_names import escape_names
from aick_ros.borders.chunk_messages import limit_messages
from aick_ros.borders.ros1_index import limit_index
from aick_ros.borders.unpacking import limit_unpacking


def prepare_to_read(path: Path) -> None:
    """
    Check the files of a bag, and let rosbags read it within the limits of this package.

    :param path: folder of a ROS 2 bag, one of its files, or a ROS 1 bag.
    :raises InputError: as :func:`check_bag` does.
    """
    check_bag(path)
    limit_unpacking()
    limit_messages()
    limit_index()
    limit_metadata()
    escape_names()
