# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The pictures of ``aick evaluate --plots``."""

from __future__ import annotations

from pathlib import Path

from aick_ros.cli.output.console import say
from aick_ros.errors import InputError
from aick_ros.evaluation.scores.evaluation import Evaluation


def check_plots(folder: Path) -> None:
    """
    Find out before a long run whether it can be drawn.

    :raises InputError: where the folder cannot be made or matplotlib is not there.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f'--plots {folder}: it takes a folder, and this is a file')
    if not folder.absolute().parent.is_dir():
        raise InputError(f'--plots {folder}: there is no folder {folder.parent}')
    try:
        import matplotlib  # noqa: F401
    except ModuleNotFoundError:
        raise InputError("--plots needs matplotlib: pip install 'aick_ros[eval]'") from None


def write_plots(folder: Path, evaluation: Evaluation) -> None:
    """
    Draw nees_odometry.png and a nees_gap_N.png for each gap that has pairs.

    :raises InputError: where they cannot be written.
    """
    from aick_ros.reports import canvas
    from aick_ros.reports.consistency_plot import nees_figure
    if not any(evaluation.nees.values()):
        say(f'no plots: no covariance of {evaluation.source} can be judged')
        return
    try:
        folder.mkdir(exist_ok=True)
        for name, values in evaluation.nees.items():
            what, stem = _names(name)
            if values:
                canvas.write_png(nees_figure(values, f'{evaluation.source}: {what}'),
                                 folder / f'nees_{stem}.png')
    except OSError as error:
        raise InputError(f'cannot write {error.filename or folder}: {error.strerror}') from None


def _names(name: str) -> tuple[str, str]:
    """Return what the NEES of a name are of, and how their file is called."""
    if name == 'odometry':
        return name, name
    frames = 'consecutive frames' if name == '1' else f'frames {name} apart'
    return f'pairs of {frames}', f'gap_{name}'
