# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Misalignment of a camera's images, estimated over its registrations.

The normal equations of all pairs of frames are added up, their poses eliminated. What is not
significant against how far parts of the registrations contradict each other changes nothing. What
is estimated is the deviation from a misalignment that is known: by the settings, zero unless the
camera was measured before.

The scale of depth is none of the unknowns: it would scale the whole trajectory, and nothing
contradicts it.
"""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import definite
from aick_ros.registration.refinement.grouped_equations import MEMORY, GroupedEquations
from aick_ros.registration.refinement.misalignment import NO_MISALIGNMENT, Misalignment
from aick_ros.registration.refinement.misalignment_equations import MisalignmentSample

_SIZE = 8  # offset in m and rad, delay and readout in s
_ALL = np.arange(_SIZE, dtype=np.int64)
_PARTS: tuple[slice, ...] = slice(0, 6), slice(6, 8)
"""Offset; delay and readout. Either is significant or not: on a rolling shutter a delay alone is
worse than none."""

# All chosen on two excerpts of real recordings and on rendered rooms with nine kinds of cameras.
_KEPT = 0.8  # weight of a group's earlier registrations, each time that it is added to
_FEWEST = 30  # registrations before anything is estimated
_PRIOR_SIGMAS = np.array([0.02, 0.02, 0.02, 0.035, 0.035, 0.035, 0.02, 0.02])
_PRIOR_WEIGHT = 100.0  # information by residuals with common errors, as a ratio to what it is
PRIOR = np.diag(_PRIOR_WEIGHT / _PRIOR_SIGMAS ** 2)
"""Information about the eight numbers before any registration, 8x8."""

_SIGNIFICANT = {6: 15.0, 2: 22.0}
"""Square of an estimate by its variance, both weighted by the information, from which on it is
applied, by the number of unknowns. Derived: chance exceeds F(6, 7) and F(2, 7) so far in one of a
thousand. Cameras without misalignment show 1 to 8, others 40 to 1000."""

_STILL_SIGNIFICANT = 0.5  # of that: below it an estimate is no longer applied

_SMALLEST = np.array([0.003, 0.003, 0.003, 0.0026, 0.0026, 0.0026, 0.002, 0.004])
"""Estimates that are smaller are not applied: 3 mm and 0.15 deg, 2 ms, 4 ms."""

_DELAY = 6  # by definition: its place among the unknowns
_DELAY_DESIGN_EFFECT = 25.0  # of the information about the delay, for its standard deviation
_LARGEST_DELAY_SIGMA = 0.01
"""Standard deviation of a delay that nothing is known of [s]. Derived: at 30 Hz two images that
belong together are at most half an interval apart."""

_OUTLYING = 3.0  # gain of a registration, as a ratio to the mean, from which on its weight falls


class MisalignmentEstimate:
    """
    Misalignment of one camera, learned over its registrations.

    :param known: holds until a deviation from it is significant.
    """

    def __init__(self, known: Misalignment = NO_MISALIGNMENT) -> None:
        self._known = self._misalignment = known
        self._equations = GroupedEquations(PRIOR, _KEPT)
        self._mean_gain = 0.0
        self._applied: tuple[slice, ...] = ()
        self._delay_sigma = _LARGEST_DELAY_SIGMA

    @property
    def misalignment(self) -> Misalignment:
        """Misalignment to be corrected: the known one, and each deviation that is significant."""
        return self._misalignment

    @property
    def delay_sigma(self) -> float:
        """Standard deviation of the delay that is corrected [s]: also what is not significant."""
        return self._delay_sigma

    def assume(self, known: Misalignment) -> None:
        """Continue with another known misalignment; what was learned of the camera is kept."""
        if (known.values != self._known.values).any():
            self._known, self._applied = known, ()
            self._estimate()

    def learn(self, sample: MisalignmentSample) -> None:
        """Add one registration."""
        weight = self._weight(sample)
        self._equations.add(weight * sample.information, weight * sample.gradient)
        if self._equations.is_between_runs:
            self._estimate()

    def _weight(self, sample: MisalignmentSample) -> float:
        """Return the weight of a registration: less than one where its estimate stands out."""
        error = sample.gradient - sample.information @ self._misalignment.values
        gain = float(error @ definite.solve(sample.information + PRIOR, error))
        limit = _OUTLYING * self._mean_gain if self._equations.count else gain
        count = min(self._equations.count + 1, MEMORY)
        self._mean_gain += (min(gain, limit) - self._mean_gain) / count
        return min(limit / gain, 1.0) if gain > 0.0 else 1.0

    def _estimate(self) -> None:
        """Estimate the significant deviations: the least significant part is dropped first."""
        parts, values = _PARTS if self._equations.count >= _FEWEST else (), np.zeros(_SIZE)
        by_all = self._equations.solve(_ALL, self._known.values)
        while parts:
            estimate, scatter = by_all if parts == _PARTS else self._equations.solve(
                np.concatenate([_ALL[part] for part in parts]), self._known.values)
            margins = np.array([
                self._equations.significance(part, estimate, scatter) / self._required(part)
                for part in parts])
            if margins.min() >= 1.0:
                values = estimate.copy()
                break
            weakest = int(np.argmin(margins))
            parts = parts[:weakest] + parts[weakest + 1:]
        self._applied = parts
        for unknowns in (slice(0, 6), slice(6, 7), slice(7, 8)):
            if (np.abs(values[unknowns]) < _SMALLEST[unknowns]).all():
                values[unknowns] = 0.0
        self._misalignment = Misalignment.of(self._known.values + values)
        self._delay_sigma = self._sigma_of_delay(values, *by_all)

    def _sigma_of_delay(self, applied: np.ndarray, estimate: np.ndarray,
                        scatter: np.ndarray) -> float:
        """
        Return the standard deviation of the delay [s], by all unknowns together.

        :param applied: deviations that are; an estimate that is not is an error of its size.
        :param estimate: of all unknowns.
        :param scatter: by how much each group of registrations changes it.
        """
        variance = (self._equations.variance(_DELAY, scatter, _DELAY_DESIGN_EFFECT)
                    + (estimate - applied)[_DELAY] ** 2)
        return min(float(np.sqrt(variance)), _LARGEST_DELAY_SIGMA)

    def _required(self, part: slice) -> float:
        """Return the significance that a part requires to be applied."""
        required = _SIGNIFICANT[part.stop - part.start]
        return _STILL_SIGNIFICANT * required if part in self._applied else required
