# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rotation of a body by its turn rates."""

from __future__ import annotations

import numpy as np

from aick_ros import kernels


def integrated_turns(stamps: np.ndarray, rates: np.ndarray, rotation: np.ndarray,
                     integral: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """
    Return the rotations at some times, and the integrals of the rotation, both Nx3x3 [., s].

    Between two times the body turns evenly, by the mean of both rates.

    :param stamps: N int64 [ns].
    :param rates: Nx3, in the axes of the body [rad/s].
    :param rotation: at the first time, 3x3.
    :param integral: up to then, 3x3 [s].
    """
    rotations, integrals = np.empty((2, len(stamps), 3, 3))
    rotations[0], integrals[0] = rotation, integral
    kernels.integrate_turns(stamps, rates, rotations, integrals)
    return rotations, integrals
