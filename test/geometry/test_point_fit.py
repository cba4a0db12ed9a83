# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rigid transforms of matched points against exact motions and a general solver."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from aick_ros.geometry import point_fit, se3


def random_pose(rng):
    return se3.exp(rng.normal(0, 1, 6))


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def fit_moments(source, target):
    """Fit through the moments of homogeneous points."""
    source, target = (point_fit.homogeneous(np.asarray(points, float))
                      for points in (source, target))
    return point_fit.fit_moments(source.T @ target)


fits = pytest.mark.parametrize('fit', [point_fit.fit, fit_moments])


@fits
def test_fit_recovers_an_exact_motion(rng, fit):
    for _ in range(20):
        T, source = random_pose(rng), rng.normal(0, 1, (rng.integers(3, 40), 3))
        np.testing.assert_allclose(fit(source, se3.transform(T, source)), T, atol=1e-9)


@fits
def test_fit_is_the_least_squares_solution(rng, fit):
    T, source = random_pose(rng), rng.normal(0, 1, (30, 3))
    target = se3.transform(T, source) + rng.normal(0, 0.1, source.shape)

    def residuals(x):
        moved = source @ Rotation.from_rotvec(x[3:]).as_matrix().T + x[:3]
        return (moved - target).ravel()

    best = least_squares(residuals, np.r_[T[:3, 3], se3.log_rotation(T[:3, :3])])
    found = fit(source, target)
    moved = se3.transform(found, source)
    assert np.sum((moved - target) ** 2) == pytest.approx(2 * best.cost, rel=1e-6)


@fits
def test_fit_never_reflects(rng, fit):
    """Of points and their mirror image: the best rotation, not the reflection."""
    for _ in range(50):
        source = rng.normal(0, 1, (10, 3))
        T = fit(source, source * (-1, 1, 1))
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)


@fits
def test_fit_of_points_that_have_nothing_in_common_is_a_rotation(rng, fit):
    for _ in range(100):
        rotation = fit(rng.normal(0, 1, (4, 3)), rng.normal(0, 1, (4, 3)))[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
        assert np.linalg.det(rotation) > 0


@fits
def test_fit_of_coplanar_points(rng, fit):
    for noise in (0.0, 1e-3):
        source = np.c_[rng.normal(0, 1, (20, 2)), np.zeros(20)]
        T = random_pose(rng)
        found = fit(source, se3.transform(T, source) + rng.normal(0, noise, (20, 3)))
        assert np.linalg.det(found[:3, :3]) == pytest.approx(1.0)
        np.testing.assert_allclose(found, T, atol=1e-9 + 3 * noise)


@fits
@pytest.mark.parametrize('points', [
    np.zeros((0, 3)), np.zeros((2, 3)), np.full((10, 3), 1.7),
    np.outer(np.arange(10.0), (1, 2, 3)) + 5, [[0, 0, 0], [1, 1, 1], [2, 2, 2]]],
    ids=['none', 'two', 'one point', 'line', 'three on a line'])
def test_points_that_do_not_determine_a_rotation_are_rejected(points, fit):
    for dtype in (np.float32, np.float64):
        points = np.asarray(points, dtype)
        with pytest.raises(point_fit.DegenerateGeometryError, match='point'):
            fit(points, points)


@fits
def test_three_points_are_enough(rng, fit):
    T, source = random_pose(rng), rng.normal(0, 1, (3, 3))
    np.testing.assert_allclose(fit(source, se3.transform(T, source)), T, atol=1e-9)


@fits
@pytest.mark.parametrize('count', [0, 1, 2])
def test_fewer_are_counted_in_the_sentence(rng, fit, count):
    points = rng.normal(0, 1, (count, 3))
    with pytest.raises(point_fit.DegenerateGeometryError) as raised:
        fit(points, points)
    assert str(raised.value) == f'{count} matched points: at least 3 are required'


@fits
@pytest.mark.parametrize('width, is_line', [(1.05e-3, False), (0.95e-3, True)])
def test_a_line_is_less_than_a_thousandth_as_wide_as_long(fit, width, is_line):
    """Singular values are sums of squares: those of an ellipse of points, 1 and width^2."""
    angles = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    points = np.column_stack([np.cos(angles), width * np.sin(angles), np.zeros(40)])
    if is_line:
        with pytest.raises(point_fit.DegenerateGeometryError, match=(
                '^40 matched points are collinear or coincide$')):
            fit(points, points)
    else:
        np.testing.assert_allclose(fit(points, points), np.eye(4), atol=1e-9)


def test_points_far_from_the_origin_that_coincide_are_rejected_by_their_moments(rng):
    """What is left of their squares is rounding."""
    with pytest.raises(point_fit.DegenerateGeometryError, match='coincide'):
        fit_moments(*2 * [np.full((100, 3), 1000.1) + rng.normal(0, 1e-9, (100, 3))])


def test_moments_are_the_sums_of_the_products_of_matched_points(rng):
    source, target = (rng.normal(0, 1, (count, 3)).astype(np.float32) for count in (20, 30))
    matches = np.column_stack([rng.integers(0, 20, 50), rng.integers(0, 30, 50)])
    a, b = (np.column_stack([points[rows].astype(float), np.ones(50)])
            for points, rows in zip((source, target), matches.T))
    found = point_fit.moments(source, target, matches)
    np.testing.assert_allclose(found, a.T @ b, rtol=1e-12)
    assert not point_fit.moments(source, target, matches[:0]).any()


@pytest.mark.parametrize('match', [(-1, 0), (20, 0), (0, -1), (0, 30)], ids=str)
def test_matches_beyond_the_points_are_rejected(match):
    points = np.zeros((20, 3), np.float32), np.zeros((30, 3), np.float32)
    with pytest.raises(ValueError, match='^a row of a match is not one of the points$'):
        point_fit.moments(*points, np.array([(0, 0), match]))


def test_homogeneous_points_keep_their_type(rng):
    points = rng.normal(0, 1, (5, 3)).astype(np.float32)
    found = point_fit.homogeneous(points)
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, np.c_[points, np.ones(5)])


def test_points_farther_from_the_origin_than_from_each_other_are_fit_by_their_moments(rng):
    """A spread of a centimetre at a kilometre is a thousand times the rounding of the moments."""
    source = np.array([600.0, -500.0, 620.0]) + rng.normal(0, 0.01, (100, 3))
    T = se3.exp((0.3, -0.2, 0.1, 0.02, -0.01, 0.03))
    target = se3.transform(T, source)
    found = fit_moments(source, target)
    np.testing.assert_allclose(found[:3, :3], T[:3, :3], atol=1e-3)
    np.testing.assert_allclose(se3.transform(found, source), target, atol=1e-4)
