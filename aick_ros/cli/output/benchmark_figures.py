# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The folder of ``aick benchmark --plots``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from aick_ros.errors import InputError
from aick_ros.evaluation.benchmark.dead_reckoning import Reckoning


class FigureFolder:
    """
    Takes the figures of a benchmark; whether it can is found out before a long run.

    :raises InputError: where matplotlib is missing or the folder cannot be made.
    """

    def __init__(self, path: Path) -> None:
        try:
            from aick_ros.reports.benchmark_plots import write_figures
            from aick_ros.reports.reckoning_plot import write_reckoning
        except ModuleNotFoundError as error:
            package = (error.name or '').partition('.')[0]
            raise InputError(f"--plots needs {package}: pip install 'aick_ros[eval]'") from None
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f'cannot make the folder {path}: {error.strerror}') from None
        self._path = path
        self._write_figures, self._write_reckoning = write_figures, write_reckoning

    @property
    def vocabularies(self) -> Path:
        """The folder of the vocabularies that a figure compares; made when they are learned."""
        return self._path / 'vocabularies'

    def write(self, figures: Mapping[str, Any], recordings: Mapping[str, Any],
              reckoning: Reckoning | None) -> None:
        """Draw the figures, and figure 10 where there was a walk."""
        self._write_figures(figures, recordings, self._path)
        if reckoning is not None:
            self._write_reckoning(reckoning, self._path / 'figure-10.png')
