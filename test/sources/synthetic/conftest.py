# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is seen in the room of seed 1."""

import numpy as np
import pytest

from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource


@pytest.fixture(scope='session')
def perfect(room):
    """Return five seconds without noise."""
    return SyntheticSource(SyntheticOptions.perfect(seed=1), room(1))


@pytest.fixture(scope='session')
def noisy(room):
    """Return the same room and path as the default sensor sees it."""
    return SyntheticSource(SyntheticOptions(seed=1), room(1))


@pytest.fixture(scope='session')
def checkers():
    """Return a chessboard of ten by eight squares."""
    squares = np.indices((8, 10)).sum(axis=0) % 2 * 200 + 20
    return np.repeat(np.kron(squares, np.ones((40, 40)))[..., None], 3, axis=2).astype(np.uint8)
