# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Deviations from an expected motion, with closed forms."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.unexpected_motion import (
    is_continued, is_same, sudden_accelerations, suddenness)
from aick_ros.settings import OdometrySettings

LIMITS = np.array([15.0, 30.0])


@pytest.mark.parametrize(('change', 'elapsed', 'ratio'), [
    ([0, 0, 0, 0, 0, 0], 0.1, 0.0), ([0, 0.15, 0, 0, 0, 0], 0.1, 1.0),
    ([0, 0, 0, 0.6, 0, 0], 0.1, 2.0), ([0.15, 0, 0, 0, 0, 0], 0.2, 0.25),
    ([9, 0, 0, 0, 0, 0], np.inf, 0.0)])
def test_suddenness_is_the_acceleration_by_its_limit(change, elapsed, ratio):
    expected = ExpectedPose(se3.exp([1.0, 2.0, 3.0, 0.4, 0.5, 0.6]), elapsed)
    found = expected.T_target_source @ se3.exp(change)
    assert suddenness(found, expected, LIMITS) == pytest.approx(ratio, abs=1e-12)


@pytest.mark.parametrize(('change', 'ratio'), [
    ([0.19, 0, 0, 0, 0, 0], 1.0), ([0, 0.38, 0, 0, 0, 0], 2.0), ([0, 0, 0, 0.32, 0, 0], 1.0)])
def test_errors_of_stamps_are_no_sudden_motion(change, ratio):
    """Of two standard deviations: 0.15 m and 0.3 rad may be accelerations, the rest stamps."""
    expected = ExpectedPose(np.eye(4), 0.1, timing=(0.02, 0.01))
    assert suddenness(se3.exp(change), expected, LIMITS) == pytest.approx(ratio)


@pytest.mark.parametrize(('change', 'elapsed', 'continued'), [
    ([0.04, 0, 0, 0, 0, 0], 1.0, True), ([0.06, 0, 0, 0, 0, 0], 1.0, False),
    ([0, 0, 0, 0, 0, 0.06], 1.0, False), ([0.04, 0, 0, 0, 0, 0], 0.01, False)])
def test_a_motion_is_continued_where_it_is_near_and_not_sudden(change, elapsed, continued):
    expected = ExpectedPose(se3.exp([1.0, 2.0, 3.0, 0.4, 0.5, 0.6]), elapsed)
    found = expected.T_target_source @ se3.exp(change)
    assert is_continued(found, expected, LIMITS) == continued


def test_what_is_sudden_grows_with_the_noise_of_the_motion_model():
    calm, hasty = (sudden_accelerations(OdometrySettings(
        acceleration_sigma=factor, angular_acceleration_sigma=factor)) for factor in (1.0, 2.0))
    np.testing.assert_allclose(calm, [5.0, 2.0])
    np.testing.assert_allclose(hasty, [10.0, 4.0])


@pytest.mark.parametrize(('change', 'same'), [
    ([0, 0.09, 0, 0, 0, 0], True), ([0, 0, 0, 0, 0.19, 0], True),
    ([0, 0.11, 0, 0, 0, 0], False), ([0, 0, 0, 0, 0.21, 0], False)])
def test_poses_are_the_same_within_both_tolerances(change, same):
    pose = se3.exp([1.0, 2.0, 3.0, 0.4, 0.5, 0.6])
    assert is_same(pose, pose @ se3.exp(change), (0.1, 0.2)) is same


def test_each_limit_grows_with_its_own_noise():
    limits = sudden_accelerations(OdometrySettings(
        acceleration_sigma=2.0, angular_acceleration_sigma=7.0))
    np.testing.assert_allclose(limits, [10.0, 14.0])


@pytest.mark.parametrize(('change', 'same'), [
    ([0.0149, 0, 0, 0, 0, 0], True), ([0, 0, 0.0151, 0, 0, 0], False),
    ([0, 0, 0, np.radians(0.79), 0, 0], True), ([0, 0, 0, 0, 0, np.radians(0.81)], False)])
def test_poses_are_the_same_within_the_noise_of_a_registration(change, same):
    pose = se3.exp([1.0, 2.0, 3.0, 0.4, 0.5, 0.6])
    assert is_same(pose, pose @ se3.exp(change)) is same
    assert is_same(pose @ se3.exp(change), pose) is same
