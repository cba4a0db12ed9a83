# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Success ratios of registrations, pair by pair (Ekekrantz et al. 2013, IV-A).

A pair is two frames a gap apart in the list of frames. Its error is that of the transform alone,
so drift and luck of a whole trajectory do not enter.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.consistency import Consistency
from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.evaluation.scores.statistics import Percentiles, mean, median
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings

THRESHOLDS = (0.0033, 0.01, 0.05)
"""Translation errors below which a registration is a success in the paper's Table I [m]."""

MAX_HOLE = 0.05
"""Longest hole [s] of the ground truth that is interpolated over."""

MAX_INTERVAL_ERROR = 0.02
"""Largest difference [s] of a pair's interval from gap times the median period."""


@dataclass(frozen=True)
class PairError:
    """
    How far one registration is off.

    :param interval: time between the two frames [ns].
    :param translation: [m]; infinite where the registration failed.
    :param rotation: [rad]; infinite where the registration failed.
    :param milliseconds: that the registration took.
    :param nees: of the error; None where there is no finite covariance.
    """

    interval: int
    translation: float
    rotation: float
    milliseconds: float
    nees: float | None = None

    @property
    def failed(self) -> bool:
        """Whether there was no registration."""
        return not np.isfinite(self.translation)


@dataclass(frozen=True)
class PairScore:
    """
    The figures of all pairs of one gap; None where there is none.

    :param success_ratio: threshold [m] as text -> share of all pairs with a smaller error.
    :param translation_median_m: of all pairs, the failed ones counted as infinitely far off.
    :param consistency: of the covariances of those that did not fail.
    """

    count: int
    failed: int
    success_ratio: dict[str, float | None]
    translation_median_m: float | None
    rotation_median_deg: float | None
    registration_ms: Percentiles
    consistency: Consistency

    @classmethod
    def of(cls, errors: Sequence[PairError]) -> PairScore:
        """Return the figures of some pairs."""
        translations = [error.translation for error in errors]
        return cls(
            count=len(errors), failed=sum(error.failed for error in errors),
            success_ratio={f'{threshold:g}': mean(t < threshold for t in translations)
                           for threshold in THRESHOLDS},
            translation_median_m=median(translations),
            rotation_median_deg=median(np.degrees(error.rotation) for error in errors),
            registration_ms=Percentiles.of(error.milliseconds for error in errors),
            consistency=Consistency.of(error.nees for error in errors))


class PairEvaluation:
    """
    Registers each frame to earlier ones and compares with the ground truth.

    Only as many frames are kept as the longest gap asks for.

    :param gaps: distances of two frames in the list of frames, each 1 or more.
    """

    def __init__(self, settings: Settings, ground_truth: Trajectory,
                 gaps: Sequence[int]) -> None:
        self._registrars = {gap: Registrar(settings) for gap in gaps}
        self._ground_truth = ground_truth
        self._frames: deque[tuple[PreparedFrame, np.ndarray | None]] = deque(maxlen=max(gaps) + 1)
        self._periods: list[int] = []
        self._errors: dict[int, list[PairError]] = {gap: [] for gap in gaps}

    def add(self, view: PreparedFrame) -> None:
        """Take the next frame."""
        if self._frames:
            self._periods.append(view.stamp - self._frames[-1][0].stamp)
        T_world_source = self._ground_truth.at(view.stamp, MAX_HOLE)
        self._frames.append((view, T_world_source))
        if T_world_source is None:
            return
        for gap, errors in self._errors.items():
            if gap >= len(self._frames):
                continue
            target, T_world_target = self._frames[-1 - gap]
            if T_world_target is not None:
                errors.append(_measure(self._registrars[gap], view, target,
                                       se3.inverse(T_world_target) @ T_world_source))

    def errors(self) -> dict[int, list[PairError]]:
        """
        Return the errors of the pairs of each gap.

        Pairs whose interval is not gap times the median period, because frames are missing
        between them, are left out.
        """
        period = float(np.median(self._periods)) if self._periods else 0.0
        return {gap: [error for error in errors if abs(error.interval - gap * period)
                      <= MAX_INTERVAL_ERROR * NANOSECONDS]
                for gap, errors in self._errors.items()}

    def scores(self) -> dict[int, PairScore]:
        """Return the figures of each gap, by the pairs of :meth:`errors`."""
        return {gap: PairScore.of(errors) for gap, errors in self.errors().items()}


def _measure(registrar: Registrar, source: PreparedFrame, target: PreparedFrame,
             true_T_target_source: np.ndarray) -> PairError:
    start = time.perf_counter()
    registration = registrar.register(source, target)
    milliseconds = 1e3 * (time.perf_counter() - start)
    interval = source.stamp - target.stamp
    if not registration.status.ok:
        return PairError(interval, np.inf, np.inf, milliseconds)
    error = IncrementError.of(registration.T_target_source, registration.covariance,
                              true_T_target_source)
    return PairError(interval, error.translation, error.rotation, milliseconds, error.nees)
