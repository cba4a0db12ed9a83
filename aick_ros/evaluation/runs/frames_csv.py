# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Table of all frames of a run, frames.csv.

A line has the stamp of a frame, its status, its increment with covariance, the covariance of its
pose, and the times of the stages. Rotations are rotation vectors; covariances are upper triangles,
row by row [m^2, m rad, rad^2]. The columns of the increment are empty for a frame without one.
The poses themselves are in trajectory.tum.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np

from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_FRAMES_BYTES
from aick_ros.errors import InputError
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.trajectory import Trajectory, seconds_to_stamp, stamp_to_seconds
from aick_ros.registration.status import Status

_AXES = ('x', 'y', 'z', 'rot_x', 'rot_y', 'rot_z')
_TRIANGLE = np.triu_indices(6)
_LARGEST = 1e16  # chosen: the square of the largest distance that is supported [m^2]
_COVARIANCE = tuple(f'cov_{a}{b}' for a, b in combinations_with_replacement(
    ('x', 'y', 'z', 'rx', 'ry', 'rz'), 2))
"""Upper triangle of a covariance, row by row."""


def columns(stages: Sequence[str]) -> tuple[str, ...]:
    """
    Return the names of the columns.

    :param stages: timed stages of the odometry.
    """
    return ('stamp', 'status', 'reason', 'keypoints', 'matches', 'increment_interval',
            *(f'increment_{axis}' for axis in _AXES),
            *(f'increment_variance_{axis}' for axis in _AXES),
            *(f'pose_variance_{axis}' for axis in _AXES),
            *(f'{stage}_ms' for stage in stages),
            *(f'increment_{name}' for name in _COVARIANCE),
            *(f'pose_{name}' for name in _COVARIANCE))


def cells(record: FrameRecord, stages: Sequence[str]) -> Iterator[str | int]:
    """
    Yield the cells of the line of a frame.

    :param stages: those of :func:`columns`.
    """
    yield from (stamp_to_seconds(record.stamp), record.status.name, record.reason,
                record.keypoints, record.matches)
    if record.increment is None:
        yield from [''] * (1 + 2 * len(_AXES))
    else:
        motion = record.increment.pose
        yield f'{record.increment.interval:.9f}'
        yield from (f'{value:.9f}' for value in motion.translation)
        yield from (f'{value:.9f}' for value in se3.log_rotation(motion.rotation))
        yield from (f'{value:.6e}' for value in np.diag(motion.covariance))
    yield from (f'{value:.6e}' for value in np.diag(record.pose.covariance))
    yield from (f'{record.timing[stage]:.3f}' if stage in record.timing else ''
                for stage in stages)
    # enough digits for the matrix to stay positive definite
    if record.increment is None:
        yield from [''] * len(_COVARIANCE)
    else:
        yield from (f'{value:.12e}' for value in record.increment.pose.covariance[_TRIANGLE])
    yield from (f'{value:.12e}' for value in record.pose.covariance[_TRIANGLE])


def read_frames(path: Path, trajectory: Trajectory) -> list[FrameRecord]:
    """
    Read the frames of a run that have a pose; rejected increments are not in the file.

    :param path: of frames.csv.
    :param trajectory: the poses of the run.
    :raises InputError: with file and line, where the file cannot be read or a line is not one of
        this table.
    """
    text = read_text(path, 'the table of frames', MAX_FRAMES_BYTES)
    lines = csv.DictReader(text.splitlines(), strict=True)
    poses = {int(stamp): pose for stamp, pose in zip(trajectory.stamps, trajectory.poses)}
    records = []
    try:
        for line in lines:
            stamp = seconds_to_stamp(line['stamp'])
            if stamp in poses:
                records.append(_record(line, stamp, poses[stamp]))
    except (KeyError, ValueError, TypeError, AttributeError, csv.Error):
        raise InputError(f'{path}, line {lines.line_num}: it is not a frame of a run; use the '
                         'folder as aick replay wrote it') from None
    return records


def _record(line: Mapping[str, str], stamp: int, pose: np.ndarray) -> FrameRecord:
    """Return the frame of a line."""
    timing = {name.removesuffix('_ms'): _number(cell) for name, cell in line.items()
              if name.endswith('_ms') and cell}
    increment = None
    if line['increment_interval']:
        motion = np.array([_number(line[f'increment_{axis}']) for axis in _AXES])
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = se3.exp_rotation(motion[3:]), motion[:3]
        increment = Increment(PoseWithCovariance(matrix, _covariance(line, 'increment')),
                              _number(line['increment_interval']))
    return FrameRecord(
        stamp, Status[line['status']], line['reason'],
        PoseWithCovariance(pose, _covariance(line, 'pose')), int(line['keypoints']),
        int(line['matches']), timing, increment)


def _number(cell: str, may_be_infinite: bool = False) -> float:
    """Return a number of a run, not so large that sums of its squares would overflow."""
    number = float(cell)
    if not (abs(number) <= _LARGEST or may_be_infinite and not math.isfinite(number)):
        raise ValueError
    return number


def _covariance(line: Mapping[str, str], of: str) -> np.ndarray:
    """Return a covariance, 6x6."""
    upper = np.zeros((6, 6))
    # not finite where nothing measured the pose
    upper[_TRIANGLE] = [_number(line[f'{of}_{name}'], may_be_infinite=True)
                        for name in _COVARIANCE]
    covariance: np.ndarray = upper + np.triu(upper, 1).T
    return covariance
