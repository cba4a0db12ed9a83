# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The odometry of a robot without a node: what a frame, an IMU and a guess have a part in."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.depth_distortion import COLUMNS, NO_DISTORTION, ROWS, DepthDistortion
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import OdometryUpdate
from aick_ros.odometry.base_odometry import Mount
from aick_ros.odometry.inertial.level import Turn
from aick_ros.odometry.level_start import LevelWait
from aick_ros.registration.status import Status
from aick_ros.ros.input.extrinsics import Extrinsic
from aick_ros.ros.robot_odometry import RobotOdometry
from aick_ros.settings import ImuSettings, NodeSettings, Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS

TINY = Camera(160, 120, 131.25, 131.25, 79.5, 59.5)
T_BASE_CAMERA = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.1, 0.0, 0.3))
STEP = se3.exp([0.2, -0.1, 0.4, 0.3, 0.2, 0.1])


class Seen:
    """
    An odometry whose camera is where a test sets it.

    :ivar added: the samples of an IMU; ``predict``: asked for the motion of a lost camera.
    """

    def __init__(self):
        self.pose, self.status, self.added = np.eye(4), Status.OK, []
        self.misalignment = SimpleNamespace(values=np.zeros(8), description='')
        self.distortion = NO_DISTORTION
        self.gyroscope = SimpleNamespace(complaint='turns', description='a gyroscope')
        self.gravity = SimpleNamespace(complaint='falls', description='an accelerometer')
        self.plane = SimpleNamespace(complaint='')

    def register(self, preparation, predict=None, T_base_camera=None):
        self.predict, self.T_base_camera = predict, T_base_camera
        return OdometryUpdate(preparation.frame.stamp, self.status, '',
                              PoseWithCovariance(self.pose), None)

    def reset(self):
        self.pose = np.eye(4)

    def change_settings(self, settings):
        self.settings = settings


class Wheels:
    """Another odometry of the base, which a test lets be known or not; it drives at 1 m/s."""

    complaint = 'no guess'

    def __init__(self):
        self.is_known, self.asked = True, []

    def T_guess_base(self, stamp):
        return se3.exp([stamp / NANOSECONDS, 0, 0, 0, 0, 0]) if self.is_known else None

    def camera_motion(self, *arguments):
        self.asked.append(arguments)


class Robot:
    """
    A robot with a camera, and an IMU whose samples are the stamp of the frame.

    :ivar asked: parts of the input that were asked, with their arguments.
    """

    def __init__(self, guess=None, initial_pose=(), mount=Mount.FIXED):
        self.asked, self.log, self.is_imu_known = [], [], True
        self.odometry = RobotOdometry(
            NodeSettings(initial_pose=initial_pose, guess_frame_id='wheels' if guess else ''),
            Settings(), SimpleNamespace(camera_in_base=self._camera_in_base),
            SimpleNamespace(samples=self._samples, complaint='no IMU'), guess, self.log.append)
        self.mount, self.camera = mount, Seen()
        self.odometry._camera = self.camera

    def _camera_in_base(self, *arguments):
        self.asked.append(('extrinsic', *arguments))
        return Extrinsic(T_BASE_CAMERA, self.mount)

    def _samples(self, *arguments):
        self.asked.append(('imu', *arguments))
        if not self.is_imu_known:
            raise InputError('no transform of the IMU')
        return arguments[1]

    def see(self, stamp):
        return self.odometry.register(SimpleNamespace(
            frame=SimpleNamespace(stamp=stamp), add_imu=self.camera.added.append), 'optical')


def test_a_frame_moves_the_base_by_the_motion_of_the_camera():
    """By the change of axes of a rigid body."""
    robot = Robot(initial_pose=(1.0, 2.0, 3.0, 0.0, 0.0, 0.5))
    robot.see(1)
    robot.camera.pose = STEP
    found = robot.see(2)
    expected = (se3.from_roll_pitch_yaw(0.0, 0.0, 0.5, (1, 2, 3)) @ T_BASE_CAMERA @ STEP
                @ se3.inverse(T_BASE_CAMERA))
    np.testing.assert_allclose(found.T_odom_base, expected, atol=1e-12)
    np.testing.assert_allclose(found.base.pose.matrix, expected, atol=1e-12)
    np.testing.assert_array_equal(found.camera.pose.matrix, STEP)
    for extrinsic in (found.T_base_camera, robot.camera.T_base_camera):
        np.testing.assert_array_equal(extrinsic, T_BASE_CAMERA)
    assert (found.frame.stamp, found.camera_frame) == (2, 'optical')
    assert robot.camera.added == [1, 2]


def test_a_stamp_that_is_not_newer_leaves_the_base_where_it_is():
    robot = Robot()
    before = robot.see(2).T_odom_base
    robot.camera.pose, robot.camera.status = STEP, Status.BAD_STAMP
    found = robot.see(1)
    assert found.base is None
    np.testing.assert_array_equal(found.T_odom_base, before)


def test_what_is_wrong_is_said_of_the_imu_and_of_the_guess_apart():
    no_plane = Robot(Wheels())
    no_plane.camera.plane.complaint = 'no plane'
    for robot, concern in ((Robot(), ''), (Robot(Wheels()), 'no guess'),
                           (no_plane, 'no guess; no plane')):
        assert robot.odometry.complaint == 'no IMU; turns; falls'
        assert robot.odometry.concern == concern
        assert robot.odometry.findings == {
            'misalignment of the camera': 'none', 'distortion of depth images': 'none',
            'gyroscope': 'a gyroscope', 'accelerometer': 'an accelerometer'}


@pytest.mark.parametrize('mount', Mount)
def test_extrinsic_and_imu_are_those_of_the_stamp_of_the_frame(mount, monkeypatch):
    """The IMU is asked last: its pose is looked up once TF has reached the frame."""
    robot, mounts = Robot(mount=mount), []
    update = robot.odometry._base.update
    monkeypatch.setattr(robot.odometry._base, 'update', lambda *arguments: (
        mounts.append(arguments[2]) or update(*arguments)))
    robot.see(7)
    assert robot.asked == [('extrinsic', 'optical', 7), ('imu', 'optical', 7)]
    assert mounts == [mount]


def test_a_frame_without_samples_is_given_none(monkeypatch):
    robot = Robot()
    monkeypatch.setattr(robot.odometry._imu, 'samples', lambda *_: None)
    robot.see(7)
    assert robot.camera.added == []


def test_without_a_guess_nothing_is_predicted():
    robot = Robot()
    robot.see(1)
    assert robot.camera.predict is None


def test_a_guess_predicts_the_motion_of_the_camera():
    robot = Robot(wheels := Wheels())
    robot.see(1)
    robot.camera.predict(1, 2)
    assert wheels.asked == [('optical', 1, 2)]
    np.testing.assert_array_equal(robot.camera.T_base_camera, T_BASE_CAMERA)


def test_with_a_guess_it_starts_where_that_is_at_the_first_frame_that_is_tracked():
    """A robot drives through the dark, by its wheels."""
    robot = Robot(Wheels())
    for second, status in enumerate((
            Status.TOO_FEW_KEYPOINTS, Status.TOO_FEW_KEYPOINTS, Status.FIRST_FRAME, Status.OK)):
        robot.camera.status = status
        found = robot.see(second * NANOSECONDS)
        np.testing.assert_allclose(found.T_odom_base[:3, 3], [min(second, 2), 0, 0], atol=1e-9)


@pytest.mark.parametrize('missing', ['guess', 'imu'])
def test_a_frame_that_waits_at_the_start_takes_nothing_from_the_next_one(missing):
    """Neither the samples of an IMU since the start, nor the pose to start at."""
    robot = Robot(wheels := Wheels())
    wheels.is_known, robot.is_imu_known = missing != 'guess', missing != 'imu'
    with pytest.raises(InputError):
        robot.see(0)
    assert robot.camera.added == []
    assert (missing == 'guess') == (('imu', 'optical', 0) not in robot.asked)
    wheels.is_known = robot.is_imu_known = True
    found = robot.see(NANOSECONDS)
    assert robot.camera.added == [NANOSECONDS]
    np.testing.assert_allclose(found.T_odom_base[:3, 3], [1, 0, 0], atol=1e-9)


@pytest.mark.parametrize('place', [
    lambda odometry, pose: odometry.reset(pose),
    lambda odometry, pose: odometry.set_pose(pose, False)])
def test_where_it_is_placed_it_goes_on_and_no_guess_is_waited_for(place):
    robot = Robot(wheels := Wheels())
    wheels.is_known = False
    with pytest.raises(InputError, match='guess_frame_id'):
        robot.see(0)
    place(robot.odometry, PoseWithCovariance(STEP))
    np.testing.assert_allclose(robot.see(1).T_odom_base, STEP, atol=1e-9)


TURN = se3.exp([0.0, 0.0, 0.0, 0.1, -0.2, 0.0])
FIRST = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5))


class Waiting(Seen):
    """A camera whose odometry begins level, and of which a test sets what is known."""

    def __init__(self):
        super().__init__()
        self.gravity = SimpleNamespace(
            complaint='', is_held=False, tilt_sigma=1.0, hold=self._hold)
        self.turn, self.pose = np.eye(4), FIRST

    def _hold(self):
        self.gravity.is_held = True

    def register(self, *arguments, **named):
        update = super().register(*arguments, **named)
        return dataclasses.replace(update, pose=self.turn @ update.pose,
                                   level_start=self.turn @ FIRST)

    def begin_level(self, sigma):
        if not self.gravity.is_held:
            return None
        self.gravity.is_held, self.turn = False, TURN
        return Turn(TURN, np.zeros(3), np.zeros((2, 2)), np.zeros((2, 2)))

    def reset(self):
        self.pose, self.turn = FIRST, np.eye(4)


@pytest.fixture
def waiting():
    """Return a robot that publishes nothing until what is up is known, at its second frame."""
    robot = Robot()
    robot.camera = robot.odometry._camera = Waiting()
    robot.odometry._wait = LevelWait(robot.camera, ImuSettings())
    robot.camera.status = Status.FIRST_FRAME
    first = robot.see(NANOSECONDS)
    robot.camera.status = Status.OK
    return robot, first


def seen_level(robot, second=2):
    """Return the update of the frame at which what is up is known."""
    robot.camera.pose, robot.camera.gravity.tilt_sigma = FIRST @ STEP, 0.004
    return robot.see(second * NANOSECONDS)


def test_nothing_is_published_until_what_is_up_is_known(waiting):
    """Then the base is where the camera has moved since its first frame, in a level frame."""
    robot, first = waiting
    assert first.base is None
    assert 'odom is not published yet' in robot.odometry.concern
    found = seen_level(robot)
    level = TURN @ FIRST @ se3.inverse(T_BASE_CAMERA)
    level[:3, 3] = 0.0
    level[:3, :3] = se3.exp_rotation([0, 0, -np.arctan2(level[1, 0], level[0, 0])]) @ level[:3, :3]
    moved = level @ T_BASE_CAMERA @ STEP @ se3.inverse(T_BASE_CAMERA)
    np.testing.assert_allclose(found.base.pose.matrix, moved, atol=1e-9)
    np.testing.assert_allclose(found.camera.pose.matrix, TURN @ FIRST @ STEP, atol=1e-12)
    assert robot.odometry.concern == ''
    robot.camera.gravity.tilt_sigma = 1.0
    np.testing.assert_allclose(robot.see(3 * NANOSECONDS).base.pose.matrix, moved, atol=1e-9)


def test_a_pose_that_is_set_meanwhile_is_that_of_the_first_frame_published(waiting):
    robot, _ = waiting
    robot.odometry.set_pose(PoseWithCovariance(se3.exp([5, 6, 7, 0, 0, 1.0])), False)
    found = seen_level(robot).T_odom_base
    np.testing.assert_allclose(found[:3, 3], se3.exp([5, 6, 7, 0, 0, 1.0])[:3, 3], atol=1e-9)


def test_after_a_reset_it_waits_again(waiting):
    robot, _ = waiting
    assert seen_level(robot).base is not None
    robot.odometry.reset(None)
    robot.camera.gravity.tilt_sigma = 1.0
    assert robot.see(3 * NANOSECONDS).base is None
    assert seen_level(robot, 4).base is not None


def test_how_much_has_to_be_known_changes_with_the_settings(waiting):
    robot, _ = waiting
    robot.odometry.change_settings(with_values(Settings(), {'imu.level_sigma': 1.0}))
    assert robot.see(2 * NANOSECONDS).base is not None


@pytest.mark.parametrize('doubt, is_level, sigma', [
    (0.0, True, 0.09), (0.4, True, 0.4 ** 0.5), (1.0, False, 0.0)])
def test_a_bag_that_loops_while_it_waits_ends_the_wait_and_no_doubt_of_the_start(
        room, doubt, is_level, sigma):
    """What is published from then on is as uncertain, or as without an accelerometer."""
    frames = list(SyntheticSource(SyntheticOptions(
        seed=17, frames=2, rate=15, camera=TINY, imu=IMU_MODELS['icm42688']), room(17)).frames())
    frames.append(dataclasses.replace(
        frames[0], stamp=frames[0].stamp - 60 * NANOSECONDS, depth_stamp=None,
        imu=dataclasses.replace(frames[0].imu,
                                stamps=frames[0].imu.stamps - 60 * NANOSECONDS)))
    odometry = RobotOdometry(
        NodeSettings(wait_level_to_init=True), Settings(),
        SimpleNamespace(camera_in_base=lambda *_: Extrinsic(T_BASE_CAMERA, Mount.FIXED)),
        SimpleNamespace(samples=lambda *_: None, complaint=''), None, str)
    published = []
    for frame in frames:
        published.append(odometry.register(odometry.prepare(frame), 'camera'))
        odometry._camera.gravity._start_check.note(doubt, False)
    assert [update.base is None for update in published] == [True, True, False]
    last = published[-1]
    assert (last.camera.level_start is not None) == is_level
    np.testing.assert_allclose(np.sqrt(last.base.pose.covariance.diagonal()[3:5]), sigma,
                               atol=0.02)
    if not is_level:  # about where it began
        assert se3.angle(last.base.pose.rotation) < 0.05


@pytest.mark.parametrize('waits', [False, True])
def test_it_waits_where_a_setting_says_so(waits):
    odometry = RobotOdometry(NodeSettings(wait_level_to_init=waits), Settings(), None, None, None,
                             str)
    assert odometry._camera.gravity._is_held is waits


def test_what_is_found_of_the_camera_is_logged_and_reported():
    robot = Robot()
    robot.see(1)
    assert robot.log == []
    robot.camera.misalignment = SimpleNamespace(values=np.ones(8), description='rotated')
    robot.camera.distortion = DepthDistortion(np.full((ROWS, COLUMNS), 0.0031))
    robot.see(2)
    lines = sorted(robot.log)
    assert lines[0].startswith('depth images are distorted') and '3.1 mm' in lines[0]
    assert lines[1].startswith('rotated. This is corrected from now on')
    findings = robot.odometry.findings
    assert 'rotated' in findings['misalignment of the camera']
    assert '3.1 mm' in findings['distortion of depth images']


def test_the_velocity_of_the_base_may_change_as_the_settings_say():
    robot = Robot()
    for seconds in (2.0, 4.0):
        settings = with_values(Settings(), {'odometry.hold_time': seconds})
        robot.odometry.change_settings(settings)
        assert robot.camera.settings is settings
        model = robot.odometry._base._motion_model
        assert model.holds(seconds) and not model.holds(seconds + 0.1)
