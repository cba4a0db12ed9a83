# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Replacement of a keyframe, by given variances and numbers of matches."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.odometry.keyframe import KeyframePolicy, scene_variance
from aick_ros.registration.result import Registration
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

KEYPOINTS = 100
VIEW = SimpleNamespace(keypoints=range(KEYPOINTS), scene_depth=2.0)


def registration(support, deviation, timing=0.0):
    """Return a registration with standard deviations of the images' poses and of the stamps."""
    timing = np.eye(6) * timing ** 2
    return Registration(Status.OK, '', np.eye(4), np.eye(6) * deviation ** 2 + timing,
                        np.empty((0, 2), int), 1, support, timing=timing)


def kept(policy, *registrations):
    return [policy.advance(VIEW, registration(*numbers), len(VIEW.keypoints))
            for numbers in registrations]


def test_it_is_kept_while_enough_of_it_is_matched():
    policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.7}))
    assert kept(policy, (95, 0.01), (80, 0.01), (70, 0.01), (69, 0.01)) == [
        True, True, True, False]


def with_variance(variance):
    return dataclasses.replace(registration(90, 0.0), covariance=variance * np.eye(6))


def test_of_what_objects_hide_another_keyframe_would_not_have_more():
    """Of the half that is left of the scene, half of seven tenths; not one keypoint less."""
    policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.7}))
    assert [policy.advance(VIEW, registration(*numbers), KEYPOINTS, lost)
            for *numbers, lost in ((95, 0.01, 0), (18, 0.01, 50), (17, 0.01, 50), (18, 0.01, 0))
            ] == [True, True, False, False]
    assert not policy.keeps(VIEW, registration(0, 0.01), KEYPOINTS, KEYPOINTS)
    # of fewer keypoints noise is larger in any keyframe: the variance, by their share
    ratio = np.sqrt(2.0 / 0.5)
    assert [policy.keeps(VIEW, registration(95, factor * 0.01 * ratio), KEYPOINTS, 50)
            for factor in (0.99, 1.01)] == [True, False]


def test_it_is_kept_while_its_variance_is_below_that_of_a_chain():
    """Of equal steps the variances add up: the fourth would be 4 with a chain, here it is 4.4."""
    policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.0}))
    assert kept(policy, (90, 1.0), (90, 1.4), (90, 1.7), (90, 2.1)) == [True, True, True, False]


def test_at_the_variance_of_a_chain_it_is_kept():
    """Whole numbers, and the next larger one."""
    for third, is_kept in ((3.0, True), (np.nextafter(3.0, 4.0), False)):
        policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.0}))
        assert [policy.advance(VIEW, with_variance(variance), KEYPOINTS)
                for variance in (1.0, 2.0, third)] == [True, True, is_kept]


def test_it_is_kept_while_its_variance_by_noise_is_twice_that_of_the_first_frame():
    """Whatever its biases, by which the variance is far above that of a chain."""
    bias = 30.0 * np.eye(6)
    for noise, is_kept in ((2.0, True), (2.0 + 1e-9, False)):
        policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.0}))
        biased = dataclasses.replace(with_variance(30.0 + noise), systematic=bias)
        assert kept(policy, (90, 1.0)) == [True]
        assert policy.keeps(VIEW, biased, KEYPOINTS) == is_kept


def tracking(**values):
    return KeyframePolicy(with_values(Settings(), {
        'odometry.min_overlap': 0.0, 'odometry.aick_interval': 10, **values}))


def test_while_keypoints_are_tracked_from_it_the_variance_grows_to_three_times_the_first():
    """By steps of any size, unlike a chain: whole numbers, and the next larger one."""
    for before, last, is_kept in ((1.5, 3.0, True), (2.9, np.nextafter(3.0, 4.0), False)):
        policy = tracking()
        assert [policy.advance(VIEW, with_variance(variance), KEYPOINTS)
                for variance in (1.0, before, last)] == [True, True, is_kept]


def test_while_keypoints_are_tracked_from_it_enough_of_them_are_needed_too():
    policy = tracking(**{'odometry.min_overlap': 0.55})
    assert kept(policy, (95, 0.01), (56, 0.01), (54, 0.01)) == [True, True, False]


@pytest.mark.parametrize('part', ['systematic', 'unusual', 'timing'])
def test_biases_and_errors_of_stamps_are_not_less_with_another_keyframe(part):
    policy, bias = tracking(), 30.0 * np.eye(6)
    biased = dataclasses.replace(registration(90, 1.0), covariance=np.eye(6) + bias,
                                 **{part: bias})
    assert kept(policy, (90, 1.0)) == [True]
    assert policy.keeps(VIEW, biased, KEYPOINTS)


def served(policy, overlaps):
    """Return whether depth images serve on, by pairs of their stamp and a frame's overlap."""
    return [policy.keeps_depth_reference(
        stamp, dataclasses.replace(registration(0, 0.01), overlap=overlap))
            for stamp, overlap in overlaps]


@pytest.mark.parametrize(('overlaps', 'expected'), [
    ((0.8,), [True]), ((float(np.nextafter(0.8, 0.0)),), [False]),
    ((0.9, 0.8551, 0.8549), [True, True, False]), ((0.82, 0.801, 0.799), [True, True, False])])
@pytest.mark.parametrize('stamp', [7, 0])
def test_a_depth_image_serves_while_enough_of_it_is_seen(overlaps, expected, stamp):
    """Beside what the first frame saw of it, as noise leaves less of any view; or of all."""
    policy = KeyframePolicy(Settings())
    assert served(policy, [(stamp, overlap) for overlap in overlaps]) == expected


def test_what_is_enough_is_measured_anew_for_each_depth_image():
    policy = KeyframePolicy(Settings())
    assert served(policy, [(1, 0.95), (1, 0.9), (2, 0.85), (2, 0.81)]) == [
        True, False, True, True]
    policy.begin()
    assert served(policy, [(2, 0.95), (2, 0.85)]) == [True, False]


def test_errors_of_stamps_do_not_count():
    """Frames registered while the camera is fast, whatever their keyframe."""
    policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.0}))
    assert kept(policy, (90, 1.0, 0.1), (90, 1.4, 30.0)) == [True, True]


def test_keypoints_beyond_max_tracks_are_not_counted_as_missing():
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
    assert kept(policy, (90, 0.01), (10, 0.01)) == [True, False]
    policy.begin()
    assert kept(policy, (90, 0.05), (90, 0.06)) == [True, True]


def test_a_frame_that_may_not_be_a_keyframe_changes_nothing():
    """As one that is blurred: the next one is judged beside the first, and the one before."""
    policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.7}))
    assert kept(policy, (90, 0.01), (10, 0.05), (90, 0.05), (90, 0.011)) == [
        True, False, False, True]


def test_what_is_asked_beforehand_changes_nothing():
    """A frame that is looked at twice is one step of the chain, and not the next two."""
    policy = KeyframePolicy(with_values(Settings(), {'odometry.min_overlap': 0.7}))
    assert kept(policy, (90, 1.0)) == [True]
    for support, deviation, is_kept in ((90, 1.4, True), (90, 1.5, False), (10, 1.0, False)):
        asked = [policy.keeps(VIEW, registration(support, deviation), KEYPOINTS) for _ in '123']
        assert asked == 3 * [is_kept]
    assert kept(policy, (90, 1.4), (90, 1.7)) == [True, True]


def test_frame_to_frame_keeps_none():
    policy = KeyframePolicy(with_values(Settings(), {'odometry.reference': 'previous'}))
    assert kept(policy, (100, 0.01), (100, 0.01)) == [False, False]


@pytest.mark.parametrize('sigmas', [(0.002, 0.001), (0.0, 0.004), (0.003, 0.0)])
def test_the_variance_is_that_of_a_sampled_point_at_the_median_depth(sigmas):
    """Monte Carlo: a point 2 m away on each axis in turn, so that each rotation has a lever."""
    rng = np.random.default_rng(7)
    covariance = np.diag(np.repeat(sigmas, 3) ** 2)
    variances = []
    for point in 2.0 * np.eye(3):
        noise = rng.normal(0.0, np.repeat(sigmas, 3), (20000, 6))
        moved = np.array([se3.exp_rotation(n[3:]) @ point + n[:3] for n in noise])
        variances.append(moved.var(axis=0).sum())
    # a point has no lever about its own axis: of three points each rotation moves two
    by_translation = 3 * sigmas[0] ** 2
    by_rotation = 1.5 * (np.mean(variances) - by_translation)
    assert scene_variance(VIEW, covariance) == pytest.approx(
        by_translation + by_rotation, rel=0.05)
