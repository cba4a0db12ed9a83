# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The folder that a run writes, frame by frame."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterator
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TextIO

from aick_ros import rigid
from aick_ros.cli.files import write_json, write_whole
from aick_ros.errors import InputError
from aick_ros.evaluation.frame_record import STAGES, FrameRecord
from aick_ros.evaluation.run_summary import RunSummary
from aick_ros.parameter_text import config_text
from aick_ros.settings import Settings
from aick_ros.trajectory import format_pose, stamp_to_seconds

_AXES = ('x', 'y', 'z', 'rot_x', 'rot_y', 'rot_z')
COLUMNS = ('stamp', 'status', 'reason', 'keypoints', 'matches',
           *(f'increment_{axis}' for axis in _AXES),
           *(f'increment_variance_{axis}' for axis in _AXES),
           *(f'pose_variance_{axis}' for axis in _AXES),
           *(f'{stage}_ms' for stage in STAGES))
"""Of frames.csv; an increment is empty where there is none, its rotation a rotation vector."""


class RunFolder:
    """
    ``SOURCE-TIME/`` with trajectory.tum and frames.csv, which grow with each frame.

    Both have a line for each frame, lost ones too; each line is handed to the system at once, so
    the files are whole whenever the run ends. ``latest`` beside the folder leads to the newest.

    :param parent: where the folder is made.
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
        self._trajectory.write('# stamp tx ty tz qx qy qz qw\n')
        self._csv.writerow(COLUMNS)
        lead_to(self.path)

    def __enter__(self) -> RunFolder:
        """Return itself; it is closed at the end of the block."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the files."""
        self._trajectory.close()
        self._frames.close()

    def add(self, record: FrameRecord) -> None:
        """Write one frame."""
        self._trajectory.write(format_pose(record.stamp, record.T_odom_camera) + '\n')
        self._csv.writerow(_row(record))
        self._trajectory.flush()
        self._frames.flush()

    def write_summary(self, summary: RunSummary) -> None:
        """Write the figures of the run."""
        write_json(self.path / 'summary.json', summary.to_json())

    def _open(self, name: str) -> TextIO:
        return open(self.path / name, 'w', encoding='utf-8', newline='')


def _row(record: FrameRecord) -> Iterator[str | int]:
    yield from (stamp_to_seconds(record.stamp), record.status.name, record.reason,
                record.keypoints, record.matches)
    if record.increment is None:
        yield from [''] * (2 * len(_AXES))
    else:
        yield from (f'{value:.9f}' for value in record.increment[:3, 3])
        yield from (f'{value:.9f}' for value in rigid.log_rotation(record.increment[:3, :3]))
        yield from (f'{value:.6e}' for value in record.increment_variances)
    yield from (f'{value:.6e}' for value in record.variances)
    yield from (f'{record.timing[stage]:.3f}' for stage in STAGES)


def make_folder(parent: Path, source: str, started: datetime) -> Path:
    """
    Make and return a new folder for a run, named after its source and time.

    :raises InputError: where it cannot be made.
    """
    name = f'{re.sub(r"[^A-Za-z0-9_.-]+", "_", source)}-{started:%Y%m%d-%H%M%S}'
    for number in count(1):
        path = parent / (name if number == 1 else f'{name}-{number}')
        try:
            path.mkdir(parents=True)
        except OSError as error:
            if isinstance(error, FileExistsError) and path.is_dir():
                continue
            raise InputError(f'cannot make the folder {path}: {error.strerror}') from None
        else:
            return path


def lead_to(path: Path) -> None:
    """Have ``latest`` beside a folder lead to it; a file system without links goes without."""
    draft = path.with_name(f'.latest.{os.getpid()}')
    try:
        draft.symlink_to(path.name, target_is_directory=True)
        draft.replace(path.with_name('latest'))
    except OSError:
        draft.unlink(missing_ok=True)
