# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tests of the mean square of the change of the velocity in an increment."""

import numpy as np
import pytest

from aick_ros.frames.camera_clock import CameraClock
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.odometry.velocity_change import VelocityChange

PERIOD = 0.1
CAMERA = Camera(8, 6, 8.0, 8.0, 3.5, 2.5)
SIGMA = np.array([0.02, 0.03])  # of the noise of an increment along, and about, an axis


def view(stamp, jitter=0.0, correction=0.0):
    frame = RgbdFrame(stamp, np.zeros((6, 8, 3), np.uint8), np.ones((6, 8), np.float32), CAMERA)
    return PreparedFrame(frame, KeypointFrame.none(stamp), frame.grey, stamp_jitter=jitter,
                         clock_correction=correction)


def changes(twists, sigma=(0.0, 0.0), views=None):
    """Return the mean squares that the increments with some twists show in turn, n x 2."""
    change = VelocityChange()
    views = views or [view(round(i * PERIOD * NANOSECONDS)) for i in range(len(twists) + 1)]
    covariance = np.diag(np.square(sigma).repeat(3))
    found, before = [], twists[0]
    for twist, start, end in zip(twists, views, views[1:]):
        interval = seconds(start.stamp, end.stamp)
        increment = Increment(PoseWithCovariance(se3.exp(interval * twist), covariance), interval)
        found.append(change.squares(increment, start, end, before))
        before = increment.twist
    return np.array(found)


def walk(count, step=(0.1, 0.2), seed=1):
    """Return velocities that change by a standard deviation per axis, n x 6."""
    return np.random.default_rng(seed).normal(0, np.repeat(step, 3), (count, 6)).cumsum(0)


def test_a_constant_velocity_does_not_change():
    np.testing.assert_allclose(changes(np.tile(walk(1)[0], (5, 1))), 0.0, atol=1e-24)


def test_in_the_mean_it_is_what_the_velocity_changes_by():
    found = changes(walk(2000))
    np.testing.assert_allclose(found[30:].mean(0), [3 * 0.1 ** 2, 3 * 0.2 ** 2], rtol=0.05)


def test_half_of_it_is_what_the_last_increments_show():
    """By the square of a correlation of 0.7; the mean of many has the rest."""
    rng, count = np.random.default_rng(2), 600
    turns = rng.choice([-0.1, 0.1], (count, 6)).cumsum(0)
    steady, sudden = (changes(np.vstack([turns, turns[-1] + last * np.ones(6)]))[-1]
                      for last in (0.0, 0.3))
    np.testing.assert_allclose(steady, (1 - 0.49) * 0.03 * 29 / 30)
    np.testing.assert_allclose(
        sudden, 0.49 * 0.27 + (1 - 0.49) * (0.03 + (0.27 - 0.03) / 30))


def test_one_increment_that_changes_nothing_does_not_make_a_delay_harmless():
    found = changes(np.vstack([walk(40), walk(40)[-1:]]))
    assert (found[-1] > 0.3 * found[20:-1].mean(0)).all()


def test_noise_of_increments_is_no_change():
    """Where it is far larger, what is left is what a mean of so many values may err by."""
    rng, still = np.random.default_rng(3), np.zeros((400, 6))
    noisy = still + rng.normal(0, SIGMA.repeat(3) / np.sqrt(2) / PERIOD, still.shape)
    shown = changes(noisy)[100:].mean(0)
    found = changes(noisy, SIGMA)[100:].mean(0)
    np.testing.assert_allclose(shown, 3 * np.square(SIGMA / PERIOD), rtol=0.1)
    np.testing.assert_allclose(found, np.sqrt(2 / 90) * shown, rtol=0.3)


def at_30_hz(noise, gap=0):
    """
    Return what a swing of 2 Hz shows, n x 2, and the truth.

    :param noise: standard deviation of the velocities; covariances have half of its variance.
    :param gap: before every third increment [ns].
    """
    rng, change, found = np.random.default_rng(6), VelocityChange(), []
    twists = 0.2 * np.sin(2 * np.pi * 2.0 * np.arange(200)[:, None] / 30.0 + np.arange(6))
    for index, twist in enumerate(twists):
        begin = index * 33_333_333 + index // 3 * gap
        start, end = view(begin), view(begin + 33_333_333)
        interval = seconds(start.stamp, end.stamp)
        increment = Increment(PoseWithCovariance(
            se3.exp(interval * (twist + rng.normal(0, noise, 6))),
            0.5 * (interval * noise) ** 2 * np.eye(6)), interval)
        found.append(change.squares(increment, start, end, twist))
    true = np.square(np.diff(twists, axis=0)).mean(0).reshape(2, 3).sum(1)
    return np.array(found), true


def test_noise_that_the_covariances_lack_is_told_from_changes_by_several_increments():
    found, true = at_30_hz(0.1)
    assert (found[60:].mean(0) < 3 * true).all()
    assert (found[60:].mean(0) > 0.8 * true).all()


def test_increments_on_both_sides_of_a_gap_are_not_compared():
    """As after each loss: there are never enough in a row to tell noise from changes."""
    found, true = at_30_hz(0.1, gap=NANOSECONDS)
    assert (found[60:].mean(0) > 3 * true).all()


def test_the_change_is_found_beside_noise_of_its_size():
    rng, twists = np.random.default_rng(4), walk(2000, SIGMA / PERIOD)
    noisy = twists + rng.normal(0, SIGMA.repeat(3) / np.sqrt(2) / PERIOD, twists.shape)
    np.testing.assert_allclose(changes(noisy, SIGMA)[100:].mean(0),
                               3 * np.square(SIGMA / PERIOD), rtol=0.15)


@pytest.mark.parametrize('lock', [False, True])
def test_stamps_that_jitter_are_no_change(lock):
    """Known to jitter, and better still where a clock corrects them."""
    rng, twist, jitter, clock = np.random.default_rng(5), walk(1)[0], 0.004, CameraClock()
    stamps = np.rint(NANOSECONDS * (
        PERIOD * np.arange(300) + rng.normal(0, jitter, 300))).astype(int).tolist()
    taken = [se3.exp(PERIOD * twist)] * 299
    corrections = [clock.correct(stamp) if lock else 0.0 for stamp in stamps]
    views = [view(*each) for each in zip(stamps, [jitter] * 300, corrections)]
    change, found = VelocityChange(), []
    for motion, start, end in zip(taken, views, views[1:]):
        increment = Increment(PoseWithCovariance(motion), seconds(start.stamp, end.stamp))
        found.append(change.squares(increment, start, end, increment.twist))
    shown = 6 * (jitter / PERIOD) ** 2 * np.square(twist).reshape(2, 3).sum(1)
    assert (np.mean(found[60:], 0) < (0.04 if lock else 0.3) * shown).all()


def test_after_another_increment_it_is_since_the_velocity_given():
    """As after a loss: what was measured before it is not of the frame that it starts at."""
    change, twists = VelocityChange(), walk(3)
    for twist, start in zip(twists, (1, 5, 7)):
        begin, end = (view(round(PERIOD * each * NANOSECONDS)) for each in (start, start + 1))
        increment = Increment(PoseWithCovariance(se3.exp(PERIOD * twist)), PERIOD)
        found = change.squares(increment, begin, end, twist)
    np.testing.assert_allclose(found, 0.0, atol=1e-24)


@pytest.mark.parametrize('correction, is_used', [(-0.049, True), (-0.051, False), (-0.1, False)])
def test_stamps_that_the_clock_has_no_image_for_are_taken_as_they_are(correction, is_used):
    """One that comes between two periods is corrected to the time of the image before it."""
    twist = walk(1)[0]
    views = [view(0), view(round(PERIOD * NANOSECONDS), correction=correction)]
    found, = changes([twist], views=views)
    moved = twist * (PERIOD / (PERIOD + correction) - 1.0 if is_used else 0.0)
    np.testing.assert_allclose(  # the first one is the mean, too
        found, np.square(moved).reshape(2, 3).sum(1), rtol=1e-6, atol=1e-15)
