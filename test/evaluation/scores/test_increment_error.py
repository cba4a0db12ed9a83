# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors of increments that are made from an error."""

import numpy as np
import pytest

from aick_ros.evaluation.scores.increment_error import (
    MAX_ROTATION_ERROR, MAX_TRANSLATION_ERROR, IncrementError)
from aick_ros.geometry import se3

TRUTH = se3.exp([0.1, -0.2, 0.3, 0.4, -0.5, 0.6])
ERROR = np.array([0.03, -0.04, 0.0, 0.0, 0.012, -0.005])


def test_translation_and_rotation_are_lengths_and_the_nees_is_by_the_covariance():
    """The error model: the true pose is the increment, perturbed."""
    sigmas = np.array([0.01, 0.02, 0.03, 0.001, 0.002, 0.004])
    error = IncrementError.of(se3.perturbed(TRUTH, ERROR), np.diag(sigmas ** 2), TRUTH)
    assert error.translation == pytest.approx(0.05)
    assert error.rotation == pytest.approx(0.013)
    assert error.nees == pytest.approx(9 + 4 + 36 + 1.5625, rel=1e-6)


def test_axes_are_those_of_the_target():
    """An error along x of the target is seen in the variance of x, however the source turned."""
    moved = se3.perturbed(TRUTH, np.array([0.02, 0, 0, 0, 0, 0]))
    certain = np.diag([1e-4, 1e6, 1e6, 1e6, 1e6, 1e6])
    assert IncrementError.of(moved, certain, TRUTH).nees == pytest.approx(4, rel=1e-6)


def test_no_covariance_has_no_nees():
    assert IncrementError.of(TRUTH, np.diag(np.full(6, np.inf)), TRUTH).nees is None


@pytest.mark.parametrize('translation, rotation, is_wrong', [
    (0.0, 0.0, False), (MAX_TRANSLATION_ERROR, MAX_ROTATION_ERROR, False),
    (np.nextafter(MAX_TRANSLATION_ERROR, 1), 0.0, True),
    (0.0, np.nextafter(MAX_ROTATION_ERROR, 1), True)])
def test_one_of_the_two_errors_is_enough_to_be_wrong(translation, rotation, is_wrong):
    assert IncrementError(translation, rotation, None).is_wrong == is_wrong
    assert (MAX_TRANSLATION_ERROR, np.degrees(MAX_ROTATION_ERROR)) == (0.05, pytest.approx(3))
