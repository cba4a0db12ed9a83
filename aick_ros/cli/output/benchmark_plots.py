# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Plots of ``aick benchmark --plots``: the figures of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from aick_ros.cli.output.plot_folder import make_plot_folder
from aick_ros.evaluation.benchmark.dead_reckoning import Reckoning


class FigureFolder:
    """
    The folder of the figures, made before the run.

    :raises InputError: where it cannot be made or matplotlib is not installed.
    """

    def __init__(self, path: Path) -> None:
        make_plot_folder(path)
        self._path = path

    @property
    def vocabularies(self) -> Path:
        """Folder of the vocabularies that a figure compares; it may not exist yet."""
        return self._path / 'vocabularies'

    def write(self, figures: Mapping[str, Any], recordings: Mapping[str, Any],
              reckoning: Reckoning | None) -> None:
        """Draw the figures, and Figure 10 where there was a walk."""
        from aick_ros.reports.benchmark_plots import write_figures
        from aick_ros.reports.reckoning_plot import write_reckoning
        write_figures(figures, recordings, self._path)
        if reckoning is not None:
            write_reckoning(reckoning, self._path / 'figure-10.png')
