# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Allan variance of a sensor at rest: how its means over some time differ from one to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_FEWEST_MEANS = 5  # chosen: fewer have no more than two degrees of freedom


@dataclass(frozen=True, eq=False)
class AllanVariance:
    """
    Allan variances of some axes, at times that double.

    :param times: T, averaging times [s].
    :param variances: TxK, of K axes [unit^2].
    :param degrees_of_freedom: T, of the variance of one axis: its error is chi-square distributed.
    """

    times: np.ndarray
    variances: np.ndarray
    degrees_of_freedom: np.ndarray

    @property
    def relative_errors(self) -> np.ndarray:
        """Standard deviations of the variances of one axis, by the variances, T."""
        errors: np.ndarray = np.sqrt(2.0 / self.degrees_of_freedom)
        return errors


def allan_variance(values: np.ndarray, interval: float) -> AllanVariance:
    """
    Return the Allan variances of evenly spaced values, with overlap (IEEE 1139).

    :param values: NxK, at least 5 of each axis.
    :param interval: between them [s].
    """
    count = len(values)
    # the sum of biases would cost digits
    sums = np.vstack([np.zeros((1, values.shape[1])),
                      np.cumsum(values - values.mean(axis=0), axis=0)])
    lengths = 2 ** np.arange(int(np.log2(count // _FEWEST_MEANS)) + 1)
    variances = []
    for length in lengths:
        differences = sums[2 * length:] - 2.0 * sums[length:-length] + sums[:-2 * length]
        variances.append(0.5 * np.mean(np.square(differences / length), axis=0))
    return AllanVariance(interval * lengths, np.array(variances),
                         _degrees_of_freedom(count, lengths))


def _degrees_of_freedom(count: int, lengths: np.ndarray) -> np.ndarray:
    """Return those of overlapping variances, the fewer of white noise and of a random walk."""
    points = count + 1
    white = (1.5 * count / lengths - 2.0 * (points - 2) / points) * (
        4.0 * lengths ** 2 / (4.0 * lengths ** 2 + 5.0))
    walk = (points - 2) / lengths * ((points - 1) ** 2 - 3 * lengths * (points - 1)
                                     + 4 * lengths ** 2) / (points - 3) ** 2
    degrees: np.ndarray = np.minimum(white, walk)
    return degrees
