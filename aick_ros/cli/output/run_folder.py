# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The folder of a run, written frame by frame."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import combinations_with_replacement, count
from pathlib import Path
from typing import TextIO

import numpy as np

from aick_ros.cli.output.files import write_json, write_whole
from aick_ros.errors import InputError
from aick_ros.evaluation.scores.frame_record import FrameRecord, stages_of
from aick_ros.evaluation.scores.run_summary import RunSummary
from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import format_pose, stamp_to_seconds
from aick_ros.settings import Settings
from aick_ros.settings.text import config_text

_AXES = ('x', 'y', 'z', 'rot_x', 'rot_y', 'rot_z')
_TRIANGLE = np.triu_indices(6)
_NAMES = tuple(f'cov_{a}{b}' for a, b in combinations_with_replacement(
    ('x', 'y', 'z', 'rx', 'ry', 'rz'), 2))
"""Upper triangle of a covariance, row by row."""


def columns(stages: Sequence[str]) -> tuple[str, ...]:
    """
    Return the columns of frames.csv.

    The columns of the increment are empty for a frame without one; its rotation is a rotation
    vector. Covariances are upper triangles, row by row [m^2, m rad, rad^2].

    :param stages: timed stages of the odometry.
    """
    return ('stamp', 'status', 'reason', 'keypoints', 'matches',
            *(f'increment_{axis}' for axis in _AXES),
            *(f'increment_variance_{axis}' for axis in _AXES),
            *(f'pose_variance_{axis}' for axis in _AXES),
            *(f'{stage}_ms' for stage in stages),
            *(f'increment_{name}' for name in _NAMES), *(f'pose_{name}' for name in _NAMES))


class RunFolder:
    """
    ``SOURCE-TIME/`` with trajectory.tum and frames.csv, which grow with each frame.

    Both have a line per frame, including lost ones. Each line is flushed, so that the files are
    complete whenever the run ends. The link ``latest`` beside the folder points to the newest run.

    :param parent: folder in which the folder is made.
    :param source: name of the recording.
    :raises InputError: where it cannot be written.
    """

    def __init__(self, parent: Path, source: str, settings: Settings, started: datetime) -> None:
        self.path = make_folder(parent, source, started)
        try:
            self._trajectory = self._open('trajectory.tum')
            self._frames = self._open('frames.csv')
        except OSError as error:
            raise InputError(f'cannot write {error.filename}: {error.strerror}') from None
        write_whole(self.path / 'settings.yaml', config_text(
            settings, title=f'Settings of the run over {source}, {started:%Y-%m-%d %H:%M}.'))
        self._csv = csv.writer(self._frames, lineterminator='\n')
        self._stages: list[str] = []
        self._trajectory.write('# stamp tx ty tz qx qy qz qw\n')
        link_latest(self.path)

    def __enter__(self) -> RunFolder:
        """Return itself; it is closed at the end of the block."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the files."""
        self._trajectory.close()
        self._frames.close()

    def add(self, record: FrameRecord) -> None:
        """Write one frame; the stages of the first frame determine the columns."""
        if not self._stages:
            self._stages = stages_of([record])
            self._csv.writerow(columns(self._stages))
        self._trajectory.write(format_pose(record.stamp, record.T_odom_camera) + '\n')
        self._csv.writerow(_row(record, self._stages))
        self._trajectory.flush()
        self._frames.flush()

    def write_summary(self, summary: RunSummary) -> None:
        """Write the statistics of the run."""
        write_json(self.path / 'summary.json', summary.to_json())

    def _open(self, name: str) -> TextIO:
        return open(self.path / name, 'w', encoding='utf-8', newline='')


def _row(record: FrameRecord, stages: Sequence[str]) -> Iterator[str | int]:
    yield from (stamp_to_seconds(record.stamp), record.status.name, record.reason,
                record.keypoints, record.matches)
    if record.increment is None:
        yield from [''] * (2 * len(_AXES))
    else:
        motion = record.increment.pose
        yield from (f'{value:.9f}' for value in motion.translation)
        yield from (f'{value:.9f}' for value in se3.log_rotation(motion.rotation))
        yield from (f'{value:.6e}' for value in np.diag(motion.covariance))
    yield from (f'{value:.6e}' for value in np.diag(record.pose.covariance))
    yield from (f'{record.timing[stage]:.3f}' if stage in record.timing else ''
                for stage in stages)
    # enough digits for the matrix to stay positive definite
    if record.increment is None:
        yield from [''] * len(_TRIANGLE[0])
    else:
        yield from (f'{value:.12e}' for value in record.increment.pose.covariance[_TRIANGLE])
    yield from (f'{value:.12e}' for value in record.pose.covariance[_TRIANGLE])


def make_folder(parent: Path, source: str, started: datetime) -> Path:
    """
    Make a new folder for a run, named after its source and time, and return its path.

    :raises InputError: where it cannot be made.
    """
    name = f'{re.sub(r"[^A-Za-z0-9_.-]+", "_", source)}-{started:%Y%m%d-%H%M%S}'
    for number in count(1):
        path = parent / (name if number == 1 else f'{name}-{number}')
        try:
            path.mkdir(parents=True)
            break
        except OSError as error:
            if isinstance(error, FileExistsError) and path.is_dir():
                continue
            raise InputError(f'cannot make the folder {path}: {error.strerror}') from None
    return path


def link_latest(path: Path) -> None:
    """Link ``latest`` beside a folder to it, if the file system has links."""
    draft = path.with_name(f'.latest.{os.getpid()}')
    try:
        draft.symlink_to(path.name, target_is_directory=True)
        draft.replace(path.with_name('latest'))
    except OSError:
        draft.unlink(missing_ok=True)
