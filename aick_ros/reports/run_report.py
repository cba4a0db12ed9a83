# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Report of a run as one HTML file."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from datetime import datetime

import numpy as np
from matplotlib.figure import Figure

from aick_ros.borders.names import counted
from aick_ros.evaluation.scores.frame_record import FrameRecord, is_level, trajectory_of
from aick_ros.evaluation.scores.run_summary import RunSummary
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.geometry.trajectory import Trajectory, stamp_to_seconds
from aick_ros.registration.status import Status
from aick_ros.reports import canvas, page
from aick_ros.reports.path_plot import path_figure
from aick_ros.reports.run_plots import error_figure, timing_figure, tracking_figure
from aick_ros.settings import Settings
from aick_ros.settings.parameter import values

_T_body_optical = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
_MAX_LOSSES = 20


def report(summary: RunSummary, records: Sequence[FrameRecord],
           ground_truth: Trajectory | None, started: datetime) -> str:
    """
    Return the report of a run, a self-contained HTML page.

    :param records: of all frames, at least one.
    :param started: start time of the run.
    """
    return page.page(f'{summary.source}: odometry', *_head(summary, started),
                     *_pictures(records, ground_truth), *_losses(summary, records),
                     *_settings(summary), *_machine(summary))


def _head(summary: RunSummary, started: datetime) -> Iterator[str]:
    yield page.heading(summary.source, 1)
    frames = counted(summary.frames, 'frame')
    yield page.paragraph(f'{frames}, {summary.duration_s:.1f} s, run on '
                         f'{started:%d %B %Y at %H:%M}', 'quiet')
    if summary.ended != 'complete':
        yield page.paragraph(f'This run is not complete: {summary.ended}', 'notice')
    if summary.damaged_images:
        were = 'was' if summary.damaged_images == 1 else 'were'
        yield page.paragraph(f'{counted(summary.damaged_images, "image")} could not be used and '
                             f'{were} skipped.', 'notice')
    covered = summary.trajectory.covered_frames
    if covered is not None and covered < summary.frames:
        yield page.paragraph(f'The ground truth covers {covered} of {frames}: errors are of these '
                             'alone.', 'notice')
    yield page.tiles(_tiles(summary))


def _tiles(summary: RunSummary) -> Iterator[tuple[str, str]]:
    yield 'frames tracked', f'{100 * summary.tracked / summary.frames:.4g} %'
    yield 'path length', f'{summary.path_length_m:.2f} m'
    yield 'start to end', f'{summary.end_distance_m:.2f} m'
    yield 'frames per second', f'{summary.frames_per_second:.0f}'
    score = summary.trajectory
    if score.ate_rmse_m is not None:
        yield 'ATE', f'{100 * score.ate_rmse_m:.2f} cm'
    if score.rpe_1s_translation_rmse_m is not None:
        yield 'RPE over 1 s', f'{100 * score.rpe_1s_translation_rmse_m:.2f} cm'
        yield 'RPE over 1 s', f'{score.rpe_1s_rotation_rmse_deg:.2f}°'


def _pictures(records: Sequence[FrameRecord],
              ground_truth: Trajectory | None) -> Iterator[str]:
    estimate = trajectory_of(records)
    lost = np.array([not record.status.ok for record in records])
    errors = compare(estimate, ground_truth) if ground_truth is not None else None
    yield page.heading('Path of the camera')
    if errors is None:
        if is_level(records):
            yield page.paragraph('In a level frame, by the accelerometer: x forward at the start, '
                                 'y to the left, z up.', 'quiet')
        else:
            yield page.paragraph('In the frame of the camera at the start: x forward, y to the '
                                 'left, z up.', 'quiet')
            estimate = Trajectory(estimate.stamps, _T_body_optical @ estimate.poses)
        yield _picture(path_figure(estimate, lost=lost))
    else:
        yield page.paragraph('In the frame of the ground truth, to which the positions of the '
                             'estimate are aligned.', 'quiet')
        yield _picture(path_figure(estimate, ground_truth, lost))
    if errors is not None and len(errors.estimate) > 1:
        yield page.heading('Errors')
        yield page.paragraph('Positions and rotations are aligned separately; ATE and RPE above '
                             'are root mean squares.', 'quiet')
        yield _picture(error_figure(errors, records[0].stamp))
    if len(records) > 1:  # over time there is nothing to see of one
        yield page.heading('Tracking')
        yield _picture(tracking_figure(records))
    yield page.heading('Speed')
    yield page.paragraph('Share of the frames in which a stage takes at most the time on the '
                         'horizontal axis.', 'quiet')
    yield _picture(timing_figure(records))


def _picture(figure: Figure) -> str:
    return page.picture(canvas.to_svg(figure))


def _losses(summary: RunSummary, records: Sequence[FrameRecord]) -> Iterator[str]:
    lost = [record for record in records if not record.status.ok]
    if not lost:
        return
    yield page.heading('Lost frames')
    counts = ', '.join(f'{count} x {Status[name].value}' for name, count in summary.status.items()
                       if not Status[name].ok)
    yield page.paragraph(f'{len(lost)} of {summary.frames}: {counts}. Their pose was held.')
    yield page.table(('stamp', 'reason'), ((stamp_to_seconds(record.stamp), record.reason)
                                           for record in lost[:_MAX_LOSSES]))
    if len(lost) > _MAX_LOSSES:
        yield page.paragraph(f'{len(lost) - _MAX_LOSSES} more are in frames.csv.', 'quiet')


def _settings(summary: RunSummary) -> Iterator[str]:
    yield page.heading('Settings that differ from the defaults')
    defaults = values(Settings())
    rows = [(name, str(value), str(defaults[name]))
            for name, value in summary.settings.items() if value != defaults[name]]
    yield page.table(('setting', 'value', 'default'), rows) if rows else (
        page.paragraph('None.', 'quiet'))


def _machine(summary: RunSummary) -> Iterator[str]:
    yield page.heading('Machine')
    yield page.paragraph(', '.join(f'{name} {value}' for name, value in summary.machine.items()),
                         'quiet')
    times = dataclasses.asdict(summary)['timing_ms']
    yield page.table(('stage', 'median [ms]', '99th percentile [ms]'),
                     ((stage, f'{time["p50"]:.1f}', f'{time["p99"]:.1f}')
                      for stage, time in times.items()))
