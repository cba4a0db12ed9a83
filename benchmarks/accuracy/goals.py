# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Goals of this package, figure by figure, for the whole real sequences."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

XYZ, RPY = 'freiburg1_xyz_150', 'freiburg1_rpy_100'

Results = Mapping[str, Any]
"""The JSON of measure.py for one recording."""


@dataclass(frozen=True)
class Goal:
    """
    Bounds of a figure, both of which count as reached.

    :param least: what had to be reached; ``aim``: what was hoped for.
    """

    least: Sequence[float]
    aim: Sequence[float]


@dataclass(frozen=True)
class Measure:
    """
    A row of the table.

    :param figures: from the results of a recording, one or several.
    :param form: of each, as ``format`` takes it.
    :param goals: recording -> goal; '' for all that are not named.
    :param larger_is_better: whether the bounds are lower ones.
    """

    title: str
    figures: Callable[[Results], Sequence[float]]
    form: str
    goals: Mapping[str, Goal] = field(default_factory=dict)
    larger_is_better: bool = False

    def goal(self, recording: str) -> Goal | None:
        """Return the goal on a recording, None where there is none."""
        return self.goals.get(recording, self.goals.get(''))

    def reached(self, figure: float, bound: float) -> bool:
        """Return whether a figure meets a bound, both as rounded in the table."""
        figure = float(format(figure, self.form))
        return figure >= bound if self.larger_is_better else figure <= bound


def default_of(results: Results) -> Mapping[str, Any]:
    """Return the figures with the defaults."""
    return results['variants']['joint']


def successes(variant: Mapping[str, Any], threshold: str = '0.01') -> list[float]:
    """Return the success ratio of each gap."""
    return [pair['success_ratio'][threshold] for pair in variant['pairs'].values()]


def _path(key: str) -> Callable[[Results], Sequence[float]]:
    return lambda results: [default_of(results)['trajectory'][key]]


def _silent(results: Results) -> list[float]:
    """Return how many increments were reported as good and off, of 500."""
    counts = default_of(results)['silent_failures']
    return [500 * counts['reported_good_but_off'] / counts['reported_good']]


MEASURES = (
    Measure('success within 10 mm, gap 1 / 5 / 10', lambda r: successes(default_of(r)), '.2f',
            {XYZ: Goal((.98, .88, .58), (1.0, .95, .75)),
             RPY: Goal((.97, .66, .38), (.99, .78, .55))}, larger_is_better=True),
    Measure('success within 3.3 mm, gap 1', lambda r: successes(default_of(r), '0.0033')[:1],
            '.2f', {XYZ: Goal((.80,), (.90,)), RPY: Goal((.62,), (.75,))},
            larger_is_better=True),
    Measure('drift over 1 s (RPE), translation [m]', _path('rpe_1s_translation_rmse_m'), '.3f',
            {XYZ: Goal((.024,), (.018,)), RPY: Goal((.036,), (.028,))}),
    Measure('drift over 1 s (RPE), rotation [deg]', _path('rpe_1s_rotation_rmse_deg'), '.2f',
            {XYZ: Goal((1.5,), (1.1,)), RPY: Goal((2.4,), (1.8,))}),
    Measure('position error (ATE) [m]', _path('ate_rmse_m'), '.3f',
            {XYZ: Goal((.030,), (.018,)), RPY: Goal((.045,), (.028,))}),
    Measure('increments inside the 95 % ellipsoid',
            lambda r: [default_of(r)['consistency']['inside_95']], '.2f',
            {XYZ: Goal((.88,), (.95,)), RPY: Goal((.88,), (.95,))}, larger_is_better=True),
    Measure('off by more than 5 cm or 3 deg but reported as good, of 500 increments', _silent,
            '.1f', {'': Goal((1.0,), (0.0,))}),
    Measure("time of a frame, as a share of cv2.Odometry's on depth",
            lambda r: [r['frame_time']['share']], '.2f', {'': Goal((.5,), (.25,))}),
)
"""The rows, in order."""
