# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The order in which a frame is registered to its references, by made-up registrations."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.repetition import Repeat
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.attempts import Attempts
from aick_ros.odometry.expected_motion import ExpectedMotion
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.other_odometry import OtherOdometry
from aick_ros.odometry.reference import Reference, References
from aick_ros.registration.result import Evidence, Registration
from aick_ros.registration.status import Status
from aick_ros.settings import Settings

FOUND = Registration(Status.OK, '', np.eye(4), 1e-6 * np.eye(6), np.empty((0, 2), np.intp), 1,
                     support=100)


@dataclasses.dataclass(frozen=True)
class View:
    stamp: int
    sharpness: int = 1
    repeat: Repeat = Repeat.NONE
    surface: str = 'a room'
    twist: np.ndarray | None = None
    grey: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((3, 4)))

    def is_blurred_beside(self, other):
        return self.sharpness < other.sharpness


class Registrar:
    """Confirms by tracks what is not in doubt, and records what it was given."""

    def __init__(self, doubt=False):
        self._doubt = doubt
        self.by_keypoints, self.by_depth = [], []

    def register(self, source, target, expected, elapsed):
        self.by_keypoints.append((expected, elapsed))
        return dataclasses.replace(FOUND, tracks=None if self._doubt else 'some')

    def register_depth(self, source, target, expected, unobserved):
        self.by_depth.append((expected, unobserved))
        return dataclasses.replace(FOUND, evidence=Evidence.DEPTH_ALONE)


def view(seconds, **values):
    return View(round(seconds * NANOSECONDS), **values)


def attempts_by(registrar):
    """Return attempts without other sensors."""
    settings = Settings()
    expected = ExpectedMotion(settings.odometry, Gyroscope(settings.imu, settings.odometry),
                              OtherOdometry(settings.odometry))
    return Attempts(settings, registrar, expected)


def order(now, references, doubt=False, twist=np.zeros(6)):
    """Return the evidence of all attempts in their order, with the times of the references."""
    attempts = attempts_by(Registrar(doubt)).of(now, references, twist, references.last.stamp)
    return [(attempt.registration.evidence, attempt.reference.stamp / NANOSECONDS)
            for attempt in attempts]


@pytest.fixture
def references():
    """Return a keyframe at 0 s and the last frame at 0.1 s."""
    first = Reference(view(0.0), PoseWithCovariance.identity())
    references = References(first)
    references.track(Reference(view(0.1), PoseWithCovariance.identity()), first)
    return references


BY_KEYPOINTS = [(Evidence.KEYPOINTS, 0.0), (Evidence.KEYPOINTS, 0.1)]
BY_DEPTH = [(Evidence.DEPTH_ALONE, 0.1)]


def test_keypoints_come_before_depth(references):
    assert order(view(0.2), references) == BY_KEYPOINTS + BY_DEPTH


def test_without_a_velocity_depth_alone_is_not_tried(references):
    assert order(view(0.2), references, twist=None) == BY_KEYPOINTS
    assert order(view(0.5), references) == BY_KEYPOINTS  # beyond the hold time


def test_a_pose_that_no_track_confirms_comes_after_depth(references):
    assert order(view(0.2), references, doubt=True) == BY_DEPTH + BY_KEYPOINTS


@pytest.mark.parametrize('now', [
    view(0.2, surface=None), view(0.2, grey=np.zeros((6, 8)))], ids=['no depth', 'resolution'])
def test_where_depth_or_tracks_cannot_know_better_nothing_is_doubted(references, now):
    assert order(now, references, doubt=True) == BY_KEYPOINTS + BY_DEPTH


def test_keypoints_of_a_colour_image_that_repeats_are_not_used(references):
    assert order(view(0.2, repeat=Repeat.COLOUR), references) == BY_DEPTH


def test_after_a_blur_the_keyframe_before_it_comes_first(references):
    blurred = Reference(view(0.15, sharpness=0), PoseWithCovariance.identity())
    references.track(blurred, blurred)
    assert order(view(0.2), references)[0] == (Evidence.KEYPOINTS, 0.0)
    assert order(view(0.2, sharpness=0), references)[0] == (Evidence.KEYPOINTS, 0.15)


@pytest.mark.parametrize('confirmed', [0.0, 0.1])
def test_registrations_know_the_motion_expected_and_the_time_since_keypoints_were_seen(confirmed):
    """A camera that turned and moved, at constant velocity since the last frame, 0.1 s ago."""
    keyframe, last = (
        PoseWithCovariance(se3.exp(twist), np.zeros((6, 6)))
        for twist in ([0.1, 0.2, 0.0, 0.0, 0.5, 0.1], [0.3, 0.1, 0.2, 0.1, 0.7, 0.0]))
    first = Reference(view(0.0), keyframe)
    references, registrar = References(first), Registrar()
    references.track(Reference(view(0.1), last), first)
    twist, settings = np.array([0.5, -0.2, 0.1, 0.3, 0.2, -0.4]), Settings().odometry
    list(attempts_by(registrar).of(view(0.2), references, twist, round(confirmed * NANOSECONDS)))
    moved = last.matrix @ se3.exp(0.1 * twist)
    for (expected, elapsed), reference in zip(registrar.by_keypoints, (keyframe, last)):
        np.testing.assert_allclose(expected, np.linalg.inv(reference.matrix) @ moved, atol=1e-12)
        assert elapsed == pytest.approx(0.2 - confirmed)
    (expected, unobserved), = registrar.by_depth
    np.testing.assert_allclose(expected.matrix, np.linalg.inv(last.matrix) @ moved, atol=1e-12)
    accelerations = np.repeat(
        [settings.acceleration_sigma, settings.angular_acceleration_sigma], 3)
    for covariance, interval in ((expected.covariance, 0.1), (unobserved, 0.2 - confirmed)):
        np.testing.assert_allclose(
            covariance, np.diag((accelerations * interval ** 2 / 2) ** 2), rtol=1e-9, atol=1e-12)
