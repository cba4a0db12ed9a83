# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""An odometry whose parts answer as they are told, and note what they are asked."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.odometry.attempts import Attempt
from aick_ros.registration.preparation import Preparer
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.result import Evidence, Registration
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

CAMERA = Camera(12, 10, 10.0, 10.0, 5.5, 4.5)
RNG = np.random.default_rng(21)


def any_pose(scale=0.3):
    return se3.exp(scale * RNG.standard_normal(6))


def any_covariance(scale=1e-2):
    root = scale * RNG.standard_normal((6, 6))
    return root @ root.T


@dataclasses.dataclass
class Part:
    """One part of an odometry, with attributes and answers that a test sets."""

    name: str
    parts: 'Parts'

    def __getattr__(self, method):
        if method.startswith('__'):
            raise AttributeError(method)

        def ask(*args, **named):
            self.parts.log.append((self.name, method, (*args, *named.values())))
            answer = self.parts.answers.get((self.name, method))
            return answer(*args, **named) if callable(answer) else answer
        return ask


class Parts:
    """
    All parts of an odometry: each changes what passes through it in a way of its own.

    :ivar made: (name, arguments) of each part, in the order in which they were made.
    :ivar log: (name, method, arguments) of each question.
    """

    fused, corrected, levelled, held, with_terms = (any_pose() for _ in range(5))
    """What the plane, the memory, gravity, the filter and the terms of sensors do to a pose."""
    velocity, rate = np.array([0.7, -0.3, 0.2]), np.array([0.1, 0.2, -0.4])
    """What the filter and the gyroscope know of the motion."""
    expected = PoseWithCovariance(any_pose(), any_covariance())
    """The motion expected without images."""
    observed = np.array([0.01, 0.02, 0.03, 0.04, 0.05, 0.06])
    """The twist that depth alone shows."""
    unseen, changes = np.zeros(2), np.array([0.03, 0.08])
    """Squares of what the velocity may have changed by before it was measured, and since."""
    start = any_pose()
    """The level pose of the first frame."""
    time_to_rest = 0.25
    stamp_jitter = 0.0

    def __init__(self):
        self.made, self.log, self.count = [], [], 40
        self.by_wheels, self.tracked = None, None
        self.attempts = [attempt(status=Status.TOO_FEW_MATCHES)]
        self.answers = {
            ('Plane', 'fused'): lambda pose: pose @ self.fused,
            ('Plane', 'measured'): lambda pose: pose @ self.fused,
            ('KeyframeMemory', 'published'): lambda pose: self.corrected @ pose,
            ('Gravity', 'levelled'): lambda pose: self.levelled @ pose,
            ('ExpectedMotion', 'without_images'): self.expected,
            ('ExpectedMotion', 'twist_at'): lambda stamp, twist: np.r_[twist[:3], self.rate],
            ('ExpectedMotion', 'fused_increment'): lambda increment, start, end: Increment(
                increment.pose @ self.with_terms, increment.interval),
            ('MotionModel', 'time_to_rest'): self.time_to_rest,
            ('MotionModel', 'observed_twist'): self.observed,
            ('MotionModel', 'changes_unseen'): lambda increment: self.unseen,
            ('VelocityChange', 'squares'): lambda *_: self.changes,
            ('OtherOdometry', 'motion'): lambda start, end: self.by_wheels,
            ('Attempts', 'of'): lambda prepared, references, *_: [
                attempt(prepared, references) for attempt in self.attempts],
            ('Attempts', 'by_tracking'): lambda prepared, references, *_: (
                prepared, self.tracked and self.tracked(prepared, references)),
            ('Registrar', 'prepared'): lambda preparation, repeat=Repeat.NONE: self.prepared(
                preparation.frame, repeat=repeat),
            ('Registrar', 'prepared_for_tracking'): lambda preparation: self.prepared(
                preparation.frame, is_tracked=True),
            ('Registrar', 'prepared_like'): lambda target, source: target,
            ('Registrar', 'with_own_keypoints'): lambda prepared: dataclasses.replace(
                prepared, is_tracked=False),
            ('KeyframeChoice', 'advance'): lambda references, last, attempt: references.track(
                last, references.keyframe)}

    def make(self, name, *args):
        """Return a new part, with what it has as attributes."""
        self.made.append((name, args))
        part = Part(name, self)
        for key, value in {
                'Registrar': {'preparer': Preparer(Settings()), 'refinements': 0},
                'Gyroscope': {'time_offset': 0.012, 'mounting': 'the mounting found'},
                'Gravity': {'start': self.start},
                'KeyframeMemory': {'T_odom_reckoned': self.corrected},
                'Plane': {'has_base': False},
                'PositionFilter': {'T_measured_filtered': self.held, 'velocity': self.velocity},
        }.get(name, {}).items():
            setattr(part, key, value)
        return part

    def prepared(self, frame, **values):
        """Return a prepared frame with some keypoints."""
        count = self.count
        keypoints = KeypointFrame(
            frame.stamp, np.full((count, 3), 2.0, np.float32), np.zeros((count, 32), np.uint8),
            np.tile(np.eye(3, dtype=np.float32), (count, 1, 1)), np.zeros((count, 2), np.float32))
        return PreparedFrame(frame, keypoints, frame.grey, stamp_jitter=self.stamp_jitter,
                             **values)

    def asked(self, name, method):
        """Return the arguments of all questions of a kind, oldest first."""
        return [args for part, asked, args in self.log if (part, asked) == (name, method)]

    def arguments(self, name):
        """Return what the parts of a kind were made with, oldest first."""
        return [args for part, args in self.made if part == name]

    def published(self, pose):
        """Return the pose that is published for one by dead reckoning."""
        return self.levelled @ (self.corrected @ pose) @ self.held


def attempt(to='keyframe', status=Status.OK, evidence=Evidence.KEYPOINTS, reason='as told',
            found=Status.OK):
    """
    Return a function that makes an attempt to register to one of the references.

    :param status: of the attempt; ``found``: of its registration.
    """
    systematic, timing = any_covariance(), any_covariance()
    registration = Registration(
        found, reason, any_pose(0.1), any_covariance() + systematic + timing,
        np.array([[1, 2], [3, 4]]), 1, 33, evidence=evidence, systematic=systematic,
        timing=timing)
    seen = dataclasses.replace(registration, T_target_source=any_pose(0.1),
                               covariance=any_covariance() + systematic + timing)
    increment = Increment(PoseWithCovariance(any_pose(0.1), any_covariance()), 0.123)
    return lambda prepared, references: Attempt(
        getattr(references, to), seen, registration, increment, status, reason)


EXACT_SCALE = with_values(Settings(), {'sensor.depth_scale_sigma': 0.0})
"""Poses have no error of the scale of depth."""


class Steps:
    """An odometry made of such parts, with frames of one camera."""

    def __init__(self, settings=EXACT_SCALE, T_odom_camera=None, detector=None):
        self.odometry = Odometry(settings, T_odom_camera, detector)

    @staticmethod
    def frame(seconds, images=None, imu=None):
        """Return a frame at a time, with images of its own or those of another time."""
        rng = np.random.default_rng(round(1e9 * (100 + (seconds if images is None else images))))
        return RgbdFrame(
            100 * NANOSECONDS + round(seconds * NANOSECONDS),
            rng.integers(0, 255, (10, 12), np.uint8),
            rng.uniform(1, 3, (10, 12)).astype(np.float32), CAMERA, imu=imu)

    def take(self, seconds, images=None, **options):
        return self.odometry.register_frame(self.frame(seconds, images), **options)


class ExactPath:
    """Compares updates with the exact poses of a rendered camera."""

    @staticmethod
    def error(update, frames, pose):
        """Return by how much a pose since the first frame errs, in position and rotation."""
        true = se3.inverse(pose(frames[0].stamp)) @ pose(update.stamp)
        E = se3.inverse(true) @ update.T_odom_camera
        return np.linalg.norm(E[:3, 3]), se3.angle(E[:3, :3])

    @staticmethod
    def nees(updates, chosen, frames, pose):
        """Return the mean NEES of the increments of some updates, each since the frame before."""
        squares = []
        for i in chosen:
            increment = updates[i].increment
            assert increment.interval == pytest.approx(1 / 30)
            true = se3.inverse(pose(frames[i - 1].stamp)) @ pose(frames[i].stamp)
            deviation = se3.difference(increment.pose.matrix, true)
            squares.append(deviation @ np.linalg.solve(increment.pose.covariance, deviation))
        return np.mean(squares)


@pytest.fixture(scope='session')
def exact():
    """Return what compares updates with the exact path of rendered frames."""
    return ExactPath


@pytest.fixture
def calibrated(monkeypatch):
    """Let images be known to be registered, so that motions have no error of that."""
    monkeypatch.setattr(MisalignmentEstimate, 'offset_covariance', np.zeros((6, 6)))
    monkeypatch.setattr(MisalignmentEstimate, 'optics_covariance', np.zeros((3, 3)))
    monkeypatch.setattr(MisalignmentEstimate, 'readout_covariance', np.zeros((1, 1)))


@pytest.fixture
def parts(monkeypatch, calibrated):
    """Return the parts of the odometries that a test makes, of images known to be registered."""
    parts = Parts()
    for module, names in {
            'odometry': ('Registrar', 'Gyroscope', 'Accelerometer', 'OtherOdometry', 'MotionModel',
                         'ExpectedMotion', 'Attempts', 'KeyframeChoice', 'VelocityChange'),
            'path': ('Gravity', 'Plane', 'PositionFilter', 'KeyframeMemory')}.items():
        for name in names:
            monkeypatch.setattr(f'aick_ros.odometry.{module}.{name}',
                                lambda *args, name=name: parts.make(name, *args))
    return parts


@pytest.fixture
def steps(parts):
    """Return the function that makes an odometry of these parts."""
    return Steps


@pytest.fixture
def attempt_to():
    """Return the function that makes attempts, each with poses and covariances of its own."""
    return attempt
