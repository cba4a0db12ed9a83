# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How long a keyframe is kept, and motions between frames of one keyframe."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.odometry.keyframe import Anchor, KeyframePolicy
from aick_ros.registration.result import Registration
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

KEYPOINTS = 100
VIEW = SimpleNamespace(keypoints=type('Keypoints', (), {
    'positions': np.tile([0.0, 0.0, 2.0], (KEYPOINTS, 1)), '__len__': lambda self: KEYPOINTS})())


def registration(support, deviation):
    return Registration(Status.OK, '', np.eye(4), np.eye(6) * deviation ** 2,
                        np.empty((0, 2), int), 1, support)


def kept(policy, *registrations):
    return [policy.keeps(VIEW, registration(*numbers)) for numbers in registrations]


def test_it_is_kept_while_enough_of_it_is_seen():
    policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.7}))
    assert kept(policy, (95, 0.01), (80, 0.01), (70, 0.01), (69, 0.01)) == [
        True, True, True, False]


def test_it_is_kept_while_it_is_surer_than_a_chain():
    """Of equal steps the variances add up: the third would be 3 with a chain, here it is 3.9."""
    policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.0}))
    assert kept(policy, (90, 1.0), (90, 1.4), (90, 1.7), (90, 2.1)) == [True, True, True, False]


def test_keypoints_that_are_not_tracked_are_not_missed():
    settings = with_values(Settings(), {'refinement.max_tracks': 50, 'odometry.min_overlap': 0.7})
    assert kept(KeyframePolicy(settings), (36, 0.01), (34, 0.01)) == [True, False]
    unrefined = with_values(settings, {'refinement.mode': 'none'})
    assert kept(KeyframePolicy(unrefined), (36, 0.01)) == [False]


def test_after_another_begin_the_variances_before_do_not_count():
    policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.0}))
    assert kept(policy, (90, 0.01)) == [True]
    policy.begin()
    assert kept(policy, (90, 1.0)) == [True]


def test_another_keyframe_begins_anew():
    policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.7}))
    assert kept(policy, (90, 0.01), (10, 0.01), (90, 0.05), (90, 0.06)) == [
        True, False, True, True]


def test_frame_to_frame_keeps_none():
    policy = KeyframePolicy(with_values(Settings(), {'odometry.reference': 'previous'}))
    assert kept(policy, (100, 0.01), (100, 0.01)) == [False, False]


@pytest.fixture
def poses():
    rng = np.random.default_rng(5)
    return [se3.exp(rng.normal(0, 0.3, 6)) for _ in range(2)]


def test_the_motion_between_two_frames_of_a_keyframe(poses):
    """Three views with equal noise: the keyframe's is in both registrations and cancels."""
    rng = np.random.default_rng(6)
    deviation = 1e-4
    before = Anchor(None, np.eye(4), np.zeros((6, 6)), poses[0], 2 * deviation ** 2 * np.eye(6))
    motion, covariance = before.motion_to(poses[1], 2 * deviation ** 2 * np.eye(6))
    np.testing.assert_allclose(motion, se3.inverse(poses[0]) @ poses[1], atol=1e-12)
    errors = []
    for _ in range(4000):
        common, *own = rng.normal(0, deviation, (3, 6))
        seen = [se3.perturbed(pose, noise - common) for pose, noise in zip(poses, own)]
        found = se3.inverse(seen[0]) @ seen[1]
        errors.append(np.r_[found[:3, 3] - motion[:3, 3],
                            se3.log_rotation(found[:3, :3] @ motion[:3, :3].T)])
    found = np.cov(np.array(errors).T)
    # the swing of the keyframe's turn does not cancel: within a quarter, turns are exact
    assert np.trace(covariance[3:, 3:]) == pytest.approx(np.trace(found[3:, 3:]), rel=0.1)
    assert np.trace(covariance[:3, :3]) == pytest.approx(np.trace(found[:3, :3]), rel=0.25)


def test_the_motion_from_a_keyframe_is_its_registration(poses):
    covariance = np.diag(np.arange(1.0, 7.0))
    found = Anchor(None, np.eye(4), np.zeros((6, 6))).motion_to(poses[0], covariance)
    np.testing.assert_allclose(found[0], poses[0], atol=1e-12)
    np.testing.assert_array_equal(found[1], covariance)
