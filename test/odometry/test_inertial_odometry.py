# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A rendered camera with an IMU: small errors, rotation through darkness, a level frame."""

import dataclasses
from itertools import islice

import numpy as np
import pytest
from scipy import stats

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.odometry.base_odometry import BaseOdometry
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.keyframe import KeyframePolicy
from aick_ros.registration.preparation import Preparer
from aick_ros.registration.result import Registration
from aick_ros.registration.status import Status
from aick_ros.settings import ImuSettings, Settings
from aick_ros.sources import open_source
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS, ImuModel, SensorNoise, imu_samples

COUNT, DARK = 27, range(21, 27)
TURN_RATE = np.array([0.0, 0.0, 1.5])  # rad/s, about the world's z, once it is dark
SMALL = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
TINY = Camera(12, 10, 10.0, 10.0, 5.5, 4.5)
PERIOD, MS_10 = NANOSECONDS // 30, NANOSECONDS // 100
SEEN_SIGMAS = np.array([1e-3, 2e-3, 1.5e-3, 4e-4, 6e-4, 5e-4])  # of a registration [m, rad]


class Turning:
    """The path of a source that turns away after the last frame before the dark."""

    def __init__(self, source, start):
        self._source, self._start = source, start

    def pose(self, time):
        turned = self._source.pose(self._start + round(NANOSECONDS * time)).copy()
        turned[:3, :3] = se3.exp_rotation(
            max(time - DARK[0] / 30, 0.0) * TURN_RATE) @ turned[:3, :3]
        return turned


@pytest.fixture(scope='module')
def rendered(room):
    """Return frames and the true poses; the last frames are dark, without depth."""
    options = SyntheticOptions(seed=5, frames=COUNT, camera=SMALL, imu=IMU_MODELS['icm42688'])
    straight = SyntheticSource(options, room(5))
    source = SyntheticSource(options, room(5), Turning(straight, options.start))
    frames = [source.frame(i) for i in range(COUNT)]
    return [dataclasses.replace(frame, colour=np.zeros_like(frame.colour),
                                depth=np.full_like(frame.depth, np.nan))
            if i in DARK else frame for i, frame in enumerate(frames)], source.ground_truth.poses


def track(frames, has_imu):
    odometry = Odometry()
    return [odometry.register_frame(frame if has_imu else dataclasses.replace(frame, imu=None))
            for frame in frames]


@pytest.fixture(scope='module')
def updates(rendered):
    return {has_imu: track(rendered[0], has_imu) for has_imu in (False, True)}


def errors(updates, poses):
    """Return translation [m] and rotation [rad] of the increments, Nx6, and their NEES, N."""
    found = [(se3.difference(update.increment.pose.matrix, se3.inverse(before) @ now),
              update.increment.pose.covariance)
             for update, before, now in zip(updates[1:], poses, poses[1:]) if update.status.ok]
    return (np.array([error for error, _ in found]),
            np.array([error @ np.linalg.solve(covariance, error) for error, covariance in found]))


def test_increments_turn_by_smaller_errors_and_are_honest(rendered, updates):
    without, (with_imu, nees) = (errors(updates[has_imu], rendered[1])
                                 for has_imu in (False, True))
    sizes = [np.sqrt(np.mean(kind[:, 3:] ** 2)) for kind in (without[0], with_imu)]
    assert sizes[1] < 0.75 * sizes[0]
    # no more than noise, once in 1000; less, as the bias expected of a Kinect is not there
    assert np.mean(nees) < stats.chi2.ppf(0.999, 6 * len(nees)) / len(nees)


LIES = {'turned axes': lambda rates: rates @ se3.exp_rotation((np.pi / 2, 0, 0)).T,
        'sign': lambda rates: -rates, 'degrees': np.degrees}


@pytest.mark.parametrize('lie', LIES)
def test_a_gyroscope_that_lies_from_the_first_frame_on_costs_nothing(rendered, updates, lie):
    """Where it contradicts the images, they are no less certain, and do not follow it."""
    frames, poses = (part[:DARK[0]] for part in rendered)
    lying = track([dataclasses.replace(frame, imu=frame.imu and dataclasses.replace(
        frame.imu, turn_rates=LIES[lie](frame.imu.turn_rates))) for frame in frames], True)
    without, (found, nees) = (errors(each, poses) for each in (updates[False], lying))
    for kind in (slice(3), slice(3, 6)):
        sizes = [np.sqrt(np.mean(each[:, kind] ** 2)) for each in (found, without[0])]
        assert sizes[0] < 1.05 * sizes[1]
    assert np.mean(nees) < stats.chi2.ppf(0.999, 6 * len(nees)) / len(nees)


class Registrar:
    """Registers frames by their true poses, with noise of the camera; half is of each frame."""

    refinements = 0

    def __init__(self, pose, rng):
        self._pose, self._rng, self._noise = pose, rng, {}
        self.preparer = Preparer(Settings())

    def prepared(self, preparation, repeat=Repeat.NONE):
        frame, count = preparation.frame, 200
        return PreparedFrame(frame, KeypointFrame(
            frame.stamp, np.full((count, 3), 2.0, np.float32), np.zeros((count, 32), np.uint8),
            np.tile(np.eye(3, dtype=np.float32), (count, 1, 1)),
            np.zeros((count, 2), np.float32)), frame.grey, repeat=repeat)

    def prepared_like(self, target, source):
        return target

    def register(self, source, target, expected=None, tracked=None):
        errors = [self._noise.setdefault(frame.stamp, SEEN_SIGMAS / np.sqrt(2)
                                         * self._rng.standard_normal(6))
                  for frame in (source, target)]
        T = se3.inverse(self._pose(target.stamp)) @ self._pose(source.stamp)
        return Registration(Status.OK, '', se3.perturbed(T, errors[0] - errors[1]),
                            np.diag(SEEN_SIGMAS ** 2), np.empty((0, 2), np.intp), 1, 200,
                            tracks='some')


def shaken(rng):
    """Return a path from a stamp [ns] to a pose, of some cm and degrees at 0.5 to 1.5 Hz."""
    sizes = rng.normal(0, np.repeat([0.02, 0.04], 3), (2, 6))
    phases, rates = rng.uniform(0, 2 * np.pi, (2, 6)), rng.uniform(3, 9, (2, 6))
    return lambda stamp: se3.exp(np.sum(
        sizes * np.sin(rates * (stamp / NANOSECONDS) + phases), axis=0))


def followed(monkeypatch, seed, settings, count=45):
    """Return the errors of the increments of a camera, and their covariances, Nx6 and Nx6x6."""
    rng = np.random.default_rng(seed)
    pose = shaken(rng)
    monkeypatch.setattr('aick_ros.odometry.odometry.Registrar', lambda *_: Registrar(pose, rng))
    # every ten frames the keyframe is another one
    monkeypatch.setattr(KeyframePolicy, 'keeps', lambda self, prepared, *_: (
        round(prepared.stamp / PERIOD) % 10 != 0))
    gyroscope = SensorNoise(settings.imu.gyroscope_noise, settings.imu.gyroscope_bias_sigma,
                            np.inf, 0.0)
    ahead = round(NANOSECONDS * settings.imu.time_offset_sigma * rng.standard_normal())
    samples = imu_samples(lambda stamp: pose(stamp - ahead), 0, (count + 1) * PERIOD, ImuModel(
        gyroscope, IMU_MODELS['perfect'].accelerometer), rng)
    axes = (np.eye(3) + settings.imu.gyroscope_scale_sigma * rng.standard_normal((3, 3))
            + se3.skew(settings.imu.mounting_sigma * rng.standard_normal(3)))
    samples = dataclasses.replace(samples, turn_rates=samples.turn_rates @ axes.T)
    odometry, errors, covariances = Odometry(settings), [], []
    for stamp in range(2 * PERIOD, count * PERIOD, PERIOD):
        update = odometry.register_frame(RgbdFrame(
            stamp, rng.integers(0, 255, (10, 12), np.uint8),
            rng.uniform(1, 3, (10, 12)).astype(np.float32), TINY,
            imu=samples.until(stamp + MS_10, stamp - PERIOD + MS_10)))
        if update.increment is not None:
            truth = se3.inverse(pose(stamp - PERIOD)) @ pose(stamp)
            errors.append(se3.difference(update.increment.pose.matrix, truth))
            covariances.append(update.increment.pose.covariance)
    return np.array(errors), np.array(covariances)


@pytest.mark.parametrize('is_known, most', [(True, 1.1), (False, 2.0)], ids=['known', 'learned'])
def test_increments_err_as_their_covariances_say(monkeypatch, is_known, most):
    """
    A camera and a gyroscope with noise as the settings say: NEES of translation and rotation.

    Where its bias, time offset and axes are learned, the error of a keyframe is in all that is
    learned from it, and counts less than twice: the variances may be short of that factor.
    """
    known = dict.fromkeys(['gyroscope_bias_sigma', 'time_offset_sigma', 'gyroscope_scale_sigma',
                           'mounting_sigma'], 0.0) if is_known else {}
    settings = Settings(imu=ImuSettings(gyroscope_bias_walk=3e-6, gravity=False, **known))
    nees = []
    for seed in range(12):
        errors, covariances = followed(monkeypatch, seed, settings)
        nees += [[error[part] @ np.linalg.solve(covariance[part, part], error[part])
                  for part in (slice(3), slice(3, 6))]
                 for error, covariance in zip(errors, covariances)]
    translation, rotation = np.mean(nees, axis=0)
    low, high = stats.chi2.ppf([0.001, 0.999], 3 * len(nees)) / len(nees)
    assert low < translation < high
    # sums of samples by trapezoids have a tenth less of their noise over seven of them
    assert 0.9 * low < rotation < most * high


def test_the_gyroscope_learns_from_the_camera_alone(monkeypatch):
    """With the gyroscope's own rotation in it, a pose would confirm whatever bias is assumed."""
    covariances = []
    monkeypatch.setattr(Gyroscope, 'learn', lambda self, start, end, seen: covariances.append(
        seen.covariance))
    followed(monkeypatch, 0, Settings(imu=ImuSettings(gravity=False)), 8)
    np.testing.assert_allclose(covariances, np.tile(np.diag(SEEN_SIGMAS ** 2), (5, 1, 1)))


def test_in_the_dark_the_rotation_goes_on(rendered, updates):
    true = se3.inverse(rendered[1][0]) @ rendered[1][-1]
    ends = {has_imu: updates[has_imu][-1] for has_imu in (False, True)}
    assert all(update.status is Status.TOO_FEW_KEYPOINTS for update in ends.values())
    error = {has_imu: se3.angle(true[:3, :3].T @ updates[has_imu][0].T_odom_camera[:3, :3].T
                                @ end.T_odom_camera[:3, :3])
             for has_imu, end in ends.items()}
    assert error[False] > np.radians(5.0)
    assert error[True] < np.radians(0.2)


def test_in_the_dark_the_position_goes_on(rendered, updates):
    """By the accelerometer; at constant velocity it would stop, and not at once."""
    true = se3.inverse(rendered[1][DARK[0] - 1]) @ rendered[1][-1]
    error = {has_imu: np.linalg.norm((se3.inverse(found[DARK[0] - 1].T_odom_camera)
                                      @ found[-1].T_odom_camera)[:3, 3] - true[:3, 3])
             for has_imu, found in updates.items()}
    assert error[True] < 0.2 * error[False]


def with_wheels(rendered, spin):
    """Yield frames with wheels that roll as the camera moves, and spin by so much [m] twice."""
    frames, poses = rendered
    indices = {frame.stamp: index for index, frame in enumerate(frames)}

    def rolled(start, end):
        first, last = indices[start], indices[end]
        motion = se3.inverse(poses[first]) @ poses[last]
        motion[2, 3] += spin * sum(first < index <= last for index in DARK[:2])
        return motion

    for frame in frames:
        yield frame, rolled


def test_wheels_that_spun_in_the_dark_go_on_after_the_accelerometer(rendered):
    """By what they roll from then on; what they spun by does not become a jump."""
    settings = Settings(imu=ImuSettings(dead_reckoning_sigma=0.006))
    odometry, ends = Odometry(settings), []
    for frame, rolled in with_wheels(rendered, 0.4):
        update = odometry.register_frame(frame, predict=rolled)
        ends.append(update.T_odom_camera)
    true = se3.inverse(rendered[1][DARK[0] - 1]) @ rendered[1][-1]
    found = se3.inverse(ends[DARK[0] - 1]) @ ends[-1]
    assert update.predicted
    assert np.linalg.norm(found[:3, 3] - true[:3, 3]) < 0.01


def test_the_mounting_that_the_gyroscope_finds_is_that_of_the_accelerometer(
        rendered, monkeypatch):
    """Of an IMU that is turned by 6 deg against its transform."""
    turn, up = se3.exp_rotation(np.radians([6.0, 0.0, 0.0])), {}
    for name, mounting in (('as given', np.eye(3)), ('found', turn)):
        monkeypatch.setattr(Gyroscope, 'mounting', mounting)
        odometry = Odometry()
        for frame in rendered[0][:DARK[0]]:
            odometry.register_frame(dataclasses.replace(frame, imu=frame.imu and (
                dataclasses.replace(frame.imu,
                                    accelerations=frame.imu.accelerations @ turn))))
        up[name] = odometry.gravity.up
    true = rendered[1][DARK[0] - 1][2, :3]
    off = {name: np.degrees(np.arccos(found @ true)) for name, found in up.items()}
    assert off['as given'] - off['found'] > 2.0


def test_odom_begins_level(rendered, updates):
    first = updates[True][0]
    up = rendered[1][0][:3, :3].T @ [0, 0, 1]
    # the camera is moved by hand, at 0.4 m/s^2
    assert (first.T_odom_camera[:3, :3] @ up)[2] > np.cos(np.radians(4.0))
    assert np.array_equal(first.level_start, first.T_odom_camera)
    assert all(np.array_equal(update.level_start, first.level_start) for update in updates[True])
    assert updates[False][-1].level_start is None
    assert np.array_equal(updates[False][0].T_odom_camera, np.eye(4))


def test_after_a_reset_to_a_pose_roll_and_pitch_are_those_of_gravity(rendered):
    """The pose that was asked for stands on its head: place and yaw are kept."""
    (first, second, *_), poses = rendered
    asked = se3.from_roll_pitch_yaw(3.0, 0.0, 1.2, (5, 6, 7))
    odometry, base = Odometry(), BaseOdometry()
    base.update(odometry.register_frame(first), np.eye(4))
    odometry.reset()
    base.reset(PoseWithCovariance(asked))
    found = base.update(odometry.register_frame(second), np.eye(4)).pose
    np.testing.assert_allclose(found.translation, (5, 6, 7), atol=1e-9)
    up = poses[1][:3, :3].T @ [0, 0, 1]
    assert (found.rotation @ up)[2] > np.cos(np.radians(4.0))
    assert np.arctan2(*found.rotation[1::-1, 0]) == pytest.approx(1.2)


def test_a_level_frame_is_kept_without_a_jump(rendered, updates):
    increments = [[se3.inverse(before.T_odom_camera) @ now.T_odom_camera
                   for before, now in zip(updates[has_imu], updates[has_imu][1:DARK[0]])]
                  for has_imu in (False, True)]
    apart = [se3.angle(one[:3, :3].T @ other[:3, :3]) for one, other in zip(*increments)]
    assert max(apart) < np.radians(0.1)


@pytest.mark.parametrize('settings, given', [
    (Settings(), np.eye(4)), (Settings(imu=ImuSettings(gravity=False)), None)],
    ids=['a pose is given', 'gravity is switched off'])
def test_odom_is_not_level(rendered, settings, given):
    update = Odometry(settings, given).register_frame(rendered[0][0])
    assert update.level_start is None
    assert np.array_equal(update.T_odom_camera, np.eye(4))


def test_after_a_reset_odom_is_level_again(rendered, updates):
    frames, odometry = rendered[0], Odometry()
    odometry.register_frame(frames[0])
    odometry.reset()
    update = odometry.register_frame(frames[1])
    up = [update.T_odom_camera[:3, :3].T[:, 2], updates[True][1].T_odom_camera[:3, :3].T[:, 2]]
    assert up[0] @ up[1] > np.cos(np.radians(3.0))


def test_the_covariance_of_a_dark_frame_is_that_of_the_gyroscope(updates):
    before, dark = (np.diag(updates[True][frame].pose.covariance) for frame in (DARK[0] - 1, -1))
    assert (np.sqrt(np.maximum(dark - before, 0.0))[3:] < np.radians(0.5)).all()


def test_tilts_err_as_their_covariances_say(rendered, updates):
    """From the first frame on, that a hand's acceleration tilts."""
    frames, poses = rendered
    for frame in range(0, DARK[0], 10):
        pose = updates[True][frame].pose
        up = pose.rotation @ poses[frame][:3, :3].T @ [0, 0, 1]
        tilt = se3.rotation_between(up, np.array([0.0, 0.0, 1.0]))[:2]
        squared = tilt @ np.linalg.solve(pose.covariance[3:5, 3:5], tilt)
        assert squared < 9.2  # noise exceeds it in one of a hundred


def test_the_accelerometer_of_a_kinect_is_found_beside_its_colour_camera(tum_folder):
    """Its images are stamped when they arrive, some 20 ms late."""
    odometry, recording = Odometry(), open_source(tum_folder('freiburg1_rpy_100'))
    for frame in islice(recording.frames(), 60):
        odometry.register_frame(frame)
    estimate = odometry.gravity.estimate
    assert -0.15 < estimate.lever_arm[0] < -0.06
    assert np.abs(estimate.lever_arm[1:]).max() < 0.06
    assert -0.04 < estimate.time_offset < -0.005
