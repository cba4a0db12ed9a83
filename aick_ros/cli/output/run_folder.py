# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The folder of a run, written frame by frame."""

from __future__ import annotations

import csv
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TextIO

from aick_ros.cli.output.files import write_json, write_whole
from aick_ros.cli.output.plot_folder import removed_if_empty
from aick_ros.errors import InputError
from aick_ros.evaluation.runs import files
from aick_ros.evaluation.runs.frames_csv import cells, columns
from aick_ros.evaluation.scores.frame_record import FrameRecord, stages_of
from aick_ros.evaluation.scores.run_summary import RunSummary
from aick_ros.geometry.trajectory import HEADER, Trajectory, format_pose, trajectory_text
from aick_ros.settings import Settings
from aick_ros.settings.text import config_text


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
            self._trajectory = self._open(files.TRAJECTORY)
            self._frames = self._open(files.FRAMES)
        except OSError as error:
            raise InputError(f'cannot write {error.filename}: {error.strerror}') from None
        write_whole(self.path / 'settings.yaml', config_text(
            settings, title=f'Settings of the run over {source}, {started:%Y-%m-%d %H:%M}.'))
        self._csv = csv.writer(self._frames, lineterminator='\n')
        self._stages: list[str] = []
        self._trajectory.write(HEADER)
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
        self._csv.writerow(cells(record, self._stages))
        self._trajectory.flush()
        self._frames.flush()

    def write_summary(self, summary: RunSummary) -> None:
        """Write the statistics of the run."""
        write_json(self.path / files.SUMMARY, summary.to_json())

    def write_ground_truth(self, ground_truth: Trajectory) -> None:
        """Write the true poses, by which the run can be scored without its recording."""
        write_whole(self.path / files.GROUND_TRUTH, trajectory_text(ground_truth))

    def _open(self, name: str) -> TextIO:
        return open(self.path / name, 'w', encoding='utf-8', newline='')


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
        except RecursionError:  # of Path.mkdir
            raise InputError(f'cannot make the folder {path}: it has too many folders') from None
    return path


@contextmanager
def whole_folder(parent: Path, source: str, started: datetime) -> Iterator[Path]:
    """
    Make a new folder for a run; it is removed, with all in it, where the block fails.

    The link ``latest`` points to it after the block.

    :raises InputError: where it cannot be made.
    """
    with removed_if_empty(parent):
        path = make_folder(parent, source, started)
        try:
            yield path
        except BaseException:  # Ctrl-C too
            shutil.rmtree(path, ignore_errors=True)
            raise
    link_latest(path)


def link_latest(path: Path) -> None:
    """Link ``latest`` beside a folder to it, if the file system has links; a file stays."""
    draft, latest = path.with_name(f'.latest.{os.getpid()}'), path.with_name('latest')
    if latest.exists() and not latest.is_symlink():
        return
    try:
        draft.symlink_to(path.name, target_is_directory=True)
        draft.replace(latest)
    except OSError:
        draft.unlink(missing_ok=True)
