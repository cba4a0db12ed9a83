# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The folder of a run, written frame by frame."""

from __future__ import annotations

import csv
import os
import re
import shutil
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from datetime import datetime
from io import StringIO
from itertools import count
from pathlib import Path

from aick_ros.cli.output.files import write_json, write_whole
from aick_ros.cli.output.growing_file import GrowingFile
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

    Both have a line per frame, including lost ones, and are complete whenever the run ends, also
    where the disk is full. A folder without a frame is removed at the end of the block. The link
    ``latest`` beside it points to the newest run.

    :param parent: folder in which the folder is made.
    :param source: name of the recording.
    :raises InputError: where it cannot be written.
    """

    def __init__(self, parent: Path, source: str, settings: Settings, started: datetime) -> None:
        self._is_empty = True
        self._stages: list[str] = []
        self._parts = ExitStack()
        with self._parts:
            self._parts.enter_context(removed_if_empty(parent))
            self.path = make_folder(parent, source, started)
            self._parts.callback(self._remove_if_empty)
            self._trajectory = self._growing(files.TRAJECTORY)
            self._frames = self._growing(files.FRAMES)
            write_whole(self.path / 'settings.yaml', config_text(
                settings, title=f'Settings of the run over {source}, {started:%Y-%m-%d %H:%M}.'))
            self._trajectory.append(HEADER)
            self._parts = self._parts.pop_all()

    def __enter__(self) -> RunFolder:
        """Return itself; it is closed at the end of the block."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the files."""
        self._parts.close()

    def add(self, record: FrameRecord) -> None:
        """
        Write one frame; the stages of the first frame determine the columns.

        :raises InputError: where the disk is full, say; what was written before stays complete.
        """
        before = self._frames.size
        if self._is_empty:
            self._stages = stages_of([record])
            self._frames.append(_row(columns(self._stages)))
        try:
            self._frames.append(_row(cells(record, self._stages)))
            self._trajectory.append(format_pose(record.stamp, record.T_odom_camera) + '\n')
        except InputError:
            self._frames.cut(before)
            raise
        if self._is_empty:
            self._is_empty = False
            link_latest(self.path)

    def write_summary(self, summary: RunSummary) -> None:
        """Write the statistics of the run."""
        write_json(self.path / files.SUMMARY, summary.to_json())

    def write_ground_truth(self, ground_truth: Trajectory) -> None:
        """Write the true poses, by which the run can be scored without its recording."""
        write_whole(self.path / files.GROUND_TRUTH, trajectory_text(ground_truth))

    def _growing(self, name: str) -> GrowingFile:
        file = GrowingFile(self.path / name)
        self._parts.callback(file.close)
        return file

    def _remove_if_empty(self) -> None:
        if self._is_empty:
            shutil.rmtree(self.path, ignore_errors=True)


def _row(row: Iterable[object]) -> str:
    """Return a line of CSV."""
    text = StringIO()
    csv.writer(text, lineterminator='\n').writerow(row)
    return text.getvalue()


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
            raise InputError(f'cannot make the folder {path}: {error.strerror}; name another one '
                             'with --out') from None
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
