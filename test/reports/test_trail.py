# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Paths, ellipsoids and times that are logged, read from the file that Rerun makes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

pytest.importorskip('rerun', reason='no viewer: pip install rerun-sdk')


@pytest.fixture
def trail(stream):
    from aick_ros.reports.trail import Trail
    return Trail(stream)


def test_times_are_since_the_first_stamp(trail, stream):
    for stamp in (5_000_000_000, 5_250_000_000, 7_000_000_000):
        trail.set_time(stamp)
        trail.add(np.zeros(3), np.eye(3), False)
    assert [time for time, _ in stream.values('world/covariance', 'centers')] == [0.0, 0.25, 2.0]


def test_each_part_of_the_path_begins_where_the_one_before_ended(trail, stream):
    position = np.array([1.0, 2.0, 3.0])
    for i in range(4):
        trail.add(position, np.eye(3), is_lost=i == 2)
        position += [1.0, 0.0, -1.0]  # in place, as a caller may
    strips = [strip for _, strip in stream.values('world/path', 'strips')]
    np.testing.assert_allclose(strips, [[[1 + i, 2, 3 - i], [2 + i, 2, 2 - i]]
                                        for i in range(3)])
    colours = [colour for _, colour in stream.values('world/path', 'colors')]
    assert colours[0] == colours[2] != colours[1]


@pytest.mark.parametrize('turn', [[0.0, 0.0, 0.0], [0.4, -0.3, 1.1], [2.0, 2.0, -1.0]])
def test_the_ellipsoid_has_the_axes_of_the_covariance(trail, stream, turn):
    """Its surface is where the squared error by the covariance is the 95 % quantile."""
    axes = Rotation.from_rotvec(turn).as_matrix()
    covariance = axes @ np.diag([1e-4, 4e-4, 25e-4]) @ axes.T
    trail.add(np.array([1.0, 2.0, 3.0]), covariance, False)
    (_, centre), = stream.values('world/covariance', 'centers')
    (_, halves), = stream.values('world/covariance', 'half_sizes')
    (_, quaternion), = stream.values('world/covariance', 'quaternions')
    assert centre == [1.0, 2.0, 3.0]
    ends = (Rotation.from_quat(quaternion).as_matrix() * halves).T
    squares = [end @ np.linalg.solve(covariance, end) for end in ends]
    np.testing.assert_allclose(squares, chi2.ppf(0.95, 3), rtol=1e-3)


def test_without_information_there_is_a_path_and_no_ellipsoid(trail, stream):
    for _ in range(2):
        trail.add(np.zeros(3), np.diag([1.0, 1.0, np.inf]), False)
    assert len(stream.values('world/path', 'strips')) == 1
    assert 'world/covariance' not in stream.entities


def test_rounding_below_zero_is_no_axis(trail, stream):
    trail.add(np.zeros(3), np.diag([-1e-20, 1.0, 1.0]), False)
    (_, halves), = stream.values('world/covariance', 'half_sizes')
    assert min(halves) == 0.0
