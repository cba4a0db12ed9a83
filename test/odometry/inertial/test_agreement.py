# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rotations that agree by their covariance or do not, of which the errors are known."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from aick_ros.geometry import se3
from aick_ros.odometry.inertial.agreement import Agreement

FLOOR = np.radians(0.15)
TURN = SimpleNamespace(rotation=se3.exp_rotation([0.0, np.radians(2.0), 0.0]))
NONE, WRONG = np.zeros(3), np.array([0.0, np.radians(3.0), 0.0])


def note(agreement, error, count):
    """Note a rotation several times; return whether each agrees."""
    return [agreement.note(error, 1e-8 * np.eye(3), TURN) for _ in range(count)]


def test_of_errors_by_noise_one_in_a_thousand_disagrees():
    """In any axes: by the covariance of the error and that of what it may miss."""
    root = np.random.default_rng(5).normal(0.0, 0.004, (3, 3))
    spread = np.linalg.cholesky(root @ root.T + FLOOR ** 2 * np.eye(3))
    directions = np.random.default_rng(6).normal(size=(40, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    limit = chi2.ppf(0.999, 3) ** 0.5
    for factor, agrees in ((0.97, True), (1.03, False)):
        assert {Agreement().note(factor * limit * spread @ direction, root @ root.T, TURN)
                for direction in directions} == {agrees}


def test_while_most_of_the_last_disagree_it_is_wrong_until_nearly_all_agree():
    """With a memory of eight frames: (7 / 8)^n of the share is left after n."""
    agreement = Agreement()
    assert not any(note(agreement, WRONG, 5)) and agreement.complaint == ''  # 1 - (7/8)^5 < 0.5
    note(agreement, WRONG, 1)
    assert agreement.complaint
    left = 1 - (7 / 8) ** 6
    enough = int(np.ceil(np.log(0.1 / left) / np.log(7 / 8)))
    assert all(note(agreement, NONE, enough - 1)) and agreement.complaint
    note(agreement, NONE, 1)
    assert agreement.complaint == ''


def test_while_it_is_wrong_it_is_to_be_learned_anew_once_a_second():
    agreement = Agreement()
    is_time = []
    for _ in range(5 + 90):  # it is wrong from the sixth on
        note(agreement, WRONG, 1)
        is_time.append(agreement.is_to_be_learned_anew)
    assert np.flatnonzero(is_time).tolist() == [34, 64, 94]
    note(agreement, NONE, 30)
    assert not agreement.complaint and not agreement.is_to_be_learned_anew


@pytest.mark.parametrize('error, camera', [(WRONG, 5.0), (-WRONG, 1.0)])
def test_the_complaint_names_both_turns(error, camera):
    agreement = Agreement()
    note(agreement, error, 10)
    note(agreement, NONE, 1)
    assert f'turns by 2.0 deg where the camera sees {camera:.1f} deg' in agreement.complaint


def test_the_complaint_says_what_to_check():
    agreement = Agreement()
    note(agreement, WRONG, 10)
    assert agreement.complaint == (
        'the gyroscope turns by 2.0 deg where the camera sees 5.0 deg, or about another axis: '
        'check the pose of the IMU in the camera, and that its samples are in rad/s')
