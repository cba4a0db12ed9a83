# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Runs, read from the folders that ``aick replay`` writes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aick_ros.borders.bounded_json import bounded_json
from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_CONFIGURATION_BYTES
from aick_ros.borders.names import quoted_if_blank
from aick_ros.errors import InputError
from aick_ros.evaluation.runs import files
from aick_ros.evaluation.runs.frames_csv import read_frames
from aick_ros.evaluation.runs.table import DONE, TABLE, read_texts
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.geometry.trajectory import Trajectory, read_trajectory


@dataclass(frozen=True, eq=False)
class Run:
    """
    One run of the odometry over a recording.

    :param source: name of the recording.
    :param records: of all frames with a stamp of their own, in order.
    :param ground_truth: of the recording, if it has one.
    :param peak_memory_mb: of the process that made the run; None in runs of earlier versions.
    :param settings: dotted name -> value.
    :param machine: as :func:`aick_ros.evaluation.scores.machine.machine_facts` returns it.
    """

    path: Path
    source: str
    records: Sequence[FrameRecord]
    ground_truth: Trajectory | None
    peak_memory_mb: float | None
    settings: Mapping[str, Any]
    machine: Mapping[str, Any]


def read_run(path: Path) -> Run:
    """
    Read the folder of a run.

    :raises InputError: where it is not the folder of a run that ended, or a file is damaged.
    """
    summary = _summary(path / files.SUMMARY)
    truth = path / files.GROUND_TRUTH
    records = read_frames(path / files.FRAMES, read_trajectory(path / files.TRAJECTORY))
    if not records:
        raise InputError(f'{path / files.FRAMES} has no frames')
    return Run(path, summary['source'], records,
               read_trajectory(truth) if truth.exists() else None, summary.get('peak_memory_mb'),
               summary['settings'], summary['machine'])


def reject_demo(path: Path) -> None:
    """
    Check that a folder is not that of a demo, which has no frames.

    :raises InputError: naming the commands for it.
    """
    name = os.path.basename(os.path.realpath(path))  # that of the folder, also by runs/latest
    if (not name.startswith(files.DEMO) or not (path / files.TRAJECTORY).exists()
            or (path / files.FRAMES).exists()):
        return
    bag = path / files.BAG
    recording = str(bag) if bag.exists() else 'SOURCE'
    raise InputError(f'{path} is the folder of a demo (aick demo), not of a run: aick view '
                     f'{recording} shows the recording that it played, aick replay {recording} '
                     'makes a run of it to view or compare')


def run_folders(path: Path) -> list[Path]:
    """
    Return the folders of runs that a path stands for: itself, those in it, or those of a table.

    :raises InputError: where there is none, it is a demo, or a table has runs with several
        settings.
    """
    if path.suffix == '.parquet':
        return _of_table(path)
    if (path / TABLE).exists():
        return _of_table(path / TABLE)
    if (path / files.SUMMARY).exists():
        return [path]
    if not path.is_dir():
        raise InputError(f'{quoted_if_blank(path)} is not a folder: name the folder of a run of '
                         'aick replay, or a folder of such folders')
    folders = sorted(folder for folder in path.iterdir()
                     if (folder / files.SUMMARY).exists() and not folder.is_symlink())
    if not folders:
        reject_demo(path)
        raise InputError(f'{path} has no {files.SUMMARY}, nor has a folder in it: name the folder '
                         'of a run of aick replay that has ended')
    return folders


def _of_table(path: Path) -> list[Path]:
    """Return the folders of the runs of a table that were done."""
    rows = [row for row in read_texts(path, ('status', 'variant', 'run'))
            if row['status'] == DONE]
    variants = sorted({str(row['variant']) for row in rows})
    if len(variants) > 1:
        raise InputError(f'{path} has runs with several settings: name the folder of one of '
                         f'them, for example {path.parent / "runs" / variants[0]}')
    if not rows:
        raise InputError(f'{path} has no run that was done')
    return list(dict.fromkeys(path.parent / str(row['run']) for row in rows))


def _summary(path: Path) -> dict[str, Any]:
    """Return the content of summary.json, with the keys and types that a run needs."""
    text = read_text(path, 'the summary of the run', MAX_CONFIGURATION_BYTES)
    try:
        content = bounded_json(text)
    except ValueError as error:
        raise InputError(f'{path} is not JSON ({error}); use the folder as aick replay wrote it'
                         ) from None
    kinds = {'source': str, 'settings': dict, 'machine': dict}
    is_run = isinstance(content, dict) and all(
        isinstance(content.get(key), kind) for key, kind in kinds.items()) and isinstance(
            content.get('peak_memory_mb'), (int, float, type(None)))
    if not is_run:
        raise InputError(f'{path} is not the summary of a run; use the folder as aick replay '
                         'wrote it')
    result: dict[str, Any] = content
    return result
