# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Integral of turn rates on the rotation group, between any two recent stamps.

With R(t) the rotation since the first sample, a constant bias b of the rates turns the rotation
between two times i and j, in the axes at i, by -J b to first order (Forster et al. 2017), with

    J = R(i)^T (integral of R from i to j).

Both R and its integral are sums from the first sample on, so that each interval costs two
look-ups, whatever its length.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS, seconds

_MEMORY = 30 * NANOSECONDS  # chosen: keyframes are rarely older
_LONGEST_GAP = NANOSECONDS // 20  # chosen: a hand turns by up to some degrees meanwhile
_EXTRAPOLATED = NANOSECONDS // 50  # chosen: the last samples may arrive after the image
_RELINEARISED = 0.002  # rad/s; chosen: in 10 s its second order is 0.01 deg


@dataclass(frozen=True, eq=False)
class Turn:
    """
    Rotation of a body between two times, by its turn rates.

    :param rotation: ``R_body0_body1``, 3x3.
    :param duration: time between the two [s].
    :param by_bias: 3x3, J above: a bias of the rates turns the rotation by ``-by_bias @ bias``.
    :param rates: 2x3, turn rates at the start and at the end, in the axes of the body [rad/s].
    :param extrapolated: time at the end for which no sample has arrived [s].
    """

    rotation: np.ndarray
    duration: float
    by_bias: np.ndarray
    rates: np.ndarray
    extrapolated: float

    @property
    def by_offset(self) -> np.ndarray:
        """Derivative of the rotation by the time that both ends are later, 3."""
        derivative: np.ndarray = self.rotation @ self.rates[1] - self.rates[0]
        return derivative


@dataclass(frozen=True, eq=False)
class _Node:
    """
    The integral at one sample.

    :param rotation: since the first sample, 3x3.
    :param integral: of the rotation since then, 3x3 [s].
    :param rate: 3, measured here [rad/s].
    """

    rotation: np.ndarray
    integral: np.ndarray
    rate: np.ndarray


class RotationIntegral:
    """Integrates turn rates; what is older than half a minute is forgotten."""

    def __init__(self) -> None:
        self._bias = np.zeros(3)
        self._clear()

    @property
    def last(self) -> int | None:
        """Stamp of the last sample [ns]; None without samples."""
        return self._stamps[-1] if self._stamps else None

    def add(self, stamp: int, rate: np.ndarray) -> None:
        """
        Add a sample; after a gap of more than 50 ms, or an earlier one, the integral begins anew.

        :param stamp: of the sample [ns].
        :param rate: 3, turn rate in the axes of the body [rad/s].
        """
        if self._stamps and not 0 < stamp - self._stamps[-1] <= _LONGEST_GAP:
            self._clear()
        self._append(stamp, rate)
        if stamp - self._stamps[0] > 2 * _MEMORY:
            self._forget(stamp - _MEMORY)

    def between(self, start: int, end: int, bias: np.ndarray) -> Turn | None:
        """
        Return the rotation between two stamps [ns]; None where samples are missing.

        :param bias: 3, subtracted from all rates [rad/s].
        """
        if not self._stamps or start < self._stamps[0] or end > (
                self._stamps[-1] + _EXTRAPOLATED):
            return None
        if np.abs(bias - self._bias).max() > _RELINEARISED:
            self._linearise(bias)
        first, last = self._at(start), self._at(end)
        back = first.rotation.T
        by_bias = back @ (last.integral - first.integral)
        correction = se3.exp_rotation(-by_bias @ (bias - self._bias))
        return Turn(correction @ back @ last.rotation, seconds(start, end), by_bias,
                    np.array([first.rate, last.rate]) - bias,
                    max(seconds(self._stamps[-1], end), 0.0))

    def _at(self, stamp: int) -> _Node:
        """Return the integral at a stamp within the samples, or a little after the last one."""
        index = bisect_right(self._stamps, stamp) - 1
        node, elapsed = self._nodes[index], seconds(self._stamps[index], stamp)
        if index + 1 == len(self._nodes):
            return _advanced(node, node.rate, elapsed, self._bias)
        after = self._nodes[index + 1].rate
        share = elapsed / seconds(self._stamps[index], self._stamps[index + 1])
        return _advanced(node, node.rate + share * (after - node.rate), elapsed, self._bias)

    def _append(self, stamp: int, rate: np.ndarray) -> None:
        node = _Node(np.eye(3), np.zeros((3, 3)), rate)
        if self._stamps:
            node = _advanced(self._nodes[-1], rate, seconds(self._stamps[-1], stamp), self._bias)
        self._stamps.append(stamp)
        self._nodes.append(node)

    def _linearise(self, bias: np.ndarray) -> None:
        """Integrate all samples again, about another bias."""
        samples = list(zip(self._stamps, self._nodes))
        self._clear()
        self._bias = bias.copy()
        for stamp, node in samples:
            self._append(stamp, node.rate)

    def _forget(self, before: int) -> None:
        count = bisect_left(self._stamps, before)
        del self._stamps[:count], self._nodes[:count]

    def _clear(self) -> None:
        self._stamps: list[int] = []
        self._nodes: list[_Node] = []


def _advanced(node: _Node, rate: np.ndarray, elapsed: float, bias: np.ndarray) -> _Node:
    """Return the integral some time [s] later, where the rate has become another one."""
    mean = 0.5 * (node.rate + rate) - bias
    by_half = se3.exp_rotation(0.5 * elapsed * mean)
    in_between = node.rotation @ by_half
    return _Node(in_between @ by_half, node.integral + elapsed * in_between, rate)
