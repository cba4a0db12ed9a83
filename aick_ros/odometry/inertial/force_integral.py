# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Integrals of the specific force between two frames whose orientations are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros import kernels
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS, seconds

_MEMORY = 2 * NANOSECONDS  # chosen: frames are rarely farther apart
_LONGEST_GAP = NANOSECONDS // 20  # chosen: a hand accelerates by some m/s^2 meanwhile
_STEP = NANOSECONDS // 100  # chosen: of the stamps for derivatives, as long as the offsets are
_SAME_MOUNTING = 1e-4  # rad; chosen: far less than a camera can show

AS_GIVEN = np.eye(3)
"""Mounting of samples whose axes are those of the body; by definition."""


@dataclass(frozen=True, eq=False)
class Impulse:
    """
    What the specific force does to a body in an interval, in the axes of a fixed frame.

    :param duration: of the interval [s].
    :param velocity: its integral, 3 [m/s].
    :param position: its double integral, 3 [m].
    :param velocity_by_bias: derivative of the velocity by a force in the axes of the body, 3x3.
    :param position_by_bias: derivative of the position, 3x3.
    :param velocity_by_offset: derivative of the velocity by the stamps of the forces, 3 [m/s^2].
    :param position_by_offset: derivative of the position, 3 [m/s].
    """

    duration: float
    velocity: np.ndarray
    position: np.ndarray
    velocity_by_bias: np.ndarray
    position_by_bias: np.ndarray
    velocity_by_offset: np.ndarray
    position_by_offset: np.ndarray


class ForceIntegral:
    """Integrates specific forces; what is older than two seconds is forgotten."""

    def __init__(self) -> None:
        self._stamps, self._forces = np.empty(0, np.int64), np.empty((0, 3))
        self._mounting = AS_GIVEN

    @property
    def last(self) -> int | None:
        """Stamp of the last sample [ns]; None without samples."""
        return int(self._stamps[-1]) if len(self._stamps) else None

    def mount(self, mounting: np.ndarray) -> np.ndarray | None:
        """
        Turn the samples by another rotation from their axes to those of the body, 3x3.

        :returns: the rotation of those that are known, 3x3; None: it is hardly another one.
        """
        turn: np.ndarray = mounting @ self._mounting.T
        if se3.angle(turn) < _SAME_MOUNTING:
            return None
        self._mounting, self._forces = mounting, self._forces @ turn.T
        return turn

    def add(self, stamps: np.ndarray, forces: np.ndarray) -> None:
        """
        Add samples; one that is not later than the one before begins anew.

        :param stamps: of the samples, N int64 [ns].
        :param forces: Nx3, in their axes [m/s^2].
        """
        if not len(stamps):
            return
        stamps = np.concatenate([self._stamps, stamps])
        begins = np.flatnonzero(stamps[1:] <= stamps[:-1])
        first = begins[-1] + 1 if len(begins) else 0
        if stamps[-1] - stamps[first] > 2 * _MEMORY:
            first += stamps[first:].searchsorted(stamps[-1] - _MEMORY)
        self._stamps = stamps[first:]
        self._forces = np.concatenate([self._forces, forces @ self._mounting.T])[first:]

    def recent(self, end: int, duration: int) -> np.ndarray:
        """Return the forces of some time [ns] up to a stamp [ns], Nx3 in the body's axes."""
        first = self._stamps.searchsorted(end - duration)
        return self._forces[first:self._stamps.searchsorted(end, 'right')]

    def between(self, start: int, end: int, first: np.ndarray, last: np.ndarray
                ) -> Impulse | None:
        """
        Return the integrals between two stamps [ns]; None where samples are missing.

        :param first: orientation of the body in the fixed frame at the start, 3x3.
        :param last: at the end. In between it turns evenly.
        """
        known = self._stamps[self._around(start, end)]
        if (not len(known) or known[0] > start + _LONGEST_GAP or known[-1] < end - _LONGEST_GAP
                or (known[1:] - known[:-1]).max(initial=0) > _LONGEST_GAP):
            return None
        once, twice = self._sums(start, end, first, last)
        earlier = self._sums(start - _STEP, end - _STEP, first, last)[:, :3]
        by_offset = (np.stack([once[:3], twice[:3]]) - earlier) / seconds(0, _STEP)
        return Impulse(seconds(start, end), once[:3], twice[:3], once[3:].reshape(3, 3),
                       twice[3:].reshape(3, 3), *by_offset)

    def _sums(self, start: int, end: int, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return the integral, and the double one, of force and rotation, 2x12."""
        index, sums = self._around(start, end), np.empty((2, 12))
        kernels.integrate_forces(self._stamps[index], self._forces[index], start, end, first, last,
                                 sums)
        return sums

    def _around(self, start: int, end: int) -> slice:
        """Return the samples between two stamps, the one before and the one after."""
        return slice(max(self._stamps.searchsorted(start, 'right') - 1, 0),
                     self._stamps.searchsorted(end) + 1)
