# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The pose of a frame at the velocity measured last, and the velocity with a measured pose."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration.prediction import Prediction

TWIST = np.array([0.3, -0.2, 0.25, 0.5, -0.8, 0.6])  # a hand that moves fast


def test_the_velocity_goes_on_beyond_the_mean_one_that_was_measured():
    """The mean over an interval is half of it old: at its end the velocity has changed on."""
    start = se3.exp(np.array([0.1, 0.2, -0.1, 0.2, -0.1, 0.3]))
    old = TWIST + np.array([0.1, 0.0, -0.2, 0.3, 0.2, -0.1])
    prediction = Prediction(start @ se3.exp(0.04 * old), old, 0.04)
    assert prediction.twist_with(prediction.T_target_source) == pytest.approx(old)
    assert prediction.twist_with(start @ se3.exp(0.04 * TWIST)) == pytest.approx(
        TWIST + 0.25 * (TWIST - old))


@pytest.mark.parametrize('pose, twist, elapsed, is_one', [
    (np.eye(4), TWIST, 0.1, True), (None, TWIST, 0.1, False), (np.eye(4), None, 0.1, False),
    (np.eye(4), TWIST, 0.0, False), (np.eye(4), TWIST, -0.1, False),
    (np.eye(4), TWIST, np.inf, False), (np.eye(4), TWIST, np.nan, False)])
def test_without_a_velocity_or_time_there_is_no_prediction(pose, twist, elapsed, is_one):
    found = Prediction.of(pose, twist, elapsed)
    assert (found is not None) == is_one
    if found:
        assert (found.T_target_source, found.twist, found.elapsed) == (pose, twist, elapsed)
