# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The figures of the paper with curves of success ratios: their methods, axes and data.

To add a figure, add an entry. A method without measurements is omitted from its figures.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from aick_ros.evaluation.baselines.registry import METHODS, Method
from aick_ros.evaluation.benchmark.journal import Journal
from aick_ros.evaluation.benchmark.plan import Plan
from aick_ros.evaluation.benchmark.recording import Recording
from aick_ros.evaluation.benchmark.vocabularies import SIZES, file_name

THRESHOLDS = tuple(round(0.001 * i, 3) for i in range(51))  # by definition: as in the paper
"""Thresholds of the translation error [m], as values of the axis."""

THRESHOLD = 0.01  # by definition: as in the paper
"""Threshold of the translation error [m] in figures with another axis."""


class Axis(Enum):
    """The horizontal axis of a figure; the value is the name in the JSON."""

    THRESHOLD = 'threshold_m'
    GAP = 'gap'


@dataclass(frozen=True)
class Figure:
    """
    A figure of success ratios.

    :param number: number in the paper, or a name.
    :param curves: one method per curve.
    """

    number: str
    title: str
    axis: Axis
    curves: tuple[Method, ...]

    @property
    def variants(self) -> tuple[Method, ...]:
        """Methods with settings varied for this figure, which are not in the registry."""
        return tuple(method for method in self.curves if method.name not in METHODS)


def _named(*names: str) -> tuple[Method, ...]:
    return tuple(METHODS[name] for name in names if name in METHODS)


def _sweep(name: str, parameter: str, labels: Mapping[Any, str]) -> tuple[Method, ...]:
    """Return a method once per value of a parameter, with the label of the value."""
    base = METHODS.get(name)
    if base is None:
        return ()
    return tuple(replace(
        base, name=f'{name}, {parameter}={value}', title=label,
        options={**base.options, 'changes': {**base.options['changes'], parameter: value}})
        for value, label in labels.items())


def _keypoints(name: str, counts: Sequence[int]) -> tuple[Method, ...]:
    return _sweep(name, 'features.max_keypoints',
                  {**{count: f'{count} keypoints' for count in counts}, 0: 'all keypoints'})


def _radii(name: str, radii: Sequence[float]) -> tuple[Method, ...]:
    return _sweep(name, 'aick.word_radius',
                  {**{radius: f'R_w {radius:g}' for radius in radii}, 10.0: 'R_w infinite'})


def _sizes(name: str, detector: str, folder: Path) -> tuple[Method, ...]:
    return _sweep(name, 'aick.vocabulary', {
        str(folder / file_name((detector, size))): f'{size:,} words' for size in SIZES})


def paper_figures(vocabularies: Path | None = None) -> tuple[Figure, ...]:
    """
    Return the figures in the order of the paper, additional ones after the related figure.

    :param vocabularies: folder of :mod:`.vocabularies`; None: no figures of their sizes.
    """
    papers = _named('aick-orb', 'aick-surf', 'ransac3', 'gicp', 'ndt', 'gicp-tuned', 'ndt-tuned')
    todays = _named('aick', 'aick-orb', 'aick-surf', 'pnp', 'small-gicp', 'open3d-hybrid',
                    'open3d-plane', 'opencv-depth', 'opencv-rgbd')
    fast = _named('aick-orb', 'aick-orb-350', 'aick-orb-fast', 'aick-surf', 'aick-surf-200',
                  'aick-surf-fast', 'ransac3', 'gicp-tuned', 'ndt-tuned')
    surf = _keypoints('aick-surf', (50, 100, 200, 400))
    orb = _keypoints('aick-orb', (50, 100, 200, 350, 600))
    iterations = _sweep('aick-orb', 'aick.iterations', {
        1: '1 iteration', **{count: f'{count} iterations' for count in (2, 5, 10, 15, 25)}})
    figures = (
        Figure('3', "Consecutive frames, the paper's methods", Axis.THRESHOLD, papers),
        Figure('3-today', "Consecutive frames, today's methods", Axis.THRESHOLD, todays),
        Figure('4', "Frames farther apart, the paper's methods", Axis.GAP, papers),
        Figure('4-today', "Frames farther apart, today's methods", Axis.GAP, todays),
        Figure('5', 'Number of SURF keypoints, consecutive frames', Axis.THRESHOLD, surf),
        Figure('6', 'Number of SURF keypoints, frames farther apart', Axis.GAP, surf),
        Figure('6-orb', 'Number of ORB keypoints, frames farther apart', Axis.GAP, orb),
        Figure('7', 'Number of iterations, ORB', Axis.GAP, iterations),
        Figure('8', 'Radius R_w of the words, SURF', Axis.GAP,
               _radii('aick-surf-fast', (0.1, 0.18, 0.26, 0.4))),
        Figure('8-orb', 'Radius R_w of the words, ORB', Axis.GAP,
               _radii('aick-orb-fast', (0.165, 0.2, 0.23, 0.26, 0.31))),
        Figure('9', 'What speed costs', Axis.GAP, fast))
    if vocabularies is None:
        return figures
    return (*figures[:-1],
            Figure('8-words-surf', 'Size of the vocabulary, SURF', Axis.GAP,
                   _sizes('aick-surf-fast', 'surf', vocabularies)),
            Figure('8-words-orb', 'Size of the vocabulary, ORB', Axis.GAP,
                   _sizes('aick-orb-fast', 'orb', vocabularies)),
            figures[-1])


def variants(figures: Sequence[Figure]) -> list[Method]:
    """Return the methods that only the figures need, each once."""
    return list({method.identity: method
                 for figure in figures for method in figure.variants}.values())


def figure_data(figures: Sequence[Figure], plan: Plan, journal: Journal) -> dict[str, Any]:
    """
    Return the data of figures, as content of the JSON.

    :returns: number -> title, axis and curves: name of the method -> label and, per recording, x
        and success ratios.
    """
    data = {}
    for figure in figures:
        curves = {}
        for method in figure.curves:
            by_recording = {recording.name: _curve(figure.axis, method, recording, plan, journal)
                            for recording in plan.recordings
                            if (method.identity, recording.name) in journal.pairs}
            if by_recording:
                curves[method.name] = {'label': method.title, 'recordings': by_recording}
        if curves:
            data[figure.number] = {'title': figure.title, 'axis': figure.axis.value,
                                   'curves': curves}
    return data


def _curve(axis: Axis, method: Method, recording: Recording, plan: Plan,
           journal: Journal) -> dict[str, list[float]]:
    lines = journal.pairs[method.identity, recording.name]
    errors: dict[int, list[float]] = {gap: [] for gap in plan.gaps}
    for pair in plan.pairs[recording.name]:
        if pair in lines:
            translation = lines[pair].translation
            errors[pair.gap].append(np.inf if translation is None else translation)
    if axis is Axis.THRESHOLD:
        nearest = np.array(errors[min(plan.gaps)])
        points = [(threshold, np.mean(nearest < threshold)) for threshold in THRESHOLDS
                  if len(nearest)]
    else:
        points = [(gap, np.mean(np.array(errors[gap]) < THRESHOLD))
                  for gap in plan.gaps if errors[gap]]
    return {'x': [x for x, _ in points],
            'success_ratio': [round(float(ratio), 4) for _, ratio in points]}
