# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the kernels do to points, in NumPy."""

import numpy as np
import pytest


@pytest.fixture
def displaced():
    """Points of an image moved by twists that are linear in their rows, to the second order."""
    def displaced(displacement, points, image='depth'):
        rows = np.clip(points[:, 1] / (points[:, 2] * displacement.height), -1.0, 1.0)
        constant, *by_rows = displacement.twists
        if image == 'colour':
            constant = np.zeros(6)
        by_row = by_rows[['colour', 'depth'].index(image)]
        velocities, rates = np.hsplit(constant + rows[:, None] * by_row, 2)
        along = velocities + np.cross(rates, points)
        return points + along + 0.5 * np.cross(rates, along)
    return displaced
