# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Integrals of the specific force between two frames whose orientations are known."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS, seconds

_MEMORY = 2 * NANOSECONDS  # chosen: frames are rarely farther apart
_LONGEST_GAP = NANOSECONDS // 20  # chosen: a hand accelerates by some m/s^2 meanwhile


@dataclass(frozen=True, eq=False)
class Impulse:
    """
    What the specific force does to a body in an interval, in the axes of a fixed frame.

    :param duration: of the interval [s].
    :param velocity: its integral, 3 [m/s].
    :param position: its double integral, 3 [m].
    :param velocity_by_bias: derivative of the velocity by a force in the axes of the body, 3x3.
    :param position_by_bias: derivative of the position, 3x3.
    """

    duration: float
    velocity: np.ndarray
    position: np.ndarray
    velocity_by_bias: np.ndarray
    position_by_bias: np.ndarray


class ForceIntegral:
    """Integrates specific forces; what is older than two seconds is forgotten."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._forces: list[np.ndarray] = []

    @property
    def last(self) -> int | None:
        """Stamp of the last sample [ns]; None without samples."""
        return self._stamps[-1] if self._stamps else None

    def add(self, stamps: np.ndarray, forces: np.ndarray) -> None:
        """
        Add samples; one that is not later than the one before begins anew.

        :param stamps: of the samples, N int64 [ns].
        :param forces: Nx3, in the axes of the body [m/s^2].
        """
        for stamp, force in zip(stamps.tolist(), forces):
            if self._stamps and stamp <= self._stamps[-1]:
                self._stamps, self._forces = [], []
            self._stamps.append(stamp)
            self._forces.append(force)
        if self._stamps and self._stamps[-1] - self._stamps[0] > 2 * _MEMORY:
            count = bisect_left(self._stamps, self._stamps[-1] - _MEMORY)
            del self._stamps[:count], self._forces[:count]

    def recent(self, end: int, duration: int) -> np.ndarray:
        """Return the forces of some time [ns] up to a stamp [ns], Nx3 in the body's axes."""
        first, last = bisect_left(self._stamps, end - duration), bisect_right(self._stamps, end)
        return np.array(self._forces[first:last]).reshape(-1, 3)

    def between(self, start: int, end: int, first: np.ndarray, last: np.ndarray
                ) -> Impulse | None:
        """
        Return the integrals between two stamps [ns]; None where samples are missing.

        :param first: orientation of the body in the fixed frame at the start, 3x3.
        :param last: at the end. In between it turns evenly.
        """
        index = slice(bisect_right(self._stamps, start), bisect_left(self._stamps, end))
        known = self._stamps[max(index.start - 1, 0):index.stop + 1]
        edges = [start, *self._stamps[index], end]
        if not known or max(np.diff(known + [end] if known[-1] < end else known),
                            default=0) > _LONGEST_GAP or known[0] > start + _LONGEST_GAP:
            return None
        times = np.array([seconds(start, stamp) for stamp in edges])
        at = [seconds(start, stamp) for stamp in known]
        samples = np.array(self._forces[max(index.start - 1, 0):index.stop + 1])
        forces = np.column_stack([np.interp(times, at, samples[:, axis]) for axis in range(3)])
        return _integrated(times, forces, _rotations(first, last, times / times[-1]))


def _integrated(times: np.ndarray, forces: np.ndarray, rotations: np.ndarray) -> Impulse:
    """Return the integrals of N forces at some times [s] from zero on, by trapezoids."""
    steps = np.diff(times)
    weights = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
    remaining = weights * (times[-1] - times)
    turned = np.einsum('nij,nj->ni', rotations, forces)
    return Impulse(float(times[-1]), weights @ turned, remaining @ turned,
                   np.tensordot(weights, rotations, 1), np.tensordot(remaining, rotations, 1))


def _rotations(first: np.ndarray, last: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return the rotations at shares of the way from one to another, Nx3x3 (Rodrigues)."""
    turn = se3.log_rotation(first.T @ last)
    angle = float(np.linalg.norm(turn))
    axis = se3.skew(turn / max(angle, 1e-12))
    angles = (angle * shares)[:, None, None]
    rotations: np.ndarray = first @ (
        np.eye(3) + np.sin(angles) * axis + (1.0 - np.cos(angles)) * axis @ axis)
    return rotations
