# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images that come again under a new stamp, against the exact path of the renderer."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.repetition import Repeat
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.other_odometry import OtherOdometry
from aick_ros.registration.status import Status
from aick_ros.settings import OdometrySettings
from aick_ros.sources.synthetic import ColourSensor, DepthSensor, SyntheticOptions, SyntheticSource

COUNT, PERIOD = 9, 1 / 30


@pytest.fixture(scope='module')
def rendered():
    source = SyntheticSource(SyntheticOptions(seed=5, frames=COUNT))
    return [source.frame(i) for i in range(COUNT)], source.pose


def repeated(frame, by=1):
    """Return a frame with the images of an earlier one, some periods later."""
    stamp = frame.stamp + round(by * PERIOD * NANOSECONDS)
    return dataclasses.replace(frame, stamp=stamp, depth_stamp=None)


def follow(frames, predict=lambda before, now: None):
    odometry = Odometry()
    return [odometry.register_frame(frame, predict) for frame in frames]


def is_at(update, pose, start):
    """Return whether a pose is right to 3 mm and a tenth of a degree."""
    E = se3.inverse(se3.inverse(pose(start)) @ pose(update.stamp)) @ update.T_odom_camera
    return np.linalg.norm(E[:3, 3]) < 0.003 and se3.angle(E[:3, :3]) < np.radians(0.1)


def nees(error, covariance):
    return error @ np.linalg.solve(covariance, error)


def test_the_camera_moves_on_while_an_image_repeats(rendered):
    frames, pose = rendered
    shown = [*frames[:5], repeated(frames[4]), repeated(frames[4], by=2), *frames[7:]]
    updates = follow(shown)
    assert [u.status for u in updates[4:]] == [
        Status.OK, Status.REPEATED, Status.REPEATED, Status.OK, Status.OK]
    for update in updates[5:7]:
        assert update.increment is None
        assert update.prepared.repeat is Repeat.BOTH
        # the true motion goes on, and is within what the motion model allows
        motion = se3.inverse(pose(shown[4].stamp)) @ pose(update.stamp)
        assert np.linalg.norm(motion[:3, 3]) > 2 * np.linalg.norm(
            (se3.inverse(motion) @ update.expected.pose.matrix)[:3, 3])
        covariance = update.expected.pose.covariance
        assert nees(se3.difference(update.expected.pose.matrix, motion), covariance) < 12.59
        sensor = updates[4].increment.pose.covariance
        assert np.linalg.eigvalsh(covariance - sensor).min() > 0
        assert np.trace(update.pose.covariance) > np.trace(updates[4].pose.covariance)
    assert updates[7].increment.interval == pytest.approx(3 * PERIOD)
    assert not updates[7].recovered
    assert is_at(updates[8], pose, frames[0].stamp)


def test_the_error_of_the_velocity_grows_with_the_time_that_an_image_repeats(rendered):
    """The last increment goes on, so its covariance grows with the squared number of periods."""
    frames, _ = rendered
    updates = follow([*frames[:5], *(repeated(frames[4], by=i) for i in (1, 2, 3))])
    increment = updates[4].increment
    model = MotionModel(OdometrySettings())
    for update in updates[5:]:
        elapsed = (update.stamp - frames[4].stamp) / NANOSECONDS
        expected = model.predict(np.zeros(6), elapsed).covariance + (
            elapsed / increment.interval) ** 2 * increment.pose.covariance
        np.testing.assert_allclose(update.expected.pose.covariance, expected, rtol=1e-9)


def test_another_sensor_tells_the_motion_while_an_image_repeats(rendered):
    frames, pose = rendered
    update = follow([*frames[:3], repeated(frames[2])], lambda before, now: (
        se3.inverse(pose(before)) @ pose(now)))[-1]
    assert update.status is Status.REPEATED
    np.testing.assert_allclose(
        update.expected.pose.matrix,
        se3.inverse(pose(frames[2].stamp)) @ pose(update.stamp), atol=1e-12)
    # the velocity before has no part in it, so nor has its error
    slip = OtherOdometry(OdometrySettings()).with_slip(update.expected.pose.matrix)
    np.testing.assert_allclose(update.expected.pose.covariance, slip.covariance, rtol=1e-9)


def standing(frames, count):
    return [*frames[:4], *(repeated(frames[3], by=i + 1) for i in range(count))]


def test_images_that_stay_the_same_are_a_simulated_camera_at_rest(rendered):
    frames, pose = rendered
    updates = follow(standing(frames, 40))
    at_rest = [u.status is Status.OK for u in updates[4:]]
    assert at_rest == sorted(at_rest)  # once at rest it stays there
    first = 4 + at_rest.index(True)
    assert 0.3 < (updates[first].stamp - frames[3].stamp) / NANOSECONDS < 1.0
    assert updates[first].increment.interval == pytest.approx((first - 3) * PERIOD)
    rest, last = updates[first], updates[-1]
    assert last.increment.interval == pytest.approx(PERIOD)
    assert is_at(last, lambda stamp: pose(min(stamp, frames[3].stamp)), frames[0].stamp)
    np.testing.assert_allclose(last.pose.covariance, rest.pose.covariance,
                               atol=1e-3 * np.trace(rest.pose.covariance))
    # of a camera of which nothing is known yet motions are less certain than rest
    sensor = np.diag(updates[3].increment.pose.covariance)
    assert (np.diag(last.increment.pose.covariance) > 0.005 * sensor).all()
    assert {id(u.reference) for u in updates[first:]} == {id(updates[3].reference)}


def hung(**options):
    """Return the updates by a camera whose driver hangs after 16 frames."""
    frames = list(SyntheticSource(SyntheticOptions(seed=5, frames=16, **options)).frames())
    return follow([*frames, *(repeated(frames[-1], by=i + 1) for i in range(90))])[16:]


def test_images_of_a_camera_without_noise_show_rest():
    updates = hung(depth=DepthSensor.perfect(), colour=ColourSensor(sigma=0.0))
    assert {u.status for u in updates[30:]} == {Status.OK}
    assert np.sqrt(np.trace(updates[-1].pose.covariance[:3, :3])) < 0.05


def test_images_of_a_camera_that_has_noise_never_show_rest():
    """A driver that hangs delivers the same image for long: where the camera is, is not known."""
    updates = hung()
    assert {u.status for u in updates} == {Status.REPEATED}
    sigmas = [np.sqrt(np.trace(u.expected.pose.covariance[:3, :3])) for u in updates]
    assert (np.diff(sigmas) > 0.0).all() and sigmas[-1] > 1.0


def test_no_rest_while_another_sensor_moves(rendered):
    frames, _ = rendered

    def predict(before, now):
        return se3.exp([0.5 * (now - before) / NANOSECONDS, 0, 0, 0, 0, 0])
    updates = follow(standing(frames, 40), predict)
    assert {u.status for u in updates[4:]} == {Status.REPEATED}
    distance = np.linalg.norm(updates[-1].pose.translation - updates[3].pose.translation)
    assert distance == pytest.approx(0.5 * 40 * PERIOD, rel=1e-3)


def test_a_depth_image_that_repeats_does_not_hold_the_camera(rendered):
    frames, pose = rendered
    shown = [dataclasses.replace(frame, depth=frames[i - i % 2].depth)
             for i, frame in enumerate(frames)]
    updates = follow(shown)
    assert [u.prepared.repeat for u in updates] == [
        Repeat.DEPTH if i % 2 else Repeat.NONE for i in range(COUNT)]
    assert all(u.status.ok for u in updates)
    assert all(u.prepared.surface is None for u in updates[1::2])
    assert is_at(updates[7], pose, frames[0].stamp)


def test_a_depth_image_that_repeats_in_the_dark_is_no_loss(rendered):
    frames, _ = rendered
    shown = [dataclasses.replace(frame, colour=np.full_like(frame.colour, i % 3),
                                 depth=frames[i - i % 2].depth) for i, frame in enumerate(frames)]
    updates = follow(shown)
    assert [u.status for u in updates[1:]] == [
        Status.OK if i % 2 else Status.REPEATED for i in range(COUNT - 1)]
    assert updates[1].reason == 'depth repeats, 0 keypoints'


def test_images_of_a_dark_room_that_do_not_change_show_rest(rendered):
    dark = [dataclasses.replace(frame, colour=np.zeros_like(frame.colour))
            for frame in standing(rendered[0], 40)[3:]]
    updates = follow(dark)
    rest = next(i for i, u in enumerate(updates[1:]) if u.status is not Status.REPEATED) + 1
    assert 0.6 < (dark[rest].stamp - dark[0].stamp) / NANOSECONDS < 0.7  # 0.3 s, 1 m/s to stop
    assert {u.status for u in updates[rest:]} == {Status.OK}
    assert np.linalg.norm(updates[-1].pose.translation) < 1e-3


def test_a_frame_with_an_image_that_repeats_becomes_no_keyframe(rendered, monkeypatch):
    frames, _ = rendered
    monkeypatch.setattr('aick_ros.odometry.keyframe.KeyframePolicy.advance', lambda *_: False)
    updates = follow([frames[0], dataclasses.replace(frames[1], depth=frames[0].depth),
                      *frames[2:4]])
    assert [u.reference.stamp for u in updates[1:]] == [
        frames[0].stamp, frames[0].stamp, frames[2].stamp]


def test_a_lens_that_is_covered_is_lost_not_repeated(rendered):
    frames, _ = rendered
    covered = dataclasses.replace(frames[2], colour=np.zeros_like(frames[2].colour),
                                  depth=np.full_like(frames[2].depth, np.nan))
    updates = follow([*frames[:2], covered, repeated(covered)])
    assert [u.status.is_lost for u in updates] == [False, False, True, True]


def test_a_camera_at_rest_that_creeps_away_is_not_at_rest(rendered):
    """Its motion from frame to frame is within the slip of another sensor; all of it is not."""
    frames, _ = rendered
    begin = frames[3].stamp + round(30 * PERIOD * NANOSECONDS)

    def predict(before, now):
        crept = max(now - begin, 0) - max(before - begin, 0)
        speed = 3 * OdometrySettings().guess_sigma / (6 * PERIOD)
        return se3.exp([speed * crept / NANOSECONDS, 0, 0, 0, 0, 0])
    statuses = [u.status for u in follow(standing(frames, 40), predict)[4:]]
    assert statuses[28:30] == 2 * [Status.OK]
    assert statuses[37:] == 3 * [Status.REPEATED]
