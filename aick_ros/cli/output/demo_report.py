# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Results of ``aick demo``: statistics of a live run, their table, and a plot of the path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from aick_ros.cli.output.console import decimal
from aick_ros.errors import installation
from aick_ros.evaluation.scores.statistics import Percentiles, root_mean_square
from aick_ros.evaluation.scores.trajectory_errors import TrajectoryErrors
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.settings import Settings
from aick_ros.sources import RgbdSource

if TYPE_CHECKING:
    from aick_ros.ros.playback.answers import LiveRun

_IMAGES = 4  # of the recording, above the plot of the path


def live_statistics(name: str, run: LiveRun, errors: TrajectoryErrors | None) -> dict[str, Any]:
    """
    Return the content of the JSON.

    :param name: name of the recording.
    :param errors: of the published trajectory; None without ground truth.
    """
    no_errors: Sequence[float] = ()
    translations, rotations = errors.relative(1.0) if errors else (no_errors, no_errors)
    return {
        'source': name,
        'frames_played': len(run.published_at),
        'frames_answered': len(run.answers),
        'frames_not_tracked': sum(not answer.tracked for answer in run.answers),
        'rate_hz': run.rate,
        'delay_ms': asdict(Percentiles.of(1e3 * run.delays)),
        'trajectory': {
            'rpe_1s_translation_rmse_m': root_mean_square(translations),
            'rpe_1s_rotation_rmse_deg': root_mean_square(np.degrees(rotations)),
            'ate_rmse_m': root_mean_square(errors.positions()) if errors else None}}


def table_rows(statistics: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the rows of the table on the terminal, from :func:`live_statistics`."""
    delay, trajectory = statistics['delay_ms'], statistics['trajectory']
    return [
        ('frames played / answered',
         f'{statistics["frames_played"]} / {statistics["frames_answered"]}'),
        ('not tracked', str(statistics['frames_not_tracked'])),
        ('rate', decimal(statistics['rate_hz'], ' Hz', 2)),
        ('delay from image to odometry, p50 / p99',
         f'{decimal(delay["p50"], digits=1)} / {decimal(delay["p99"], " ms", 1)}'),
        ('RPE over 1 s, translation', decimal(trajectory['rpe_1s_translation_rmse_m'], ' m', 4)),
        ('RPE over 1 s, rotation', decimal(trajectory['rpe_1s_rotation_rmse_deg'], ' deg', 2)),
        ('ATE', decimal(trajectory['ate_rmse_m'], ' m', 4))]


def plot_path(path_png: Path, name: str, estimate: Trajectory, truth: Trajectory | None,
              recording: RgbdSource) -> str:
    """
    Plot the published trajectory below some images of the recording.

    :param truth: true trajectory of the base; None without ground truth.
    :returns: the path of the file, or why there is none.
    """
    try:
        from aick_ros.reports.path_plot import View, plot_trajectory
    except ModuleNotFoundError as error:
        return f"not plotted, {error.name} is not installed: {installation('eval')}"
    extractor = KeypointExtractor(Settings().features, Settings().sensor)
    shown = set(np.linspace(0, len(recording) - 1, _IMAGES, dtype=int))
    views = [View(frame.colour, extractor.extract(frame).pixels)
             for i, frame in enumerate(recording.frames(lambda damage: None)) if i in shown]
    alignment = ', aligned to the ground truth' if truth else ''
    plot_trajectory(path_png, estimate, truth,
                    f'odom_node on {name}: images, and the published path{alignment}', views)
    return str(path_png)
