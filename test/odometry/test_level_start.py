# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A start that is level by what was measured meanwhile, and poses that are held back for it."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.odometry.level_start import LevelWait, begun_level
from aick_ros.settings import ImuSettings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS

TINY = Camera(160, 120, 131.25, 131.25, 79.5, 59.5)
RATE, COUNT = 15, 75
UP = np.array([0.0, 0.0, 1.0])
SEEDS = 17, 18
SECOND = NANOSECONDS


@pytest.fixture(scope='module', params=SEEDS)
def recording(request, room):
    """Return a room through which a hand carries a camera from the first frame on."""
    return SyntheticSource(SyntheticOptions(
        seed=request.param, frames=COUNT, rate=RATE, camera=TINY, imu=IMU_MODELS['bmi055']),
        room(request.param))


@pytest.fixture(scope='module')
def found(recording):
    """Return frames, and wait [s] -> updates."""
    frames, updates = list(recording.frames()), {}
    for wait in (0.0, ImuSettings.level_wait):
        odometry = Odometry()
        updates[wait] = list(begun_level(odometry, ImuSettings(level_wait=wait), (
            odometry.register_frame(frame) for frame in frames)))
    return frames, *updates.values()


def tilts(updates, truth):
    """Return roll and pitch of the odometry's frame at each update, Nx2 [rad]."""
    return np.array([se3.rotation_between(
        update.T_odom_camera[:3, :3] @ pose[:3, :3].T @ UP, UP)[:2]
        for update, pose in zip(updates, truth.poses, strict=True)])


def test_a_camera_that_is_carried_begins_level(recording, found):
    """The bias of this accelerometer alone, 70 mg, tilts by 4 deg."""
    _, as_it_began, level = found
    before, after = (np.degrees(np.linalg.norm(tilts(updates, recording.ground_truth), axis=1))
                     for updates in (as_it_began, level))
    assert before[0] > 2.0
    assert after[0] < 0.3
    assert after.max() < 0.4


def test_the_path_is_turned_about_its_start_and_is_the_same_otherwise(found):
    frames, as_it_began, level = found
    assert [update.stamp for update in level] == [frame.stamp for frame in frames]
    assert not level[0].T_odom_camera[:3, 3].any()
    np.testing.assert_allclose(level[0].level_start, level[0].T_odom_camera, atol=1e-12)
    ahead = level[0].T_odom_camera[:3, 2]  # where the camera looks is x, in the plane
    assert abs(np.arctan2(ahead[1], ahead[0])) < np.radians(5.0)
    for one, other, *motions in zip(as_it_began, level, *(
            [se3.inverse(updates[0].T_odom_camera) @ update.T_odom_camera for update in updates]
            for updates in (as_it_began, level))):
        # the one that is not held back is turned by 0.006 deg a second
        assert se3.angle(motions[0][:3, :3].T @ motions[1][:3, :3]) < np.radians(0.05)
        np.testing.assert_allclose(motions[0][:3, 3], motions[1][:3, 3], atol=2e-3)
        assert one.status is other.status


def test_tilts_err_as_their_covariances_say_and_these_are_small(recording, found):
    _, as_it_began, level = found
    for update, tilt in list(zip(level, tilts(level, recording.ground_truth)))[::10]:
        covariance = update.pose.covariance[3:5, 3:5]
        assert tilt @ np.linalg.solve(covariance, tilt) < 9.2  # noise exceeds it in one of 100
        assert np.sqrt(covariance.diagonal().max()) < np.radians(1.2)
        assert np.linalg.eigvalsh(update.pose.covariance)[0] > -1e-15
    assert np.sqrt(as_it_began[0].pose.covariance[3, 3]) > np.radians(4.0)


def test_with_an_accelerometer_that_is_wrong_it_begins_as_without_one(recording, found):
    frames = [dataclasses.replace(frame, imu=dataclasses.replace(
        frame.imu, accelerations=-frame.imu.accelerations)) for frame in found[0]]
    odometry = Odometry()
    updates = list(begun_level(odometry, ImuSettings(), map(odometry.register_frame, frames)))
    assert 'accelerometer' in odometry.gravity.complaint
    np.testing.assert_allclose(updates[0].T_odom_camera, np.eye(4), atol=1e-12)
    assert all(update.level_start is None for update in updates)
    truth = recording.ground_truth.poses
    moved = se3.inverse(truth[0]) @ truth[-1]
    assert np.linalg.norm(se3.difference(updates[-1].T_odom_camera, moved)) < 0.02
    assert np.sqrt(updates[-1].pose.covariance[3, 3]) < np.radians(1.0)


def test_after_the_wait_the_covariance_goes_on_without_a_jump(found):
    """But for what single images show badly, which is so without a wait."""
    frames, as_it_began, _ = found
    odometry, settings = Odometry(), ImuSettings(level_wait=4.0)
    early = list(begun_level(odometry, settings, (
        odometry.register_frame(frame) for frame in frames)))
    sigmas, others = (np.sqrt([np.diag(update.pose.covariance)
                               for update in updates[4 * RATE - 3:]])
                      for updates in (early, as_it_began))
    changes = np.abs(np.diff(sigmas, axis=0)) - np.abs(np.diff(others, axis=0))
    assert (changes[:, :3] < 0.002).all()  # m
    assert (changes[:, 3:] < np.radians(0.1)).all()
    assert (sigmas[:, 3:5] < np.radians(1.2)).all()


def looped(frames):
    """Return frames of a bag that begins again a minute back."""
    back = 60 * SECOND
    return frames + [dataclasses.replace(
        frame, stamp=frame.stamp - back, depth_stamp=None, imu=dataclasses.replace(
            frame.imu, stamps=frame.imu.stamps - back)) for frame in frames]


def doubted(odometry, frames, doubt):
    """Yield the updates of frames, of a start that is doubted by then after half of them."""
    for index, frame in enumerate(frames):
        update = odometry.register_frame(frame)
        if index == len(frames) // 2 - 1:
            odometry.gravity._start_check.note(doubt, False)
        yield update


@pytest.fixture
def interrupted(found):
    """Return a function from a doubt to the updates of a wait during which a bag loops."""
    def updates(doubt):
        odometry = Odometry()
        return list(begun_level(odometry, ImuSettings(), doubted(
            odometry, looped(found[0][:3]), doubt)))
    return updates


def tilt_sigmas(updates):
    """Return the standard deviation of roll at each update [deg], N."""
    return np.degrees([np.sqrt(update.pose.covariance[3, 3]) for update in updates])


def test_poses_that_are_held_while_a_bag_loops_are_as_uncertain_as_they_are_doubted(interrupted):
    certain, uncertain = interrupted(0.0), interrupted(0.4)
    assert (tilt_sigmas(certain) < 8.0).all()
    np.testing.assert_allclose(tilt_sigmas(uncertain), np.degrees(np.sqrt(0.4)), rtol=0.02)
    for one, other in zip(certain, uncertain, strict=True):
        assert one.stamp == other.stamp
        np.testing.assert_array_equal(one.T_odom_camera, other.T_odom_camera)
        np.testing.assert_array_equal(one.level_start, other.level_start)


def test_with_an_accelerometer_that_is_wrong_all_begins_as_without_one_when_a_bag_loops(
        interrupted):
    certain, without = interrupted(0.0), interrupted(1.0)
    assert all(update.level_start is None for update in without)
    np.testing.assert_allclose(without[0].T_odom_camera, np.eye(4), atol=1e-12)
    assert (tilt_sigmas(without) < 1.0).all()
    for one, other in zip(certain[:3], without):
        np.testing.assert_allclose(se3.inverse(certain[0].T_odom_camera) @ one.T_odom_camera,
                                   other.T_odom_camera, atol=1e-9)
    # where the last pose was the camera goes on
    np.testing.assert_allclose(without[3].T_odom_camera, without[2].T_odom_camera, atol=1e-9)


def test_a_reset_forgets_what_a_loop_has_ended(found):
    odometry = Odometry()
    wait = LevelWait(odometry, ImuSettings())
    for update in doubted(odometry, looped(found[0][:1]), 0.4):
        is_on = wait.goes_on(update.stamp)
    assert not is_on
    odometry.reset()
    assert odometry.begin_level(0.1) is None


class Held:
    """An odometry that has a level start at a stamp, and knows more of it at each frame."""

    def __init__(self, sigmas, start=0):
        self._sigmas, self._start = dict(enumerate(sigmas)), start
        self.asked, self._held = [], False
        self.gravity = SimpleNamespace(hold=self._hold, is_held=False, tilt_sigma=np.inf)

    def _hold(self):
        self._held = True

    def updates(self):
        for index, sigma in self._sigmas.items():
            self.gravity.tilt_sigma = sigma
            self.gravity.is_held = self._held and index >= self._start
            yield Seen(index * SECOND)

    def begin_level(self, sigma):
        if not self.gravity.is_held:
            return None
        self._held = self.gravity.is_held = False
        self.asked.append(sigma)
        return 'turn'


class Seen:
    def __init__(self, stamp, turn=None):
        self.stamp, self.turn = stamp, turn

    def turned(self, turn):
        return Seen(self.stamp, turn)


def shown(odometry, settings):
    """Return the frames that are yielded after each one that was made, and their turns."""
    rows, made = [], []

    def updates():
        for update in odometry.updates():
            made.append(update)
            yield update
    for update in begun_level(odometry, settings, updates()):
        rows.append((len(made), update.stamp // SECOND, update.turn))
    return rows


@pytest.mark.parametrize('settings, sigmas, end', [
    (ImuSettings(level_sigma=0.01), (np.inf, 0.02, 0.01, 0.005, 0.005), 3),
    (ImuSettings(level_wait=3.0), (np.inf, 0.3, 0.3, 0.3, 0.3), 4),
    (ImuSettings(), (np.inf, 0.3, 0.3), 3)],
    ids=['until enough is known', 'for the longest time', 'up to the end'])
def test_poses_are_held_back(settings, sigmas, end):
    odometry = Held(sigmas)
    assert shown(odometry, settings) == [
        (max(end, index + 1), index, 'turn' if index < end else None)
        for index in range(len(sigmas))]
    assert odometry.asked == [0.026]


def test_what_is_known_well_enough_turns_the_start():
    odometry = Held([0.05])
    shown(odometry, ImuSettings(level_sigma=0.1))
    assert odometry.asked == [0.1]


@pytest.mark.parametrize('settings, start', [(ImuSettings(level_wait=0.0), 0), (ImuSettings(), 9)],
                         ids=['none is waited for', 'the odometry is not level'])
def test_poses_are_not_held_back(settings, start):
    assert shown(Held([np.inf] * 3, start), settings) == [(1, 0, None), (2, 1, None), (3, 2, None)]


def test_frames_before_the_first_tracked_one_are_not_held_back_and_end_no_wait():
    """A camera that is covered at first: the wait begins with the level start."""
    rows = shown(Held([np.inf] * 5, start=2), ImuSettings(level_wait=2.0))
    assert rows == [(1, 0, None), (2, 1, None), (5, 2, 'turn'), (5, 3, 'turn'), (5, 4, 'turn')]


def test_it_says_what_it_waits_for():
    odometry = Held([])
    wait = LevelWait(odometry, ImuSettings())
    assert wait.complaint == ''
    odometry.gravity.is_held = True
    assert 'what is up is not known, 0.3 deg' in wait.complaint
    odometry.gravity.tilt_sigma = np.radians(2.34)
    assert 'what is up is known to 2.3 deg' in wait.complaint
    wait.configure(ImuSettings(level_sigma=float(np.radians(1.0))))
    assert '1.0 deg are waited for' in wait.complaint
