# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Solutions of positive definite equations against those of NumPy."""

import numpy as np
import pytest

from aick_ros import kernels
from aick_ros.geometry import definite


def matrix_of(size, smallest=1.0):
    """Return a symmetric matrix with eigenvalues from one up to its size, and the smallest."""
    axes, _ = np.linalg.qr(np.random.default_rng(size).normal(size=(size, size)))
    matrix = axes @ np.diag([smallest, *range(2, size + 1)]) @ axes.T
    return 0.5 * (matrix + matrix.T)


@pytest.mark.parametrize('size', [1, 2, 3, 6, 12, 64])
@pytest.mark.parametrize('shape', [(), (0,), (1,), (8,)])
def test_solutions_are_those_of_numpy(size, shape):
    matrix, sides = matrix_of(size), np.random.default_rng(1).normal(size=(size, *shape))
    given = sides.copy()
    expected = np.linalg.solve(matrix, sides)
    np.testing.assert_allclose(definite.solved(matrix, sides), expected, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(definite.solve(matrix, sides), expected, rtol=1e-11, atol=1e-12)
    np.testing.assert_array_equal(sides, given)


def test_sides_may_be_transposed():
    matrix, sides = matrix_of(6), np.random.default_rng(2).normal(size=(3, 6)).T
    np.testing.assert_allclose(definite.solved(matrix.T, sides), np.linalg.solve(matrix, sides))


def test_the_inverse_is_that_of_numpy():
    np.testing.assert_allclose(definite.inverse(matrix_of(6)), np.linalg.inv(matrix_of(6)),
                               atol=1e-14)


@pytest.mark.parametrize('smallest', [-1e-3, -1.0])
def test_what_is_not_positive_definite_is_solved_in_general(smallest):
    matrix, sides = matrix_of(6, smallest), np.ones(6)
    assert definite.solved(matrix, sides) is None
    np.testing.assert_array_equal(definite.solve(matrix, sides), np.linalg.solve(matrix, sides))


@pytest.mark.parametrize('number', [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_not_positive_definite(number):
    matrix = matrix_of(6)
    matrix[4, 4] = number
    assert definite.solved(matrix, np.ones(6)) is None


@pytest.mark.parametrize('smallest, is_definite', [(1e-3, True), (-1e-3, False), (np.nan, False)])
def test_a_matrix_is_definite_where_its_smallest_eigenvalue_is_positive(smallest, is_definite):
    assert definite.is_definite(matrix_of(6, smallest)) is is_definite


@pytest.mark.parametrize('size, first, rows', [(44, 6, 2), (7, 6, 1), (9, 0, 3), (6, 6, 2),
                                               (8, 3, 0)])
def test_eliminated_unknowns_have_the_values_that_are_best_for_the_others(size, first, rows):
    rng = np.random.default_rng(size)
    information, prior = matrix_of(size), matrix_of(first) if first else np.empty((0, 0))
    gradients = rng.normal(size=(rows, size))
    left, left_gradients = definite.eliminated(information, gradients, prior)
    with_prior = information.copy()
    with_prior[:first, :first] += prior
    np.testing.assert_allclose(left, left.T, atol=1e-12)
    for gradient, gradient_left in zip(gradients, left_gradients, strict=True):
        expected = np.linalg.solve(with_prior, gradient)[first:]
        if size > first:
            np.testing.assert_allclose(np.linalg.solve(left, gradient_left), expected, rtol=1e-8)


@pytest.mark.parametrize('number', [-1e3, np.nan, np.inf])
def test_what_is_not_definite_is_not_eliminated(number):
    information = matrix_of(8)
    information[2, 2] = number
    assert definite.eliminated(information, np.ones((1, 8)), np.eye(4)) is None


def test_too_many_unknowns_are_not_eliminated():
    with pytest.raises(ValueError, match='the unknowns are too many'):
        definite.eliminated(np.eye(65), np.ones((1, 65)), np.eye(6))


def test_variances_just_below_zero_are_rounded_to_it():
    covariance = matrix_of(6, -1e-12)
    rounded = definite.nonnegative(covariance)
    np.testing.assert_allclose(rounded, matrix_of(6, 0.0), atol=1e-11)
    assert np.linalg.eigvalsh(rounded)[0] > -1e-14
    np.testing.assert_array_equal(definite.nonnegative(matrix_of(6)), matrix_of(6))


@pytest.mark.parametrize('size, count', [(65, 1), (2, -1), (2, 1 << 40)])
def test_too_many_equations_are_refused(size, count):
    with pytest.raises(ValueError, match='too many'):
        kernels.solve_definite(np.eye(size), np.ones(size), count)


def test_the_largest_standard_deviation_is_that_along_its_own_direction():
    axes, _ = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))
    covariance = axes @ np.diag([0.04, 0.25, 0.01]) @ axes.T
    assert definite.largest_sigma(covariance) == pytest.approx(0.5)
