# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Wheels beside the camera: their noise, what they add to a weak view, and what slip does."""

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.odometry.expected_motion import ExpectedMotion
from aick_ros.odometry.inertial.accelerometer import Accelerometer
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.other_odometry import OtherOdometry, no_odometry
from aick_ros.registration.result import Registration
from aick_ros.registration.status import Status
from aick_ros.settings import ImuSettings, OdometrySettings

SETTINGS = OdometrySettings()
DRIVEN = se3.exp([0.3, 0.0, 0.0, 0.0, 0.0, 0.2])
STEP = NANOSECONDS // 5
TWIST = np.array([1.5, 0.0, 0.0, 0.0, 0.0, 1.0])  # that of DRIVEN in a step


@pytest.fixture
def other():
    result = OtherOdometry(SETTINGS)
    result.begin(lambda before, now: DRIVEN)
    return result


@pytest.fixture
def expected(other):
    gyroscope = Gyroscope(ImuSettings(), SETTINGS)
    accelerometer = Accelerometer(Gravity(ImuSettings()), gyroscope, ImuSettings(), SETTINGS)
    return ExpectedMotion(SETTINGS, gyroscope, other, accelerometer)


def seen(motion, sigma):
    return Increment(PoseWithCovariance(motion, sigma ** 2 * np.eye(6)), 0.2)


def test_a_motion_is_known_to_a_tenth_and_a_centimetre():
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = se3.exp_rotation([0.0, 0.4, 0.0]), (0.0, 3.0, 4.0)
    found = OtherOdometry(SETTINGS).with_slip(motion)
    np.testing.assert_array_equal(found.matrix, motion)
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), [0.51] * 3 + [0.05] * 3)


def test_it_is_at_rest_within_its_noise(other):
    assert other.is_at_rest(se3.exp([0.02, 0, 0, 0, 0.02, 0]))
    assert not other.is_at_rest(se3.exp([0.04, 0, 0, 0, 0, 0]))
    assert not other.is_at_rest(se3.exp([0, 0, 0, 0, 0.04, 0]))


def test_at_three_sigmas_it_is_at_rest(other):
    limit = 3.0 * SETTINGS.guess_sigma
    for length, is_at_rest in ((limit, True), (np.nextafter(limit, 1.0), False)):
        motion = np.eye(4)
        motion[0, 3] = length
        assert other.is_at_rest(motion) == is_at_rest


def test_before_the_first_frame_no_motion_is_known():
    assert OtherOdometry(SETTINGS).motion(0, STEP) is None


def test_other_settings_are_those_of_the_next_motion(other):
    other.configure(OdometrySettings(guess_slip=0.2, guess_sigma=0.03))
    motion = se3.exp([0.0, 2.0, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(np.sqrt(np.diag(other.with_slip(motion).covariance)),
                               [0.43] * 3 + [0.03] * 3)


def test_it_is_asked_once_per_frame_and_motion():
    asked, other = [], OtherOdometry(SETTINGS)
    for _ in range(2):
        other.begin(lambda before, now: asked.append((before, now)))
        for motion in ((1, 2), (1, 3), (1, 2)):
            assert other.motion(*motion) is None
            assert other.term(*motion) is None
    assert asked == 2 * [(1, 2), (1, 3)]


def test_what_is_no_motion_is_rejected(other):
    other.begin(lambda before, now: np.zeros((4, 4)))
    with pytest.raises(InputError, match='the predicted motion is not a pose'):
        other.motion(0, 1)


def test_motions_that_are_added_up_may_slip_alike(other):
    alone, summed = other.term(0, STEP), other.term(0, STEP, is_summed=True)
    assert np.allclose(alone.covariance, other.with_slip(DRIVEN).covariance)
    # fifteen in three seconds: their sum has the error of one that lasts three seconds
    assert np.allclose(summed.covariance, 15 * alone.covariance)
    assert np.allclose(other.term(0, 30 * STEP, is_summed=True).covariance, alone.covariance)


@pytest.mark.parametrize('twist', [None, -TWIST], ids=['unknown', 'not held'])
def test_where_the_velocity_is_not_known_the_wheels_are_expected(expected, twist):
    motion = expected.between(0, 3 * STEP, twist)
    assert np.array_equal(motion.matrix, DRIVEN)


def test_they_are_expected_together_with_the_velocity(expected):
    motion = expected.between(0, STEP, 0.9 * TWIST)
    assert 0.27 < np.linalg.norm(motion.translation) < 0.3
    alone = OtherOdometry(SETTINGS).with_slip(DRIVEN)
    assert (np.linalg.eigvalsh(alone.covariance - motion.covariance) > 0).all()


def test_a_weak_view_is_drawn_to_the_wheels_and_a_sharp_one_is_not(expected):
    off = DRIVEN @ se3.exp([0.05, 0.0, 0.0, 0.0, 0.0, 0.0])
    weak, sharp = (expected.fused_increment(seen(off, sigma), 0, STEP).pose.matrix
                   for sigma in (0.1, 0.001))
    assert np.linalg.norm(se3.difference(weak, DRIVEN)[:3]) < 0.015
    assert np.linalg.norm(se3.difference(sharp, off)[:3]) < 1e-4


def test_wheels_that_contradict_the_images_are_not_used(expected):
    standing = seen(np.eye(4), 0.002)  # while they spin
    assert expected.fused_increment(standing, 0, STEP) is standing


def registered(motion, noise, systematic=0.0, timing=0.0):
    """Return a registration with variances of noise, of a bias, and by the stamps."""
    parts = [variance * np.eye(6) for variance in (noise, systematic, timing)]
    return Registration(Status.OK, '', motion, sum(parts), np.empty((0, 2), int), 1, 100,
                        systematic=parts[1], timing=parts[2])


def test_each_part_of_the_error_of_a_registration_is_drawn_to_the_wheels(expected, other):
    """Of an error the share r^2 / (s^2 + r^2) is left, with the sigmas s and r of the two."""
    end = 15 * STEP  # no longer than wheels slip alike
    found = registered(DRIVEN, 1e-4, 4e-4, 9e-4)
    variances = np.diag(other.with_slip(DRIVEN).covariance)
    left = variances / (14e-4 + variances)
    fused = expected.fused(found, 0, end)
    np.testing.assert_allclose(fused.covariance, np.diag(left * 14e-4), atol=1e-12)
    np.testing.assert_allclose(fused.systematic, np.diag(left ** 2 * 4e-4), atol=1e-12)
    np.testing.assert_allclose(fused.timing, np.diag(left ** 2 * 9e-4), atol=1e-12)


def test_a_registration_that_wheels_contradict_stays_as_it_is(expected):
    standing = registered(np.eye(4), 4e-6)  # while they spin
    assert expected.fused(standing, 0, 15 * STEP) is standing


@pytest.fixture(scope='module')
def along_a_wall():
    """Return frames of a camera that slides along a wall by 2 cm per frame, soon in the dark."""
    rng, camera = np.random.default_rng(1), Camera(320, 240, 300.0, 300.0, 159.5, 119.5)
    wall = cv2.GaussianBlur(np.kron(rng.integers(0, 256, (30, 80), np.uint8),
                                    np.ones((8, 8), np.uint8)), (0, 0), 1.0)
    frames = []
    for index in range(18):
        seen = np.ascontiguousarray(wall[:, 4 * index:320 + 4 * index])
        noise = 1e-3 * rng.standard_normal(seen.shape)
        frames.append(RgbdFrame(
            index * STEP // 3, seen if index < 6 else np.zeros_like(seen),
            (1.5 + noise).astype(np.float32), camera))
    return frames


def test_along_a_wall_in_the_dark_the_wheels_show_what_depth_does_not(along_a_wall):
    """They measure 5 % too little; the wall shows no motion along it."""
    def wheels(before, now):
        return se3.exp([0.019 * (now - before) / (STEP // 3), 0, 0, 0, 0, 0])

    moved = {}
    for predict in (no_odometry, wheels):
        odometry = Odometry()
        updates = [odometry.register_frame(frame, predict) for frame in along_a_wall]
        assert all(update.status.ok for update in updates)
        moved[predict] = updates[-1].T_odom_camera[:3, 3]
    true = 0.02 * 17
    assert moved[no_odometry][0] < true - 0.08
    assert np.linalg.norm(moved[wheels] - [true, 0, 0]) < 0.04
