# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Misalignment of a camera's images, estimated over its registrations.

The normal equations of all pairs of frames are added up, their poses eliminated. An offset, an
error of the focal lengths or a lens that is not significant against how far parts of the
registrations contradict each other changes nothing; it makes motions less certain. Delay and
readouts are corrected as soon as they are likely, by as much as is likely: many cameras have them,
and while they are not corrected each motion errs. What is estimated is the deviation from a
misalignment that is known: by the settings, zero unless the camera was measured before.

The scale of depth is none of the unknowns: it would scale the whole trajectory, and nothing
contradicts it.
"""

from __future__ import annotations

import math

import numpy as np

from aick_ros.geometry import definite
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.grouped_equations import MEMORY, RUN, GroupedEquations
from aick_ros.registration.refinement.likely_error import (
    PROBABILITY, LikelyError, LikelyErrors, probability_by)
from aick_ros.registration.refinement.misalignment import NO_MISALIGNMENT, Misalignment
from aick_ros.registration.samples import MisalignmentSample

_SIZE = 12  # offset in m and rad, delay and readouts in s, errors of focal lengths, lens
_ALL = np.arange(_SIZE, dtype=np.int64)
_OFFSET, _TIMES = slice(0, 6), slice(6, 9)
_FOCAL, _LENS, _OPTICS = slice(9, 11), slice(11, 12), slice(9, 12)
_COLOUR_READOUT = slice(7, 8)
_PARTS: tuple[slice, ...] = _OFFSET, _FOCAL, _LENS
"""Each is significant or not, beside delay and readouts if those are likely."""

# All chosen on two excerpts of real recordings and on rendered rooms with nine kinds of cameras.
_KEPT = 0.8  # weight of a group's earlier registrations, each time that it is added to
_FEWEST = 20  # registrations before more than the times is estimated, or anything reported
PRIOR_SIGMAS = np.array([0.02, 0.02, 0.02, 0.035, 0.035, 0.035, 0.02, 0.02, 0.02, 0.05, 0.05,
                         0.05])
_DESIGN_EFFECT = 10.0  # of the information: residuals have common errors
_PRIOR = np.diag(_DESIGN_EFFECT / PRIOR_SIGMAS ** 2)
"""Information about the twelve numbers before any registration, 12x12."""

_SIGNIFICANT = {6: (45.0, 22.0, 15.0), 2: (50.0, 26.0, 22.0), 1: (167.0, 74.0, 47.0)}
"""Square of an estimate by its variance, both weighted by the information, from which on it is
applied, by the number of unknowns: after 20, after 25 and from 30 registrations on. Derived:
chance exceeds F(6, 3), F(2, 3) and so on, up to F(6, 7) and F(2, 7), so far in one to five of a
thousand, and F(1, 3) to F(1, 5) in one: a single number has no other that could contradict it.
Cameras without misalignment show 1 to 8, others 40 to 1000."""

_LARGE = {6: 22.5, 2: 13.8, 1: 10.8}
"""Square of an estimate by its covariance from which on it is applied too. Derived: chance exceeds
chi-square with as many degrees of freedom so far in one of a thousand. Offsets estimated of
cameras without any show 0 to 15, others hundreds."""

_CLEAREST = 4.0
"""Significance by what is required, up to which what is required of the size falls as it rises.
Chosen: the lens of a camera with noisy depth was 3 times as significant, and half as large."""

_SINGLY = _OFFSET, slice(9, 10), slice(10, 11), _LENS
"""Unknowns that are applied together or not at all, by their size."""

_STILL_SIGNIFICANT = 0.5  # of both: below it an estimate is no longer applied

_SMALLEST = np.array([0.003, 0.003, 0.003, 0.0026, 0.0026, 0.0026, 0.002, 0.004, 0.004,
                      0.01, 0.01, 0.015])
"""Estimates that are smaller are not applied: 3 mm and 0.15 deg, 1 %, 0.015: a lens of that much
lengthens motions by 0.7 %. Times that are smaller are not reported: 2 ms and 4 ms."""

_DELAY = 6  # by definition: its place among the unknowns
_DELAY_DESIGN_EFFECT = 25.0  # of the information about the delay, for its standard deviation
_LARGEST_DELAY_SIGMA = 0.01
"""Standard deviation of a delay that nothing is known of [s]. Derived: at 30 Hz two images that
belong together are at most half an interval apart."""

_SAME_FOCAL = 0.005  # chosen: relative change of a focal length that leaves its error as it is
_OUTLYING = 3.0  # gain of a registration, as a ratio to the mean, from which on its weight falls


class MisalignmentEstimate:
    """
    Misalignment of one camera, learned over its registrations.

    :param known: holds until a deviation from it is significant, or likely.
    """

    def __init__(self, known: Misalignment = NO_MISALIGNMENT) -> None:
        self._known = known
        self._camera: Camera | None = None
        self._forget()

    def _forget(self) -> None:
        self._misalignment = self._found = self._known
        self._equations = GroupedEquations(_PRIOR, _KEPT)
        self._mean_gain = 0.0
        self._applied: tuple[slice, ...] = ()
        self._delay_sigma = _LARGEST_DELAY_SIGMA
        self._offset_covariance = _unknown(_OFFSET)
        self._optics_covariance = _unknown(_OPTICS)
        self._readout_covariance = _unknown(_COLOUR_READOUT)

    @property
    def misalignment(self) -> Misalignment:
        """Misalignment to be corrected: the known one with what is significant, or likely."""
        return self._misalignment

    @property
    def found(self) -> Misalignment:
        """Misalignment to be reported: the known one with what is significant, or certain."""
        return self._found

    @property
    def delay_sigma(self) -> float:
        """Standard deviation of the delay that is corrected [s]: also where none is."""
        return self._delay_sigma

    @property
    def offset_covariance(self) -> np.ndarray:
        """Covariance of the offset that is corrected, 6x6: also where none is."""
        return self._offset_covariance

    @property
    def optics_covariance(self) -> np.ndarray:
        """Covariance of the relative errors of both focal lengths and of the lens, 3x3."""
        return self._optics_covariance

    @property
    def readout_covariance(self) -> np.ndarray:
        """Covariance of the readout of colour images, 1x1 [s^2]: also where none is corrected."""
        return self._readout_covariance

    def follow(self, camera: Camera) -> None:
        """
        Start anew where the calibration of a camera is another one: its errors are others.

        A change of the resolution leaves them as they are.

        :param camera: of the present frame.
        """
        before = self._camera
        if before is None or (before.width, before.height) != (camera.width, camera.height):
            self._camera = camera
        elif not (camera.distortion == before.distortion
                  and math.isclose(camera.fx, before.fx, rel_tol=_SAME_FOCAL)
                  and math.isclose(camera.fy, before.fy, rel_tol=_SAME_FOCAL)):
            self._camera = camera
            self._forget()

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
        gain = float(error @ definite.solve(sample.information + _PRIOR, error))
        limit = _OUTLYING * self._mean_gain if self._equations.count else gain
        count = min(self._equations.count + 1, MEMORY)
        self._mean_gain += (min(gain, limit) - self._mean_gain) / count
        return min(limit / gain, 1.0) if gain > 0.0 else 1.0

    def _estimate(self) -> None:
        """Estimate the deviations: of those parts the least significant one is dropped first."""
        by_all = self._equations.solve(_ALL, self._known.values)
        times = self._times(*by_all)
        likely = _ALL[_TIMES] if times.corrected.any() else _ALL[:0]
        parts, values = _PARTS if self._equations.count >= _FEWEST else (), np.zeros(_SIZE)
        while parts:
            estimate, scatter = self._equations.solve(
                _unknowns(parts, likely), self._known.values)
            margins = self._margins(parts, likely, estimate, scatter)
            kept = tuple(part for part in parts if not _is_small(estimate, part))
            if min(margins) < 1.0:
                weakest = margins.index(min(margins))
                parts = parts[:weakest] + parts[weakest + 1:]
            elif kept != parts:
                parts = kept  # the others may be significant beside them alone
            else:
                values = estimate.copy()
                break
        self._applied = parts
        for unknowns in _SINGLY:
            if _is_small(values, unknowns):
                values[unknowns] = 0.0
        values[_TIMES] = times.corrected
        self._apply(values, times, *by_all)

    def _apply(self, values: np.ndarray, times: LikelyErrors, estimate: np.ndarray,
               scatter: np.ndarray) -> None:
        """
        Let deviations be corrected from now on.

        :param estimate: of all unknowns, without regard to what is corrected.
        :param scatter: by how much each group of registrations changes it.
        """
        self._misalignment = Misalignment.of(self._known.values + values)
        self._found = self._reported(values, times)
        self._delay_sigma = self._sigma_of_delay(values, times, estimate, scatter)
        full = self._equations.full_covariance(scatter, _DESIGN_EFFECT)
        self._offset_covariance = _covariance_of(_OFFSET, values, estimate, full)
        self._optics_covariance = _covariance_of(_OPTICS, values, estimate, full)
        self._readout_covariance = times.variances_left[1:2, None]

    def _times(self, estimate: np.ndarray, scatter: np.ndarray) -> LikelyErrors:
        """
        Return the delay and both readouts, by an estimate of all unknowns.

        Where they are not likely they are zero beside the other parts: a delay of a camera that
        turns at a constant rate is like an offset, which would not be significant beside it.
        """
        variances = _DESIGN_EFFECT * np.diag(self._equations.covariance(_ALL))
        scatters = self._equations.variances(scatter)
        return LikelyErrors([
            LikelyError.of(estimate[i], variances[i], scatters[i], self._equations.groups,
                           PRIOR_SIGMAS[i]) for i in _ALL[_TIMES]])

    def _reported(self, values: np.ndarray, times: LikelyErrors) -> Misalignment:
        """Return the misalignment to be reported, of what is corrected."""
        if self._equations.count < _FEWEST:
            return self._known
        values = values.copy()
        values[_TIMES] *= times.are_certain & (np.abs(times.corrected) > _SMALLEST[_TIMES])
        return Misalignment.of(self._known.values + values)

    def _sigma_of_delay(self, applied: np.ndarray, times: LikelyErrors, estimate: np.ndarray,
                        scatter: np.ndarray) -> float:
        """
        Return the standard deviation of the delay [s]: the larger of two.

        One is by Bayes' rule, the other by all unknowns together, as if there were a delay.

        :param applied: deviations that are; an estimate that is not is an error of its size.
        :param estimate: of all unknowns.
        :param scatter: by how much each group of registrations changes it.
        """
        covariance = self._equations.full_covariance(scatter, _DELAY_DESIGN_EFFECT)
        variance = covariance[_DELAY, _DELAY] + (estimate - applied)[_DELAY] ** 2
        return min(math.sqrt(max(variance, times.variances_left[0])), _LARGEST_DELAY_SIGMA)

    def _margins(self, parts: tuple[slice, ...], likely: np.ndarray, estimate: np.ndarray,
                 scatter: np.ndarray) -> list[float]:
        """Return by how much each part exceeds what is required to apply it, of all estimated."""
        covariance = self._equations.covariance(_unknowns(parts, likely))
        first, margins = 0, []
        latest = min((self._equations.count - _FEWEST) // RUN, 2)
        for part in parts:
            size = part.stop - part.start
            own = covariance[first:first + size, first:first + size]
            first += size
            square = float(estimate[part] @ definite.solve(own, estimate[part])) / _DESIGN_EFFECT
            significance = self._equations.significance(part, estimate, scatter)
            clear = significance / _SIGNIFICANT[size][latest]
            margin = min(clear, square / _LARGE[size] * min(max(clear, 1.0), _CLEAREST))
            margins.append(margin / _STILL_SIGNIFICANT if part in self._applied else margin)
        return margins


def _covariance_of(part: slice, applied: np.ndarray, estimate: np.ndarray,
                   covariance: np.ndarray) -> np.ndarray:
    """
    Return the covariance of one part of the unknowns, by all of them together.

    Where none is applied there may be none, as is likely for a camera that was calibrated: by
    Bayes' rule.

    :param applied: deviations that are; an estimate that is not is an error of its size.
    :param estimate: of all unknowns; ``covariance``: of the estimate.
    """
    covariance = covariance[part, part]
    if not np.isfinite(covariance).all():
        return _unknown(part)
    estimate, error = estimate[part], (estimate - applied)[part]
    square = float(estimate @ definite.solve(covariance, estimate))
    prior = np.diag(PRIOR_SIGMAS[part] ** 2)
    contraction = np.linalg.slogdet(definite.solve(prior, covariance))[1]
    probability = 1.0 if applied[part].any() else probability_by(0.5 * (square + contraction))
    return probability * (covariance + np.outer(error, error))


def _is_small(values: np.ndarray, unknowns: slice) -> bool:
    return bool((np.abs(values[unknowns]) < _SMALLEST[unknowns]).all())


def _unknown(part: slice) -> np.ndarray:
    """Return the covariance of unknowns before any registration."""
    return PROBABILITY * np.diag(PRIOR_SIGMAS[part] ** 2)


def _unknowns(parts: tuple[slice, ...], times: np.ndarray) -> np.ndarray:
    """Return the unknowns of some parts, in their order, and after them some of the times."""
    return np.concatenate([*(_ALL[part] for part in parts), times])
