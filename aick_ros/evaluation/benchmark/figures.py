# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The figures of the paper that are curves: which methods they show, over what, and their data.

A further figure is one entry. A method of which nothing was measured is left out of its figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from aick_ros.evaluation.baselines.registry import METHODS, Method
from aick_ros.evaluation.benchmark.journal import Journal
from aick_ros.evaluation.benchmark.recording import Recording
from aick_ros.evaluation.benchmark.runner import Plan

THRESHOLDS = tuple(round(0.001 * i, 3) for i in range(51))
"""Of the translation error [m], where it is the axis."""

THRESHOLD = 0.01
"""Of the translation error [m], where the axis is another."""


class Axis(Enum):
    """What a figure shows the success ratio over; the value is the name in the JSON."""

    THRESHOLD = 'threshold_m'
    GAP = 'gap'


@dataclass(frozen=True)
class Figure:
    """
    A figure of success ratios.

    :param number: of the paper, or a name of ours.
    :param curves: a method each.
    """

    number: str
    title: str
    axis: Axis
    curves: tuple[Method, ...]

    @property
    def variants(self) -> tuple[Method, ...]:
        """The methods that are in no list of methods: settings varied for this figure."""
        return tuple(method for method in self.curves if method.name not in METHODS)


def _named(*names: str) -> tuple[Method, ...]:
    return tuple(METHODS[name] for name in names if name in METHODS)


def _sweep(name: str, parameter: str, values: Sequence[Any], label: str) -> tuple[Method, ...]:
    """Return a method once for each value of a parameter; in the label {} stands for it."""
    base = METHODS[name]
    return tuple(replace(
        base, name=f'{name}, {parameter}={value}', title=label.format(value or 'all'),
        options={**base.options, 'changes': {**base.options['changes'], parameter: value}})
        for value in values)


_PAPERS = _named('aick-orb', 'aick-surf', 'ransac3', 'gicp', 'ndt', 'gicp-tuned', 'ndt-tuned')
_TODAYS = _named('aick', 'aick-orb', 'pnp', 'small-gicp', 'open3d-hybrid', 'open3d-plane',
                 'opencv-depth', 'opencv-rgbd')
_FAST = _named('aick-orb', 'aick-orb-350', 'aick-orb-fast', 'aick-surf', 'aick-surf-200',
               'aick-surf-fast', 'ransac3', 'gicp-tuned', 'ndt-tuned')
_KEYPOINTS = _sweep('aick-orb', 'features.max_keypoints', (50, 100, 200, 350, 600, 0),
                    '{} keypoints')
_ITERATIONS = _sweep('aick-orb', 'aick.iterations', (1, 2, 5, 10, 15, 25), '{} iterations')

FIGURES = (
    Figure('3', "Consecutive frames, the paper's methods", Axis.THRESHOLD, _PAPERS),
    Figure('3-today', "Consecutive frames, today's methods", Axis.THRESHOLD, _TODAYS),
    Figure('4', "Frames farther apart, the paper's methods", Axis.GAP, _PAPERS),
    Figure('4-today', "Frames farther apart, today's methods", Axis.GAP, _TODAYS),
    Figure('5', 'Number of keypoints, consecutive frames', Axis.THRESHOLD, _KEYPOINTS),
    Figure('6', 'Number of keypoints, frames farther apart', Axis.GAP, _KEYPOINTS),
    Figure('7', 'Number of iterations', Axis.GAP, _ITERATIONS),
    Figure('9', 'What speed costs', Axis.GAP, _FAST),
)
"""In the order of the paper."""


def variants() -> list[Method]:
    """Return the methods that only figures need, each once."""
    return list({method.identity: method
                 for figure in FIGURES for method in figure.variants}.values())


def figure_data(plan: Plan, journal: Journal) -> dict[str, Any]:
    """
    Return the data of all figures as JSON takes it.

    :returns: number -> title, axis and, by the name of the method, its curve: a label, and for
        each recording x and success ratios.
    """
    data = {}
    for figure in FIGURES:
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
           journal: Journal) -> dict[str, list]:
    lines = journal.pairs[method.identity, recording.name]
    errors: dict[int, list[float]] = {gap: [] for gap in plan.gaps}
    for pair in plan.pairs[recording.name]:
        if pair in lines:
            translation = lines[pair].translation
            errors[pair.gap].append(np.inf if translation is None else translation)
    if axis is Axis.THRESHOLD:
        nearest = np.array(errors[min(plan.gaps)])
        x, ratios = list(THRESHOLDS), [np.mean(nearest < threshold) for threshold in THRESHOLDS]
    else:
        x = [gap for gap in plan.gaps if errors[gap]]
        ratios = [np.mean(np.array(errors[gap]) < THRESHOLD) for gap in x]
    return {'x': x, 'success_ratio': [round(float(ratio), 4) for ratio in ratios]}
