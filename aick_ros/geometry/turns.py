# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rotation of a body by its turn rates."""

from __future__ import annotations

import numpy as np

from aick_ros import kernels


def integrated_turns(stamps: np.ndarray, rates: np.ndarray, rotation: np.ndarray,
                     integral: np.ndarray, products: np.ndarray
                     ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """
    Return the rotations R at some times, and integrals up to then.

    They are those of R, and of the products ``R[i, k] * rate[l]``. Between two times the body
    turns evenly, by the mean of both rates.

    :param stamps: N int64 [ns].
    :param rates: Nx3, in the axes of the body [rad/s].
    :param rotation: at the first time, 3x3.
    :param integral: of R up to then, 3x3 [s]; products: of the products, 3x3x3 [rad].
    :returns: Nx3x3, Nx3x3 [s] and Nx3x3x3 [rad].
    """
    rotations, integrals = np.empty((2, len(stamps), 3, 3))
    all_products = np.empty((len(stamps), 3, 3, 3))
    rotations[0], integrals[0], all_products[0] = rotation, integral, products
    kernels.integrate_turns(stamps, rates, rotations, integrals, all_products)
    return rotations, integrals, all_products
