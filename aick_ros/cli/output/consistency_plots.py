# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Plots of ``aick evaluate --plots``: histograms of the NEES."""

from __future__ import annotations

from pathlib import Path

from aick_ros.borders.replacement import unwritable
from aick_ros.cli.output.console import say
from aick_ros.evaluation.scores.evaluation import Evaluation

_ODOMETRY = 'odometry'  # by definition: beside the gaps, in the NEES of an evaluation


def write_plots(folder: Path, evaluation: Evaluation) -> None:
    """
    Draw nees_odometry.png, and a nees_gap_N.png for each gap with pairs, into a folder.

    :raises InputError: where they cannot be written.
    """
    from aick_ros.reports import canvas
    from aick_ros.reports.consistency_plot import nees_figure
    if not any(evaluation.nees.values()):
        say(f'no plots: {evaluation.source} has no covariance with an error to compare it with')
        return
    try:
        for name, values in evaluation.nees.items():
            title, stem = _title_and_stem(name)
            noun = 'increments' if name == _ODOMETRY else 'pairs'
            if values:
                canvas.write_png(nees_figure(values, f'{evaluation.source}: {title}', noun),
                                 folder / f'nees_{stem}.png')
    except OSError as error:
        raise unwritable(error.filename or folder, error) from None


def _title_and_stem(name: str) -> tuple[str, str]:
    """Return the title of a plot and the stem of its file."""
    if name == _ODOMETRY:
        return name, name
    frames = 'consecutive frames' if name == '1' else f'frames {name} apart'
    return f'pairs of {frames}', f'gap_{name}'
