# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Trajectories, and their TUM text format: stamp tx ty tz qx qy qz qw."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_LIST_BYTES
from aick_ros.borders.values import number, required_array, whole_number
from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import MAX_STAMP, NANOSECONDS

HEADER = '# stamp tx ty tz qx qy qz qw\n'
"""First line of a TUM trajectory file, a comment."""


@dataclass(frozen=True)
class Trajectory:
    """
    Camera poses over time.

    :param stamps: N int64 [ns], strictly increasing.
    :param poses: Nx4x4 float64, ``T_world_camera`` [m].
    :raises InputError: where the arrays do not fit each other, or the stamps do not increase.
    """

    stamps: np.ndarray
    poses: np.ndarray

    def __post_init__(self) -> None:
        """Reject arrays of wrong type or shape, and stamps out of order."""
        required_array(self.stamps, np.int64, (None,), 'the stamps of a trajectory')
        required_array(self.poses, np.float64, (len(self.stamps), 4, 4),
                       'the poses of a trajectory')
        if not (self.stamps[1:] > self.stamps[:-1]).all():
            raise InputError('the stamps of a trajectory do not increase: sort them, each once')

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.stamps)

    @cached_property
    def median_interval(self) -> float:
        """Median interval between consecutive poses [s]; infinite for fewer than two."""
        if len(self) < 2:
            return math.inf
        return float(np.median(np.diff(self.stamps))) / NANOSECONDS

    def at(self, stamp: int, max_gap: float = np.inf) -> np.ndarray | None:
        """
        Return the pose at a stamp, interpolated (rotation along the shortest arc).

        :param stamp: [ns].
        :param max_gap: longest interval between two poses that is interpolated [s].
        :returns: 4x4 float64; None outside of the trajectory or in a longer interval.
        :raises InputError: where these are no numbers.
        """
        stamp = whole_number(stamp, 'the stamp')
        after = int(np.searchsorted(self.stamps, stamp))
        if after < len(self) and self.stamps[after] == stamp:
            pose: np.ndarray = self.poses[after]
            return pose.copy()
        if after in (0, len(self)):
            return None
        before = after - 1
        gap = int(self.stamps[after] - self.stamps[before])
        if gap > number(max_gap, 'the longest interval') * NANOSECONDS:
            return None
        fraction = (stamp - int(self.stamps[before])) / gap
        return se3.interpolate(self.poses[before], self.poses[after], fraction)


def seconds_to_stamp(text: str) -> int:
    """
    Return the stamp [ns] of decimal seconds, exact to the nanosecond.

    :raises ValueError: if the text is not a number, or beyond the stamps of ROS.
    """
    whole, _, fraction = text.strip().partition('.')
    if whole.isdecimal() and (fraction or '0').isdecimal():
        stamp = int(whole) * NANOSECONDS + int(fraction[:9].ljust(9, '0'))
    elif math.isfinite(nanoseconds := float(text) * NANOSECONDS):
        stamp = round(nanoseconds)
    else:
        raise ValueError(f'{text!r} is not a stamp')
    if not 0 <= stamp <= MAX_STAMP:
        raise ValueError(f'{text} s is not from 0 to {stamp_to_seconds(MAX_STAMP)} s')
    return stamp


def stamp_to_seconds(stamp: int) -> str:
    """Return a stamp [ns] as decimal seconds with nine decimals."""
    sign, stamp = ('-', -stamp) if stamp < 0 else ('', stamp)
    return f'{sign}{stamp // NANOSECONDS}.{stamp % NANOSECONDS:09d}'


def format_pose(stamp: int, pose: np.ndarray) -> str:
    """Return one line of a TUM trajectory file, without the newline."""
    numbers = np.concatenate([pose[:3, 3], se3.to_quaternion(pose[:3, :3])])
    return stamp_to_seconds(stamp) + ''.join(f' {number:.9f}' for number in numbers)


def read_trajectory(path: Path) -> Trajectory:
    """
    Read a TUM trajectory file; lines with # are comments, repeated stamps are ignored.

    :raises InputError: with file and line, if the file cannot be read or a line is not a pose.
    """
    stamps, poses = [], []
    lines = read_text(path, 'the trajectory', MAX_LIST_BYTES).splitlines()
    for row, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith('#'):
            continue
        words = line.replace(',', ' ').split()
        try:
            stamp = seconds_to_stamp(words[0])
            x, y, z, *quaternion = (float(word) for word in words[1:8])
            pose = se3.from_quaternion(quaternion, (x, y, z))
        except (ValueError, IndexError):
            raise InputError(f'{path}, line {row}: {line.strip()[:80]!r} is not a pose; '
                             'a line must have stamp tx ty tz qx qy qz qw, the stamp from 0 to '
                             f'{stamp_to_seconds(MAX_STAMP)} s') from None
        stamps.append(stamp)
        poses.append(pose)
    if not stamps:
        raise InputError(f'{path} has no poses')
    unique, first = np.unique(np.array(stamps, np.int64), return_index=True)
    return Trajectory(unique, np.array(poses)[first])


def trajectory_text(trajectory: Trajectory) -> str:
    """Return the content of a TUM trajectory file, with nine decimals."""
    lines = [format_pose(int(stamp), pose)
             for stamp, pose in zip(trajectory.stamps, trajectory.poses)]
    return HEADER + ''.join(f'{line}\n' for line in lines)


def write_trajectory(path: Path, trajectory: Trajectory) -> None:
    """Write a TUM trajectory file with nine decimals."""
    path.write_text(trajectory_text(trajectory))
