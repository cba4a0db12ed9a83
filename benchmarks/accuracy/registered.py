# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What registrations of frames 1, 3 and 5 apart tell about the ground truth they are judged by.

Three things that no odometry can be better than: whether the two agree on the time, whether
images are stamped when they are taken, and how much nearer registrations are to each other than
to the ground truth.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from aick_ros.evaluation.scores.ground_truth import true_pose
from aick_ros.evaluation.scores.statistics import median
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.registrar import Registrar
from aick_ros.sources import RgbdSource, raise_damage

GAPS = (1, 3, 5)
SHIFTS_MS = tuple(range(-40, 41, 5))  # of the ground truth
_WINDOW = 0.1  # [s] over which a turn rate is taken from the ground truth
_TURNING = 0.3  # [rad/s]; a slower turn does not determine the interval
_MISSING = 0.5  # of the period off it: a frame is missing
_FEWEST = 20  # increments that a correlation takes
_STEADY = 1e-4  # [s]; stamps that deviate less do not determine it


class Registered:
    """
    The pairs of a recording beside its ground truth.

    :param stamps: of the frames [ns].
    :param T_target_source: (target, source), by their place in the list of frames -> 4x4.
    """

    def __init__(self, stamps: Sequence[int],
                 T_target_source: Mapping[tuple[int, int], np.ndarray],
                 ground_truth: Trajectory) -> None:
        self._stamps, self._T_target_source = stamps, T_target_source
        self._truth = ground_truth

    @classmethod
    def of(cls, source: RgbdSource) -> Registered:
        """Register the pairs of a source with the defaults."""
        stamps, T_target_source = [], {}
        registrar, views = Registrar(), deque(maxlen=max(GAPS) + 1)
        for index, frame in enumerate(source.frames(raise_damage)):
            views.append(registrar.prepare(frame))
            stamps.append(frame.stamp)
            for gap in (gap for gap in GAPS if gap < len(views)):
                registration = registrar.register(views[-1], views[-1 - gap])
                if registration.status.ok:
                    T_target_source[index - gap, index] = registration.T_target_source
        return cls(stamps, T_target_source, source.ground_truth)

    def shifted(self) -> dict[str, dict[str, float | None]]:
        """
        Return the errors at the largest gap, with the ground truth at other times.

        :returns: shift of its stamps [ms] as text -> medians of the errors.
        """
        return {str(shift): self._errors(max(GAPS), shift) for shift in SHIFTS_MS}

    def best_shift(self) -> int:
        """Return the shift [ms] with the least rotation errors."""
        errors = self.shifted()
        return int(min(errors, key=lambda shift: errors[shift]['rotation_median_deg']))

    def loops(self) -> dict[str, dict[str, float | None]]:
        """
        Return how far three single steps are from one registration over the three.

        :returns: ``closing``: medians of the difference; ``truth``: of the errors of the one over
            three, for comparison.
        """
        differences = []
        for first in range(len(self._stamps) - 3):
            steps = [self._T_target_source.get((first + i, first + i + 1)) for i in range(3)]
            whole = self._T_target_source.get((first, first + 3))
            if whole is not None and all(step is not None for step in steps):
                differences.append(se3.inverse(whole) @ np.linalg.multi_dot(steps))
        return {'closing': _medians(differences), 'truth': self._errors(3, 0),
                'truth_shifted': self._errors(3, self.best_shift())}

    def stamps(self) -> dict[str, float | int | None]:
        """
        Return what the intervals between frames are by their stamps and by what the camera turned.

        Intervals in which a frame is missing do not count.

        :returns: median and standard deviation of the stamps' intervals; their correlation with
            the turns measured, each divided by the true turn rate, where the camera turns.
        """
        intervals = np.diff(self._stamps) / NANOSECONDS
        period = float(np.median(intervals))
        by_stamp, by_turn = [], []
        truth = self._shifted_truth(self.best_shift())
        for (target, source), T_target_source in self._T_target_source.items():
            start, end = self._stamps[target], self._stamps[source]
            rate = _turn_rate(truth, (start + end) // 2)
            interval = (end - start) / NANOSECONDS
            if (source - target == 1 and rate is not None and rate > _TURNING
                    and abs(interval - period) < _MISSING * period):
                by_stamp.append(interval)
                by_turn.append(se3.angle(T_target_source[:3, :3]) / rate)
        complete = intervals[np.abs(intervals - period) < _MISSING * period]
        correlation = None
        if len(by_stamp) >= _FEWEST and np.std(by_stamp) > _STEADY:
            correlation = float(np.corrcoef(by_stamp, by_turn)[0, 1])
        return {'interval_ms': 1e3 * period, 'interval_sigma_ms': 1e3 * float(np.std(complete)),
                'turning': len(by_stamp), 'correlation': correlation}

    def _errors(self, gap: int, shift_ms: int) -> dict[str, float | None]:
        truth, errors = self._shifted_truth(shift_ms), []
        for (target, source), T_target_source in self._T_target_source.items():
            if source - target == gap:
                poses = [truth(self._stamps[index]) for index in (target, source)]
                if all(pose is not None for pose in poses):
                    errors.append(se3.inverse(se3.inverse(poses[0]) @ poses[1])
                                  @ T_target_source)
        return _medians(errors)

    def _shifted_truth(self, shift_ms: int) -> Callable[[int], np.ndarray | None]:
        shifted = Trajectory(self._truth.stamps + shift_ms * 1_000_000, self._truth.poses)
        return lambda stamp: true_pose(shifted, stamp)


def _medians(errors: list[np.ndarray]) -> dict[str, float | None]:
    return {'count': len(errors),
            'translation_median_m': median(np.linalg.norm(e[:3, 3]) for e in errors),
            'rotation_median_deg': median(np.degrees(se3.angle(e[:3, :3])) for e in errors)}


def _turn_rate(truth: Callable[[int], np.ndarray | None], stamp: int) -> float | None:
    """Return how fast the camera turns [rad/s]; None where the ground truth does not say."""
    half = round(_WINDOW / 2 * NANOSECONDS)
    before, after = truth(stamp - half), truth(stamp + half)
    if before is None or after is None:
        return None
    return se3.angle((se3.inverse(before) @ after)[:3, :3]) / _WINDOW
