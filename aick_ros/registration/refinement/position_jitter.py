# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Jitter of the position by keypoints, which their scatter in the image does not show.

An error that all keypoints of an image share, as that of a shutter, of autofocus or of a stamp,
does not scatter. From one registration to the next it changes, though, while a camera moves
smoothly. The second differences of the poses over time have little of the motion and all of the
jitter. Keypoints and depth see the same motion, so that the product of the difference by keypoints
with what it has beyond that by depth has none of it in the mean: it is the variance by keypoints
alone, as of two instruments that measure the same items (Grubbs 1948).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.registration.samples import PosesByKind

# Chosen on two excerpts of real recordings and on rendered rooms with five kinds of cameras.
_REGULAR = 0.25  # intervals that differ by a smaller share count as equal
_MEMORY = 30  # registrations that the mean is over
_FEWEST = 10  # registrations that show something
_SIGNIFICANT = 1.5  # standard errors; a smaller mean counts as none
_LARGEST = 0.02 ** 2  # m^2; bound on what one registration shows

_NOISE = 6.0  # by definition: sum of the squares of the factors 1, -2 and 1
_SAMPLES_PER_INDEPENDENT_ONE = 2.0  # chosen: neighbouring second differences share two poses


def jitter(first: PosesByKind, second: PosesByKind, third: PosesByKind) -> float | None:
    """
    Return the variance of the position by keypoints beyond what their scatter shows [m^2].

    It may be negative: only the mean over registrations has no error.

    :returns: None unless the three are consecutive: at equal intervals, in one target or in
        targets at the same intervals.
    """
    if not _consecutive(first, second, third):
        return None
    by_keypoints = _second_difference(
        first.by_keypoints, second.by_keypoints, third.by_keypoints)
    by_depth = _second_difference(first.by_depth, second.by_depth, third.by_depth)
    expected = (first.variance + second.variance + third.variance) / 3
    return float(by_keypoints @ (by_keypoints - by_depth)) / (3 * _NOISE) - expected


def _second_difference(first: np.ndarray, second: np.ndarray, third: np.ndarray) -> np.ndarray:
    """Return what the third position differs by from the one at the first two's motion, 3."""
    expected = second @ se3.inverse(first) @ second
    difference: np.ndarray = third[:3, 3] - expected[:3, 3]
    return difference


def _consecutive(first: PosesByKind, second: PosesByKind, third: PosesByKind) -> bool:
    (source, target), (source_after, target_after) = (
        (after.stamps[0] - before.stamps[0], after.stamps[1] - before.stamps[1])
        for before, after in ((first, second), (second, third)))
    others = [source_after]
    if target or target_after:
        others += [target, target_after]
    return source > 0 and all(abs(other - source) < _REGULAR * source for other in others)


@dataclass(frozen=True)
class MeanJitter:
    """
    Mean of what registrations show of the jitter.

    :param mean: [m^2].
    :param square: mean square [m^4].
    """

    count: int = 0
    mean: float = 0.0
    square: float = 0.0

    def with_sample(self, sample: float) -> MeanJitter:
        """Return the mean with the jitter that one more registration shows [m^2]."""
        count = min(self.count + 1, _MEMORY)
        sample = min(max(sample, -_LARGEST), _LARGEST)
        return MeanJitter(count, self.mean + (sample - self.mean) / count,
                          self.square + (sample ** 2 - self.square) / count)

    @property
    def variance(self) -> float:
        """
        Variance of the position along an axis [m^2].

        It is 0 where the mean is not significant, and grows to the mean where it is.
        """
        if self.count < _FEWEST or self.mean <= 0.0:
            return 0.0
        squared_error = (_SAMPLES_PER_INDEPENDENT_ONE * (self.square - self.mean ** 2)
                         / self.count)
        return self.mean * max(1.0 - _SIGNIFICANT ** 2 * squared_error / self.mean ** 2, 0.0)
