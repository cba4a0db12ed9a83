# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A correction reaches the estimate without a jump."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.odometry.pose_correction import PoseCorrection
from aick_ros.settings import OdometrySettings

SETTINGS = OdometrySettings()
FRAMES = 400
INTERVAL = 1 / 30  # s


@pytest.fixture
def walk():
    """Return poses by dead reckoning, metres from the origin, where rotations have a lever."""
    rng = np.random.default_rng(2)
    poses = [se3.exp([3.0, -2.0, 1.0, 0.3, 0.5, -0.2])]
    for _ in range(FRAMES):
        poses.append(poses[-1] @ se3.exp(rng.normal(0, 0.01, 6)))
    return poses


def corrected(walk, drift, settings=SETTINGS):
    """Return the published poses where the estimate is off by ``drift``, and the errors left."""
    correction = PoseCorrection(settings)
    published, errors = [], []
    for reckoned in walk:
        errors.append(correction.approach(drift @ reckoned, reckoned, INTERVAL))
        published.append(correction.T_odom_reckoned @ reckoned)
    return published, errors


@pytest.mark.parametrize('drift', [[0.05, 0, 0.02, 0, 0, 0], [0, 0, 0, 0.01, -0.02, 0],
                                   [0.3, -0.1, 0, 0.05, 0.02, 0.01]])
def test_no_frame_is_moved_by_more_than_the_largest_step(walk, drift):
    published, _ = corrected(walk, se3.exp(drift))
    for i in range(FRAMES):
        measured = se3.inverse(walk[i]) @ walk[i + 1]
        step = se3.difference(published[i + 1], published[i] @ measured)
        assert np.linalg.norm(step[:3]) <= SETTINGS.correction_step * (1 + 1e-9)
        assert np.linalg.norm(step[3:]) <= SETTINGS.correction_turn * (1 + 1e-9)


def test_the_estimate_is_reached_and_the_error_is_what_is_left(walk):
    drift = se3.exp([0.05, 0.0, 0.02, 0.01, 0.0, -0.01])
    published, errors = corrected(walk, drift)
    for pose, reckoned, error in zip(published, walk, errors):
        np.testing.assert_allclose(se3.difference(drift @ reckoned, pose), error, atol=1e-4)
    np.testing.assert_allclose(published[-1], drift @ walk[-1], atol=1e-4)


def test_a_small_correction_takes_a_sixtieth_of_what_is_left_each_frame(walk):
    errors = np.array(corrected(walk[:50], se3.exp([1e-4, 0, 2e-4, 0, 0, 0]))[1])
    left = np.linalg.norm(errors, axis=1)
    np.testing.assert_allclose(left[1:] / left[:-1], 59 / 60, rtol=1e-4)


@pytest.mark.parametrize('interval, share', [(0.2, 0.1), (2.0, 1.0), (60.0, 1.0)])
def test_where_frames_come_slowly_each_takes_as_much_as_its_time_allows(interval, share):
    correction = PoseCorrection(SETTINGS)
    left = correction.approach(se3.exp([1e-4, 0, 0, 0, 0, 0]), np.eye(4), interval)
    assert left[0] == pytest.approx((1.0 - share) * 1e-4)


def test_other_settings_hold_from_the_next_frame_on(walk):
    correction = PoseCorrection(SETTINGS)
    correction.configure(OdometrySettings(correction_step=2e-4, correction_turn=1.0))
    left = correction.approach(se3.exp([1.0, 0, 0, 0, 0, 0]) @ walk[0], walk[0], INTERVAL)
    assert left[0] == pytest.approx(1.0 - 2e-4)


def test_without_an_error_the_pose_is_that_of_dead_reckoning(walk):
    published, errors = corrected(walk, np.eye(4))
    np.testing.assert_array_equal(published, walk)
    assert not np.any(errors)


@pytest.mark.parametrize('drift, part, largest', [
    ([0.3, 0, 0.4, 0, 0, 0], slice(3), {'correction_step': 1e-3, 'correction_turn': 1.0}),
    ([0, 0, 0, 0, 0.3, 0.4], slice(3, 6), {'correction_step': 1.0, 'correction_turn': 1e-3})])
def test_a_large_correction_takes_the_largest_step_each_frame(walk, drift, part, largest):
    """Half a metre, or half a radian, is 500 steps of 1e-3."""
    errors = np.array(corrected(walk[:50], se3.exp(drift), OdometrySettings(**largest))[1])
    left = np.linalg.norm(errors[:, part], axis=1)
    np.testing.assert_allclose(left, 0.5 - 1e-3 * np.arange(1, 51), rtol=1e-6)
