# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The velocity at the last tracked frame, by known increments."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.velocity import Velocity
from aick_ros.settings import OdometrySettings

TWIST = np.array([0.3, -0.2, 0.1, 0.4, 0.2, -0.3])
COVARIANCE = np.diag([1e-4, 2e-4, 3e-4, 1e-5, 2e-5, 3e-5])
INTERVAL = 0.2
INCREMENT = Increment(PoseWithCovariance(se3.exp(INTERVAL * TWIST), COVARIANCE), INTERVAL)
CONFIRMED = 50 * NANOSECONDS
UNSTEADINESS = np.arange(1.0, 7.0)


def test_at_first_nothing_is_known():
    assert Velocity().twist is None and not Velocity().covariance.any()
    assert Velocity().variances_after(0.1) is None


def test_keypoints_measure_and_confirm_it():
    velocity = Velocity.by_keypoints(INCREMENT, CONFIRMED, UNSTEADINESS)
    np.testing.assert_allclose(velocity.twist, TWIST, rtol=1e-9)
    np.testing.assert_allclose(INTERVAL ** 2 * velocity.covariance, COVARIANCE)
    assert velocity.confirmed == CONFIRMED
    np.testing.assert_allclose(velocity.variances_after(0.2), 0.04 * UNSTEADINESS)


@pytest.mark.parametrize('unconfirmed', [0.2, 2.0])
def test_depth_alone_measures_it_and_confirms_nothing(unconfirmed):
    model = MotionModel(OdometrySettings())
    velocity = Velocity(confirmed=CONFIRMED, unsteadiness=UNSTEADINESS).by_depth(
        INCREMENT, CONFIRMED + round(unconfirmed * NANOSECONDS), model)
    np.testing.assert_allclose(velocity.twist, model.observed_twist(INCREMENT, unconfirmed))
    np.testing.assert_allclose(INTERVAL ** 2 * velocity.covariance, COVARIANCE)
    assert velocity.confirmed == CONFIRMED and velocity.unsteadiness is UNSTEADINESS


def test_with_another_twist_it_is_as_certain_and_confirmed():
    velocity = Velocity.by_keypoints(INCREMENT, CONFIRMED, UNSTEADINESS)
    other = velocity.with_twist(None)
    assert other.twist is None and other.confirmed == CONFIRMED
    assert other.covariance is velocity.covariance
    np.testing.assert_allclose(other.variances_after(0.2), 0.04 * UNSTEADINESS)
