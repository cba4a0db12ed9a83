# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Accelerations that frames show, by registrations with known errors."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import RESTART_AFTER
from aick_ros.registration.apparent_acceleration import ApparentAcceleration
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.status import Status
from aick_ros.settings import OdometrySettings

SETTINGS = OdometrySettings()
SIGMAS = np.repeat([SETTINGS.acceleration_sigma, SETTINGS.angular_acceleration_sigma], 3)
EXPECTED = se3.exp([0.1, 0.0, 0.0, 0.0, 0.0, 0.1])
ERROR = np.array([0.03, 0.02, 0.01, 0.03, 0.02, 0.01])
SECOND = 10 ** 9
FIRST = 5 * SECOND
LATER = 2 * RESTART_AFTER


@pytest.fixture
def acceleration():
    return ApparentAcceleration(SETTINGS)


def found(made, error=ERROR, **values):
    return dataclasses.replace(made.registration(**values),
                               T_target_source=se3.perturbed(EXPECTED, error))


WANTED = ExpectedPose(EXPECTED, 0.4)


def expected_sigmas(elapsed, shown=np.zeros(6)):
    return 0.5 * elapsed ** 2 * np.hypot(SIGMAS, shown)


def test_at_first_it_is_that_of_the_motion_model(acceleration):
    np.testing.assert_allclose(acceleration.sigmas(FIRST, WANTED), expected_sigmas(0.4))


def test_errors_of_stamps_make_the_motion_expected_less_certain(acceleration):
    sigmas = acceleration.sigmas(FIRST, ExpectedPose(EXPECTED, 0.4, timing=(0.3, 2.0)))
    np.testing.assert_allclose(
        sigmas ** 2, expected_sigmas(0.4) ** 2 + np.repeat([0.3, 2.0], 3) ** 2)


def test_what_a_frame_has_shown_makes_the_next_one_as_uncertain(acceleration, made):
    """However often that is registered: what it shows itself does not count."""
    acceleration.note(FIRST, found(made), ExpectedPose(EXPECTED, 0.3))
    shown = 2 * ERROR / 0.3 ** 2
    for _ in range(3):
        np.testing.assert_allclose(acceleration.sigmas(FIRST + SECOND // 10, WANTED),
                                   expected_sigmas(0.4, shown), rtol=1e-6)
        acceleration.note(FIRST + SECOND // 10, found(made, 2 * ERROR),
                          ExpectedPose(EXPECTED, 0.4))
    np.testing.assert_allclose(acceleration.sigmas(FIRST + SECOND // 5, WANTED),
                               expected_sigmas(0.4, 4 * ERROR / 0.4 ** 2), rtol=1e-6)


@pytest.mark.parametrize('since', [-SECOND, LATER])
def test_a_frame_long_before_or_of_another_recording_says_nothing(acceleration, made, since):
    acceleration.note(FIRST, found(made), ExpectedPose(EXPECTED, 0.3))
    np.testing.assert_allclose(acceleration.sigmas(FIRST + since, WANTED), expected_sigmas(0.4))


@pytest.mark.parametrize('values, elapsed', [({'status': Status.TOO_FEW_MATCHES}, 0.3), ({}, 0.0)],
                         ids=['failed', 'at the same time'])
def test_what_shows_no_motion_is_not_noted(acceleration, made, values, elapsed):
    acceleration.note(FIRST, found(made, **values), ExpectedPose(EXPECTED, elapsed))
    np.testing.assert_allclose(acceleration.sigmas(FIRST + 1, WANTED), expected_sigmas(0.4))
