# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors of a sparse ground truth on a path whose interpolation has a known error."""

from pathlib import Path

import numpy as np
import pytest

from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory

FOLDER = Path(__file__).parents[2] / 'benchmarks'
ACCELERATION = 4.0


@pytest.fixture(scope='module')
def sparse_truth(load):
    return load(FOLDER / 'sparse_truth.py')


@pytest.fixture
def accelerated():
    """Return a second of a constant acceleration, at 100 Hz."""
    stamps = np.arange(101, dtype=np.int64) * NANOSECONDS // 100
    poses = np.tile(np.eye(4), (101, 1, 1))
    poses[:, 0, 3] = 0.5 * ACCELERATION * (stamps / NANOSECONDS) ** 2
    return Trajectory(stamps, poses)


def test_the_chord_of_a_parabola_errs_by_the_square_of_the_interval(sparse_truth, accelerated):
    middle = [round(0.25 * NANOSECONDS)]
    for interval in (0.02, 0.1, 0.5):
        first = next(sparse_truth.thinned(accelerated, interval))
        assert first.median_interval == pytest.approx(interval)
        [error] = sparse_truth.errors(accelerated, first, middle)
        expected = ACCELERATION * interval ** 2 / 8
        assert np.linalg.norm(error) == pytest.approx(expected, rel=1e-6)


def test_a_shifted_pose_errs_by_the_velocity(sparse_truth, accelerated):
    [error] = sparse_truth.errors(accelerated, accelerated, [round(0.5 * NANOSECONDS)], 0.01)
    assert error[0] == pytest.approx(ACCELERATION * (0.5 + 0.005) * 0.01)
    row = sparse_truth.row('desk', 'near', [error, -error])
    assert row == '| desk | near | 20.20 | 20.20 | 0.00 | 0.00 |'
