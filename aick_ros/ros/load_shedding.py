# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Steps by which less is computed while frames come faster than they can be registered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

_TOLERATED = 0.05  # chosen: share of the frames that may be dropped
_BUSY = 0.8  # chosen: share of the time; below it a thread that waits is why frames are dropped
_PATIENCE = 2  # seconds of overload before the next step; chosen
_EASE = 0.4  # share of the time; chosen: no step back doubles the work, which then still fits
_RECOVERY = 5  # seconds of ease before a step back; chosen
_FEWEST_KEYPOINTS, _FEWEST_POINTS = 100, 250  # chosen: of which a frame is still registered well


class Step(Enum):
    """Reduction of what is computed; each step includes those before it."""

    ALL = 'nothing'
    FEWER_KEYPOINTS = 'half of the keypoints'
    FEWER_POINTS = 'half of the keypoints and of the surface points'
    FEWER_FRAMES = 'half of the keypoints, of the surface points and of the frames'


_STEPS = list(Step)


@dataclass(frozen=True)
class Load:
    """
    The work since the start, at one moment.

    :param at: steady time [s].
    :param arrived: number of frames; ``dropped`` of these for newer ones.
    :param busy: time that each thread has worked, without waits for transforms [s].
    :param waited: time that all of them have waited for transforms [s].
    """

    at: float
    arrived: int
    dropped: int
    busy: Sequence[float]
    waited: float = 0.0


class LoadShedding:
    """
    Chooses the step, once a second.

    Frames come faster than they can be done where they are dropped for newer ones while a thread
    works all the time. After two seconds of this comes the next step; once no thread has worked
    for more than two fifths of the time for five seconds, the step before. Frames that are dropped
    while transforms are waited for are no sign of either.
    """

    def __init__(self) -> None:
        self.step = Step.ALL
        self._last: Load | None = None
        self._seconds_over = self._seconds_at_ease = 0

    @property
    def sentence(self) -> str:
        """The work that is dropped and a remedy; '' while everything is computed."""
        if self.step is Step.ALL:
            return ''
        return (f'frames come faster than they can be registered: {self.step.value} are dropped; '
                'limit the rate with max_update_rate, set preset to embedded, or shed_load to '
                'false')

    def update(self, load: Load) -> bool:
        """Take the load as it is now; return whether the step has changed."""
        last, self._last = self._last, load
        if last is None or load.at <= last.at:
            return False
        interval = load.at - last.at
        busy = max(now - then for now, then in zip(load.busy, last.busy)) / interval
        waited = (load.waited - last.waited) / interval
        dropped = load.dropped - last.dropped
        is_over = busy > _BUSY and dropped > _TOLERATED * (load.arrived - last.arrived)
        is_at_ease = busy < _EASE and (not dropped or busy + waited > _BUSY)
        self._seconds_over = self._seconds_over + 1 if is_over else 0
        self._seconds_at_ease = self._seconds_at_ease + 1 if is_at_ease else 0
        if self._seconds_over >= _PATIENCE:
            return self._go(1)
        if self._seconds_at_ease >= _RECOVERY:
            return self._go(-1)
        return False

    def _go(self, steps: int) -> bool:
        self._seconds_over = self._seconds_at_ease = 0
        before = self.step
        index = _STEPS.index(before) + steps
        self.step = _STEPS[min(max(index, 0), len(_STEPS) - 1)]
        return self.step is not before

    def admits(self, number: int) -> bool:
        """Return whether a frame is registered, by its number in the order of arrival."""
        return self.step is not Step.FEWER_FRAMES or number % 2 == 0

    def settings(self, core: Settings) -> Settings:
        """Return the settings of the algorithm at this step."""
        features, refinement = core.features, core.refinement
        changes = {}
        if self.step is not Step.ALL:
            changes = {name: _halved(number, _FEWEST_KEYPOINTS) for name, number in (
                ('features.max_keypoints', features.max_keypoints),
                ('features.orb.nfeatures', features.orb.nfeatures),
                ('features.sift.nfeatures', features.sift.nfeatures),
                ('refinement.max_tracks', refinement.max_tracks))}
        if self.step in (Step.FEWER_POINTS, Step.FEWER_FRAMES):
            changes['refinement.surface_points'] = _halved(
                refinement.surface_points, _FEWEST_POINTS)
        return with_values(core, changes)


def _halved(number: int, fewest: int) -> int:
    """Return half of a number, but not less than the fewest; 0 stands for all and stays."""
    return max(number // 2, min(number, fewest))
