# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Success ratios of registrations, pair by pair (Ekekrantz et al. 2013, IV-A).

The error of a pair is that of one registration alone: it is independent of drift and of the order
of errors along a trajectory.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.consistency import Consistency
from aick_ros.evaluation.scores.frame_pairs import FramePair, countable_pairs
from aick_ros.evaluation.scores.ground_truth import true_motion
from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.evaluation.scores.statistics import Percentiles, mean, median
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings

THRESHOLDS = (0.0033, 0.01, 0.05)  # by definition: Table I of the paper
"""Translation errors below which a registration is a success [m]."""


@dataclass(frozen=True)
class PairError:
    """
    Error of one registration.

    :param translation: [m]; infinite where the registration failed.
    :param rotation: [rad]; infinite where the registration failed.
    :param milliseconds: duration of the registration.
    :param nees: normalised estimation error squared; None without a finite covariance.
    """

    translation: float
    rotation: float
    milliseconds: float
    nees: float | None = None

    @property
    def failed(self) -> bool:
        """Failure of the registration."""
        return not np.isfinite(self.translation)


@dataclass(frozen=True)
class PairScore:
    """
    Statistics of all pairs of one gap; None where there is no value.

    :param success_ratio: threshold [m] as text -> share of all pairs with a smaller error.
    :param translation_median_m: of all pairs; a failed one counts as an infinite error.
    :param consistency: of the covariances of the successful registrations.
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
        """Return the statistics of the errors of some pairs."""
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

    Only the frames that later pairs can need are kept: one more than the largest gap.

    :param gaps: distances of two frames in the list of frames, each at least 1.
    """

    def __init__(self, settings: Settings, ground_truth: Trajectory,
                 gaps: Sequence[int]) -> None:
        # a registrar learns from the motions that it sees, and each gap has its own
        self._registrars = {gap: Registrar(settings) for gap in gaps}
        self._ground_truth = ground_truth
        self._frames: deque[PreparedFrame] = deque(maxlen=max(gaps) + 1)
        self._stamps: list[int] = []
        self._errors: dict[FramePair, PairError] = {}

    def add(self, frame: PreparedFrame) -> None:
        """Register the next frame to those at each gap before it."""
        self._stamps.append(frame.stamp)
        self._frames.append(frame)
        source = len(self._stamps) - 1
        for gap, registrar in self._registrars.items():
            if gap >= len(self._frames):
                continue
            target = self._frames[-1 - gap]
            true_T_target_source = true_motion(self._ground_truth, target.stamp, frame.stamp)
            if true_T_target_source is not None:
                self._errors[FramePair(source - gap, source)] = _measure(
                    registrar, frame, target, true_T_target_source)

    def errors(self) -> dict[int, list[PairError]]:
        """Return the errors of each gap's pairs that count (:func:`.countable_pairs`)."""
        return {gap: [self._errors[pair]
                      for pair in countable_pairs(self._stamps, self._ground_truth, gap)]
                for gap in self._registrars}

    def scores(self) -> dict[int, PairScore]:
        """Return the statistics of each gap, of the pairs of :meth:`errors`."""
        return {gap: PairScore.of(errors) for gap, errors in self.errors().items()}


def _measure(registrar: Registrar, source: PreparedFrame, target: PreparedFrame,
             true_T_target_source: np.ndarray) -> PairError:
    start = time.perf_counter()
    registration = registrar.register(source, target)
    milliseconds = 1e3 * (time.perf_counter() - start)
    if not registration.status.ok:
        return PairError(np.inf, np.inf, milliseconds)
    error = IncrementError.of(registration.T_target_source, registration.covariance,
                              true_T_target_source)
    return PairError(error.translation, error.rotation, milliseconds, error.nees)
