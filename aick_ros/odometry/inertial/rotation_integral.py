# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Integral of turn rates on the rotation group, between any two recent stamps.

The rates are A (measured - b), with a constant bias b and a matrix A that corrects their scale and
their axes. With R(t) the rotation since the first sample, a change of b turns the rotation between
two times i and j, in the axes at i, by -J A db to first order (Forster et al. 2017), with

    J = R(i)^T (integral of R from i to j),

and one of A by R(i)^T (integral of R dA (measured - b)). R and these integrals are sums from the
first sample on, so that each interval costs two look-ups, whatever its length.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.geometry.turns import integrated_turns

_MEMORY = 30 * NANOSECONDS  # chosen: keyframes are rarely older
_LONGEST_GAP = NANOSECONDS // 20  # chosen: a hand turns by up to some degrees meanwhile
_REMEMBERED = 1.0  # s; chosen: a hand shakes for longer
_EXTRAPOLATED = NANOSECONDS // 50  # chosen: the last samples may arrive after the image
_RELINEARISED = 0.002  # rad/s; chosen: in 10 s its second order is 0.01 deg
_RESCALED = 0.002  # of the matrix; chosen: in a turn by 90 deg its second order is 0.0003 deg


@dataclass(frozen=True, eq=False)
class Turn:
    """
    Rotation of a body between two times, by its turn rates.

    :param rotation: ``R_body0_body1``, 3x3.
    :param duration: time between the two [s].
    :param by_bias: 3x3, J A above: a bias of the rates turns the rotation by ``-by_bias @ bias``.
    :param by_matrix: 3x9, derivatives by the numbers of A, row by row.
    :param rates: 2x3, turn rates at the start and at the end, in the axes of the body [rad/s].
    :param extrapolated: time at the end for which no sample has arrived [s].
    """

    rotation: np.ndarray
    duration: float
    by_bias: np.ndarray
    by_matrix: np.ndarray
    rates: np.ndarray
    extrapolated: float

    @property
    def by_offset(self) -> np.ndarray:
        """Derivative of the rotation by the time that both ends are later, 3."""
        derivative: np.ndarray = self.rotation @ self.rates[1] - self.rates[0]
        return derivative


@dataclass(frozen=True, eq=False)
class _Part:
    """
    The integral at N samples in a row; the first one is the last one of the part before.

    :param stamps: N int64 [ns].
    :param rates: Nx3, as measured [rad/s].
    :param rotations: since the first sample of all parts, Nx3x3.
    :param integrals: of the rotation since then, Nx3x3 [s].
    :param products: integrals of its products with the rates, Nx3x3x3 [rad].
    """

    stamps: np.ndarray
    rates: np.ndarray
    rotations: np.ndarray
    integrals: np.ndarray
    products: np.ndarray


class RotationIntegral:
    """Integrates turn rates; what is older than half a minute is forgotten."""

    def __init__(self) -> None:
        self._bias = np.zeros(3)
        self._matrix = self._inverse = np.eye(3)
        self._between_samples: float | None = None  # [rad^2]
        self._clear()

    @property
    def last(self) -> int | None:
        """Stamp of the last sample [ns]; None without samples."""
        parts = self._parts  # another thread may begin anew meanwhile
        return int(parts[-1].stamps[-1]) if parts else None

    @property
    def interpolation_variance(self) -> float:
        """
        Variance of a rotation about an axis by the rates at its two ends between samples [rad^2].

        Between samples rates are interpolated. By the trapezoidal rule the ends of an integral err
        by a twelfth of the change of the rates from sample to sample times the interval (Euler and
        Maclaurin); what is in between cancels.
        """
        return 2.0 * (self._between_samples or 0.0) / 12.0 ** 2

    def add(self, stamps: np.ndarray, rates: np.ndarray) -> None:
        """
        Add samples; after a gap of more than 50 ms, or an earlier one, the integral begins anew.

        :param stamps: of the samples, N int64 [ns].
        :param rates: Nx3, turn rates in the axes of the body [rad/s].
        """
        if not len(stamps):
            return
        if self._parts:
            before = self._parts[-1]
            stamps = np.append(before.stamps[-1:], stamps)
            rates = np.concatenate([before.rates[-1:], rates])
        intervals = np.diff(stamps)
        gaps = np.flatnonzero((intervals <= 0) | (intervals > _LONGEST_GAP))
        if len(gaps):
            self._clear()
            stamps, rates = stamps[gaps[-1] + 1:], rates[gaps[-1] + 1:]
        self._note_changes(stamps, rates)
        self._append(stamps, rates)
        count = bisect_right(self._starts, stamps[-1] - _MEMORY) - 1
        if count > 0:
            del self._starts[:count], self._parts[:count]

    def _note_changes(self, stamps: np.ndarray, rates: np.ndarray) -> None:
        """Average by how much rates change from sample to sample, times the interval."""
        if len(stamps) < 2:
            return
        changes = np.diff(rates, axis=0) * (np.diff(stamps) / NANOSECONDS)[:, None]
        square = float(np.mean(changes ** 2))
        before = square if self._between_samples is None else self._between_samples
        kept = math.exp(-seconds(stamps[0], stamps[-1]) / _REMEMBERED)
        self._between_samples = square + kept * (before - square)

    def between(self, start: int, end: int, bias: np.ndarray,
                matrix: np.ndarray = np.eye(3)) -> Turn | None:
        """
        Return the rotation between two stamps [ns]; None where samples are missing.

        :param bias: 3, subtracted from all rates [rad/s].
        :param matrix: 3x3, by which they are multiplied then: A above.
        """
        if self.last is None or start < self._starts[0] or end > self.last + _EXTRAPOLATED:
            return None
        if (np.abs(bias - self._bias).max() > _RELINEARISED
                or np.abs(matrix - self._matrix).max() > _RESCALED):
            self._linearise(bias, matrix)
        first, last = self._at(start), self._at(end)
        back = first.rotations[-1].T
        by_bias = back @ (last.integrals[-1] - first.integrals[-1]) @ matrix
        measured = (last.products[-1] - first.products[-1]) @ self._inverse.T
        by_matrix = back @ measured.reshape(3, 9)
        correction = se3.exp_rotation(by_matrix @ (matrix - self._matrix).ravel()
                                      - by_bias @ (bias - self._bias))
        rates = np.array([first.rates[-1], last.rates[-1]])
        return Turn(correction @ back @ last.rotations[-1], seconds(start, end), by_bias,
                    by_matrix, (rates - bias) @ matrix.T, max(seconds(self.last, end), 0.0))

    def _at(self, stamp: int) -> _Part:
        """Return the integral up to a stamp within the samples, or a little after the last one."""
        part = self._parts[bisect_right(self._starts, stamp) - 1]
        row = int(np.searchsorted(part.stamps, stamp, 'right')) - 1
        times, rates = part.stamps[row:row + 2], part.rates[row:row + 2]
        elapsed = stamp - int(times[0])
        share = elapsed / int(times[-1] - times[0]) if len(times) > 1 else 0.0
        return self._part(np.array([0, elapsed], np.int64),
                          np.array([rates[0], rates[0] + share * (rates[-1] - rates[0])]),
                          part.rotations[row], part.integrals[row], part.products[row])

    def _append(self, stamps: np.ndarray, rates: np.ndarray) -> None:
        """Append the part of some samples, which begins where the last one ends."""
        before = self._parts[-1] if self._parts else None
        where = () if before is None else (
            before.rotations[-1], before.integrals[-1], before.products[-1])
        self._parts.append(self._part(stamps, rates, *where))
        self._starts.append(int(stamps[0]))

    def _part(self, stamps: np.ndarray, rates: np.ndarray, rotation: np.ndarray = np.eye(3),
              integral: np.ndarray = np.zeros((3, 3)),
              products: np.ndarray = np.zeros((3, 3, 3))) -> _Part:
        """Return the part that begins with a rotation and integrals."""
        corrected = (rates - self._bias) @ self._matrix.T
        return _Part(stamps, rates, *integrated_turns(
            stamps, corrected, rotation, integral, products))

    def _linearise(self, bias: np.ndarray, matrix: np.ndarray) -> None:
        """Integrate all samples again, about another bias and matrix."""
        first, *others = self._parts
        stamps = np.concatenate([first.stamps, *(part.stamps[1:] for part in others)])
        rates = np.concatenate([first.rates, *(part.rates[1:] for part in others)])
        self._clear()
        self._bias, self._matrix = bias.copy(), matrix.copy()
        self._inverse = np.linalg.inv(matrix)
        self._append(stamps, rates)

    def _clear(self) -> None:
        self._parts: list[_Part] = []
        self._starts: list[int] = []  # stamps of their first samples [ns]
