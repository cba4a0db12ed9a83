# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The pose expected of a frame, by known motions."""

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.registration.expected_pose import ExpectedPose

POSE, STEADY = se3.exp([0.3, -0.1, 0.2, 0.2, 0.1, -0.1]), se3.exp([0.2, 0, 0.1, 0.1, 0, 0.1])
MOVED = se3.exp([1.0, 2.0, 3.0, 0.3, -0.2, 0.5])


@pytest.mark.parametrize('steady', [None, STEADY])
def test_at_constant_velocity_it_is_the_same_unless_other_sensors_have_a_part(steady):
    expected = ExpectedPose(POSE, 0.1, steady)
    assert expected.at_constant_velocity is (POSE if steady is None else steady)


@pytest.mark.parametrize('steady', [None, STEADY])
def test_seen_from_another_frame_it_is_the_same_camera(steady):
    seen = ExpectedPose(POSE, 0.1, steady, (0.01, 0.02)).seen_from(MOVED)
    np.testing.assert_allclose(seen.T_target_source, MOVED @ POSE, atol=1e-12)
    np.testing.assert_allclose(seen.at_constant_velocity,
                               MOVED @ (POSE if steady is None else STEADY), atol=1e-12)
    assert (seen.elapsed, seen.timing) == (0.1, (0.01, 0.02))
    assert (seen.steady is None) == (steady is None)


def test_errors_of_rounding_do_not_grow_along_expected_poses():
    drifted = POSE.copy()
    drifted[:3, :3] *= 1.0 + 1e-6
    rotation = ExpectedPose(drifted).seen_from(MOVED).T_target_source[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)


def test_the_change_is_the_motion_beyond_the_one_expected():
    change = se3.exp([0.01, 0.02, 0, 0, 0.1, 0])
    np.testing.assert_allclose(ExpectedPose(POSE).change_to(POSE @ change), change, atol=1e-12)


@pytest.mark.parametrize('twist, elapsed, is_known', [
    (np.ones(6), 0.2, True), (None, 0.2, False), (np.ones(6), np.inf, False)])
def test_a_velocity_is_predicted_where_it_is_known(twist, elapsed, is_known):
    prediction = ExpectedPose(POSE, elapsed).prediction(twist)
    assert (prediction is not None) == is_known
    if is_known:
        assert prediction.T_target_source is POSE and prediction.twist is twist
        assert prediction.elapsed == elapsed


@pytest.mark.parametrize('given, reason', [
    ((2 * np.eye(4),), 'the pose expected'), ((POSE, 0.1, 2 * np.eye(4)), 'at constant velocity'),
    ((POSE, 0.1, None, (0.1,)), 'the errors of stamps'),
    ((POSE, 0.1, None, (0.1, -0.2)), 'are 0.1 m and -0.2 rad: they must not be negative'),
    ((POSE, 0.9e-9), 'elapsed is 9e-10 s: it must be 1 ns at least'), ((POSE, '1'), 'elapsed')])
def test_what_is_no_pose_or_no_time_is_rejected(given, reason):
    with pytest.raises(InputError, match=reason):
        ExpectedPose(*given).checked()


@pytest.mark.parametrize('elapsed, checked', [(0.1, 0.1), (1e-9, 1e-9), (1e300, np.inf)])
def test_what_is_checked_has_floats_and_no_time_beyond_all_stamps(elapsed, checked):
    expected = ExpectedPose(np.eye(4, dtype=int).tolist(), elapsed, STEADY).checked()
    assert expected.T_target_source.dtype == np.float64 and expected.elapsed == checked
    np.testing.assert_array_equal(expected.steady, STEADY)
