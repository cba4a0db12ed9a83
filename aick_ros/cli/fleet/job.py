# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The task of a fleet: one recording with one set of settings, evaluated on a worker."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import cv2

from aick_ros.cli.fleet.scratch import ScratchSpace, scratch_of, worker_folder
from aick_ros.cli.fleet.urls import is_url
from aick_ros.cli.input.damage_log import DamageCount
from aick_ros.cli.input.reading import Reading
from aick_ros.cli.output.run_folder import RunFolder
from aick_ros.errors import InputError
from aick_ros.evaluation.runs.table import REMARKS, UNUSED, Cell, Row
from aick_ros.evaluation.scores.evaluation import GAPS, Evaluation, evaluate
from aick_ros.evaluation.scores.run_summary import summarize
from aick_ros.settings import Settings
from aick_ros.sources import SourceOptions, open_source


@dataclass(frozen=True)
class Job:
    """
    What to run.

    :param source: as :func:`aick_ros.sources.open_source` takes it.
    :param gaps: of the pairs of frames, as in ``aick evaluate``.
    :param limit: maximum number of frames; None: all.
    :param scratch: for the copy of a recording at a URL.
    """

    source: str
    variant: str
    settings: Settings
    options: SourceOptions = SourceOptions()
    gaps: Sequence[int] = GAPS
    limit: int | None = None
    scratch: ScratchSpace = ScratchSpace()


@dataclass(frozen=True)
class Finished:
    """
    Result of a job, as it is sent back.

    :param recording: name of the recording.
    :param figures: of the table.
    :param files: name -> content, of the folder of the run.
    """

    recording: str
    figures: Row
    files: Mapping[str, bytes]


def run_job(job: Job) -> Finished:
    """
    Run the odometry over a recording and compare with its ground truth, if it has one.

    :raises InputError: where the recording cannot be used; TransferError where it did not arrive.
    """
    cv2.setNumThreads(1)  # the other cores have tasks of their own
    if not is_url(job.source):
        return _run(job, job.source)
    with scratch_of(job.scratch).copy_of(job.source) as copy:
        try:
            finished = _run(job, copy.path)
        except InputError as error:  # the copy does not stay
            raise InputError(str(error).replace(str(copy.path), job.source)) from None
    figures = {name: cell.replace(str(copy.path), job.source) if isinstance(cell, str) else cell
               for name, cell in finished.figures.items()}
    return replace(finished, figures={**figures, 'bytes_copied': copy.bytes_copied})


def _run(job: Job, recording: str | Path) -> Finished:
    started, start = datetime.now(), time.perf_counter()
    source = open_source(recording, job.options)
    reading = Reading(source, job.limit, ahead=False)  # one thread, as cv2 above
    damage, complaints = DamageCount(), list[str]()
    try:
        evaluation = evaluate(reading, job.settings, job.gaps, on_damaged=damage,
                              on_complaint=complaints.append)
    except InputError as error:
        if damage.first is None:
            raise
        raise InputError(f'{error}; the first image that was skipped: {damage.first}') from None
    summary = summarize(reading, evaluation.records, job.settings, time.perf_counter() - start,
                        reading.ended, damage.count)
    with tempfile.TemporaryDirectory(prefix='aick-run-', dir=worker_folder()) as parent:
        with RunFolder(Path(parent), reading.name, job.settings, started) as folder:
            if source.ground_truth is not None:
                folder.write_ground_truth(source.ground_truth)
            for record in evaluation.records:
                folder.add(record)
        folder.write_summary(summary)
        files = {path.name: path.read_bytes() for path in folder.path.iterdir()}
    figures = {
        **dict(_flat(_scores(evaluation), '')), 'ended': summary.ended,
        'damaged_images': damage.count, UNUSED: '; '.join(complaints),
        REMARKS: '; '.join([*(remark.removeprefix(f'{recording}: ') for remark in reading.remarks),
                            *damage.remarks]),
        'duration_s': summary.duration_s,
        'tracked': summary.tracked, 'path_length_m': summary.path_length_m,
        'wall_time_s': summary.wall_time_s, 'peak_memory_mb': summary.peak_memory_mb}
    return Finished(reading.name, figures, files)


def _scores(evaluation: Evaluation) -> dict[str, object]:
    content = evaluation.to_json()
    return {key: content[key] for key in content if key not in ('source', 'settings', 'machine')}


def _flat(content: object, name: str) -> Iterator[tuple[str, Cell]]:
    """Yield the dotted names of all values; lists are left to the JSON of ``aick evaluate``."""
    if isinstance(content, dict):
        for key, value in content.items():
            yield from _flat(value, f'{name}.{key}' if name else str(key))
    elif content is None or isinstance(content, (str, int, float)):
        yield name, content
