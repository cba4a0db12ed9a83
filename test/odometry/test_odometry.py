# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The odometry on rendered frames, where the truth is known, and on frames that fail it."""

import copy
import dataclasses
import pickle
import re
import warnings

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.camera_clock import CameraClock
from aick_ros.geometry import se3
from aick_ros.odometry import Odometry
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status
from aick_ros.settings import OdometrySettings, Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

COUNT = 24
AS_MEASURED = with_values(Settings(), {'odometry.motion_prior': False})


@pytest.fixture(scope='module')
def rendered():
    source = SyntheticSource(SyntheticOptions(seed=5, frames=COUNT))
    return [source.frame(i) for i in range(COUNT)], source.ground_truth.poses


def track(odometry, frames, **options):
    return [odometry.register_frame(frame, **options) for frame in frames]


def error(update, truth, start=0, index=None):
    """Translation [m] and rotation [rad] between the pose and the true one since ``start``."""
    true_motion = se3.inverse(truth[start]) @ truth[index]
    E = se3.inverse(true_motion) @ update.T_odom_camera
    return np.linalg.norm(E[:3, 3]), se3.angle(E[:3, :3])


def black(frame):
    """Return a frame of a covered lens, without depth either."""
    return dataclasses.replace(frame, colour=np.zeros_like(frame.colour),
                               depth=np.full_like(frame.depth, np.nan))


def test_follows_the_camera(rendered):
    frames, truth = rendered
    updates = track(Odometry(), frames)
    assert [update.status for update in updates] == [Status.FIRST_FRAME] + (COUNT - 1) * [
        Status.OK]
    for i, update in enumerate(updates):
        translation, rotation = error(update, truth, 0, i)
        assert translation < 0.03
        assert rotation < np.radians(1.0)


def test_a_camera_that_changes_its_resolution_is_followed_on(rendered):
    frames, truth = rendered
    camera = frames[0].camera
    half = dataclasses.replace(
        camera, width=camera.width // 2, height=camera.height // 2, fx=camera.fx / 2,
        fy=camera.fy / 2, cx=(camera.cx + 0.5) / 2 - 0.5, cy=(camera.cy + 0.5) / 2 - 0.5)
    smaller = SyntheticSource(SyntheticOptions(seed=5, frames=COUNT, camera=half))
    mixed = [*frames[:6], *map(smaller.frame, range(6, 12)), *frames[12:18]]
    updates = track(Odometry(), mixed)
    assert all(update.status.ok and not update.recovered for update in updates)
    for i, update in enumerate(updates):
        translation, rotation = error(update, truth, 0, i)
        assert translation < 0.04
        assert rotation < np.radians(1.5)
    # the images of a change cannot be compared: that increment is less sure, the next ones not
    spread = [np.trace(update.increment.pose.covariance[:3, :3]) for update in updates[1:]]
    assert min(spread[5], spread[11]) > 3 * np.median(spread)


def test_a_recording_that_begins_at_stamp_0_is_as_any_other(rendered):
    """As one of a simulation is: with frames in the dark, one that repeats, and one too late."""
    frames = list(rendered[0][:12])
    for dark in (3, 4, 5):
        frames[dark] = dataclasses.replace(
            frames[dark], colour=np.zeros_like(frames[dark].colour))
    frames[8] = dataclasses.replace(frames[8], colour=frames[7].colour, depth=frames[7].depth)
    frames.insert(10, dataclasses.replace(frames[2]))
    shifted = [dataclasses.replace(frame, depth_stamp=None, stamp=frame.stamp - frames[0].stamp)
               for frame in frames]
    assert shifted[0].stamp == 0
    usual = [dataclasses.replace(frame, depth_stamp=None) for frame in frames]
    for one, other in zip(track(Odometry(), shifted), track(Odometry(), usual)):
        assert one.status is other.status
        np.testing.assert_array_equal(one.T_odom_camera, other.T_odom_camera)
        np.testing.assert_array_equal(one.pose.covariance, other.pose.covariance)


def test_pose_is_the_chain_of_increments(rendered):
    frames, _ = rendered
    first, *updates = track(Odometry(AS_MEASURED), frames[:10])
    assert first.increment is None
    pose = first.T_odom_camera
    for update in updates:
        pose = pose @ update.increment.pose.matrix
        np.testing.assert_allclose(update.T_odom_camera, pose, atol=1e-12)


def test_matches_are_of_the_frame_and_its_reference(rendered):
    """Carried over by the increment, a matched keypoint lies on that of the reference."""
    frames, _ = rendered
    first, second = track(Odometry(), frames[:2])
    assert first.reference is None
    assert second.reference is first.keypoints
    source, target = second.matches.T
    moved = se3.transform(second.increment.pose.matrix, second.keypoints.positions[source])
    apart = np.linalg.norm(moved - second.reference.positions[target], axis=1)
    assert np.median(apart) < 0.01


def test_uncertainty_grows_along_the_way(rendered):
    frame_by_frame = with_values(Settings(), {'odometry.reference': 'previous'})
    updates = track(Odometry(frame_by_frame), rendered[0])
    traces = [np.trace(update.pose.covariance) for update in updates]
    assert traces[0] == 0.0
    assert all(a < b for a, b in zip(traces, traces[1:]))


def test_a_keyframe_adds_its_error_once(rendered):
    frames, truth = rendered
    sums, ends = [], []
    for reference in ('previous', 'keyframe'):
        chosen = with_values(AS_MEASURED, {'odometry.reference': reference})
        updates = track(Odometry(chosen), frames)
        sums.append(np.trace(updates[-1].pose.covariance))
        ends.append(se3.inverse(se3.inverse(truth[0]) @ truth[-1]) @ updates[-1].T_odom_camera)
        for before, now in zip(updates, updates[1:]):
            np.testing.assert_allclose(before.T_odom_camera @ now.increment.pose.matrix,
                                       now.T_odom_camera, atol=1e-9)
    assert sums[1] < sums[0]
    assert all(np.linalg.norm(end[:3, 3]) < 0.01 for end in ends)


@pytest.mark.parametrize('reference', ['previous', 'keyframe'])
def test_the_covariance_is_that_of_the_keyframe_and_one_registration(
        rendered, monkeypatch, reference):
    """
    Sampled: the error of the keyframe is kept, and that of each registration is added to it.

    That of the stamps is not: it is in the last registration only.
    """
    monkeypatch.setattr(CameraClock, 'jitter', 0.004)
    registered, register = {}, Registrar.register

    def recorded(self, source, target, *args):
        found = register(self, source, target, *args)
        registered[source.stamp, target.stamp] = found
        return found

    monkeypatch.setattr(Registrar, 'register', recorded)
    settings = with_values(Settings(), {'odometry.reference': reference})
    updates = track(Odometry(settings), rendered[0][:12])
    rng, scale, count = np.random.default_rng(9), 0.1, 1500
    sampled = {updates[0].stamp: np.tile(np.eye(4), (count, 1, 1))}
    for update in updates[1:]:
        found = registered[update.stamp, update.reference.stamp]
        pose = found.pose if update is updates[-1] else found.image_pose
        noise = scale * rng.multivariate_normal(np.zeros(6), pose.covariance, count)
        sampled[update.stamp] = np.array([
            start @ se3.perturbed(pose.matrix, error)
            for start, error in zip(sampled[update.reference.stamp], noise)])
    end = updates[-1]
    errors = [se3.difference(pose, end.T_odom_camera) for pose in sampled[end.stamp]]
    expected = np.cov(np.transpose(errors)) / scale ** 2
    sigmas = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(end.pose.covariance / np.outer(sigmas, sigmas),
                               expected / np.outer(sigmas, sigmas), atol=0.1)


def test_images_may_be_written_into_the_same_arrays(rendered):
    """As many cameras do; and they may be overwritten before the next frame."""
    frames, _ = rendered
    colour, depth = np.empty_like(frames[0].colour), np.empty_like(frames[0].depth)
    odometry, found = Odometry(), []
    for frame in frames[:5]:
        colour[:], depth[:] = frame.colour, frame.depth
        found.append(odometry.register_frame(
            dataclasses.replace(frame, colour=colour, depth=depth)))
        colour[:], depth[:] = 0, np.nan
    for update, expected in zip(found, track(Odometry(), frames[:5]), strict=True):
        np.testing.assert_array_equal(update.T_odom_camera, expected.T_odom_camera)


@pytest.mark.parametrize('marker', [0.0, -1.0, np.inf, -np.inf])
@pytest.mark.parametrize('seen', [5, 2], ids=['by keypoints', 'by depth alone'])
def test_invalid_depth_may_be_marked_by_any_value(rendered, marker, seen):
    """The pose is the same, and nothing is divided by zero."""
    frames, _ = rendered
    poses = []
    for value in (np.nan, marker):
        shown = [dataclasses.replace(
            frame, colour=frame.colour if index < seen else np.zeros_like(frame.colour),
            depth=np.where(np.isfinite(frame.depth), frame.depth, np.float32(value)))
            for index, frame in enumerate(frames[:5])]
        with warnings.catch_warnings():
            warnings.simplefilter('error')
            poses.append([update.T_odom_camera for update in track(Odometry(), shown)])
    np.testing.assert_array_equal(poses[0], poses[1])


def test_images_may_be_overwritten_once_a_frame_is_prepared(rendered):
    frames, _ = rendered
    colour, depth = frames[1].colour.copy(), frames[1].depth.copy()
    odometry, untouched = Odometry(), Odometry()
    for each in (odometry, untouched):
        each.register_frame(frames[0])
    preparation = odometry.prepare(dataclasses.replace(frames[1], colour=colour, depth=depth))
    colour[:], depth[:] = 0, np.nan
    np.testing.assert_array_equal(odometry.register(preparation).T_odom_camera,
                                  untouched.register_frame(frames[1]).T_odom_camera)


def test_who_changes_a_result_does_not_change_the_odometry(rendered):
    """What can be written to is a copy; the rest cannot be written to."""
    frames, _ = rendered
    odometry, found = Odometry(), []
    for frame in frames[:5]:
        update = odometry.register_frame(frame)
        found.append(update.T_odom_camera.copy())
        increment = update.increment.pose if update.increment else update.pose
        for array in (update.T_odom_camera, update.pose.covariance, increment.matrix,
                      increment.covariance, update.matches, update.prepared.grey,
                      update.prepared.frame.colour, update.prepared.frame.depth,
                      *(getattr(update.keypoints, name) for name in (
                          'positions', 'descriptors', 'covariances', 'pixels'))):
            if array.flags.writeable:
                array[:] = 9
    for pose, expected in zip(found, track(Odometry(), frames[:5]), strict=True):
        np.testing.assert_array_equal(pose, expected.T_odom_camera)


@pytest.mark.parametrize('detector, vocabulary', [
    ('orb', ''), ('orb', 'orb-1000'), ('surf', ''), ('sift', '')])
@pytest.mark.parametrize('copied', [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))],
                         ids=['copy', 'pickle'])
def test_a_copy_continues_on_its_own(rendered, detector, vocabulary, copied):
    frames, _ = rendered
    odometry = Odometry(with_values(Settings(), {
        'features.detector': detector, 'aick.vocabulary': vocabulary}))
    track(odometry, frames[:3])
    other = copied(odometry)
    ends = [track(each, frames[3:6])[-1] for each in (odometry, other)]
    np.testing.assert_array_equal(ends[0].T_odom_camera, ends[1].T_odom_camera)
    np.testing.assert_array_equal(ends[0].pose.covariance, ends[1].pose.covariance)


def test_starts_where_it_is_told(rendered):
    frames, _ = rendered
    start = se3.exp([1, 2, 3, 0.3, 0.2, 0.1])
    moved, plain = (track(Odometry(T_odom_camera=pose), frames[:5])[-1].T_odom_camera
                    for pose in (start, None))
    np.testing.assert_allclose(moved, start @ plain, atol=1e-12)


def test_one_lost_frame_is_held_and_bridged(rendered):
    frames, truth = rendered
    shown = [*frames[:8], black(frames[8]), *frames[9:]]
    updates = track(Odometry(), shown)
    lost = updates[8]
    assert lost.status is Status.TOO_FEW_KEYPOINTS
    assert '0 and' in lost.reason
    assert lost.increment is lost.rejected is None
    # held at constant velocity: nearer to the truth than standing still
    standing_still = error(updates[7], truth, 0, 8)[0]
    assert error(lost, truth, 0, 8)[0] < max(0.5 * standing_still, 0.01)
    assert updates[9].status is Status.OK
    assert updates[9].recovered
    assert updates[9].increment.interval == pytest.approx(2 / 30)
    assert not updates[10].recovered
    assert error(updates[-1], truth, 0, COUNT - 1)[0] < 0.03


def test_a_lens_covered_for_long_does_not_make_the_pose_jump(rendered):
    """In the dark the pose stops after hold_time, and goes on from there."""
    frames, _ = rendered
    odometry = Odometry(dataclasses.replace(Settings(), odometry=OdometrySettings(hold_time=0.1)))
    track(odometry, frames[:8])
    dark = track(odometry, [black(frame) for frame in frames[8:16]])
    steps = [np.linalg.norm(b.T_odom_camera[:3, 3] - a.T_odom_camera[:3, 3])
             for a, b in zip(dark, dark[1:])]
    assert steps[-1] == pytest.approx(0.0, abs=1e-12)
    sigmas = [np.trace(update.pose.covariance) for update in dark]
    assert all(a < b for a, b in zip(sigmas, sigmas[1:]))
    after = odometry.register_frame(frames[16])
    assert after.recovered


def test_after_a_long_loss_the_uncertainty_is_large_but_not_absurd(rendered):
    frames, _ = rendered
    odometry = Odometry()
    track(odometry, frames[:3])
    late = odometry.register_frame(dataclasses.replace(
        black(frames[3]), stamp=frames[2].stamp + 60 * 10 ** 9))
    x, *_, turn = np.sqrt(np.diag(late.pose.covariance))
    assert 10 < x <= 60 * 3.1  # as far as the motion gate lets it go
    assert 1 < turn < 3.3


def test_in_another_place_it_goes_on_from_the_pose_reached(rendered):
    """Carried elsewhere in the dark: nothing matches, so the pose is held, then tracks on."""
    frames, _ = rendered
    elsewhere = SyntheticSource(SyntheticOptions(
        seed=77, frames=3, start=frames[5].stamp + 10 ** 9))
    odometry = Odometry()
    before = track(odometry, frames[:6])[-1]
    lost, found, on = track(odometry, [elsewhere.frame(i) for i in range(3)])
    assert not lost.status.ok
    assert np.linalg.norm(lost.T_odom_camera[:3, 3] - before.T_odom_camera[:3, 3]) < 0.3
    assert found.status is Status.OK
    assert found.recovered
    assert on.status is Status.OK
    truth = elsewhere.ground_truth.poses
    moved = se3.inverse(lost.T_odom_camera) @ on.T_odom_camera
    expected = se3.inverse(truth[0]) @ truth[2]
    np.testing.assert_allclose(moved, expected, atol=0.02)


@pytest.mark.parametrize('limit', ['max_speed', 'max_turn_rate'])
def test_motion_gate(rendered, limit):
    frames, _ = rendered
    slow = with_values(Settings(), {f'odometry.{limit}': 0.01})
    updates = track(Odometry(slow), [frames[0], frames[6]])
    assert updates[1].status is Status.MOTION_GATE
    assert re.search(rf'odometry.{limit} (is )?0.01', updates[1].reason)


def test_a_rejected_increment_is_reported(rendered):
    frames, truth = rendered
    slow = dataclasses.replace(Settings(), odometry=OdometrySettings(max_speed=0.01))
    updates = track(Odometry(slow), [frames[0], frames[3], frames[6], black(frames[7])])
    for update, index in zip(updates[1:3], (3, 6)):
        motion = se3.inverse(truth[0]) @ truth[index]
        np.testing.assert_allclose(update.rejected.pose.matrix, motion, atol=0.03)
        assert update.rejected.interval == pytest.approx(index / 30)
        assert update.increment is None
    assert updates[0].rejected is updates[3].rejected is None


def test_too_few_matches_are_rejected(rendered):
    frames, _ = rendered
    strict = with_values(Settings(), {'odometry.min_matches': 400,
                                      'refinement.mode': 'keypoints'})  # not by depth alone
    updates = track(Odometry(strict), frames[:2])
    assert updates[1].status is Status.TOO_FEW_MATCHES
    assert 'odometry.min_matches is 400' in updates[1].reason


def test_a_pose_with_evidence_in_the_depth_image_needs_no_keypoints(rendered, monkeypatch):
    """The least number of matches is asked of poses that keypoints support."""
    register = Registrar.register

    def by_depth(*args):
        return dataclasses.replace(register(*args), support=0, evidence=Evidence.DEPTH)

    monkeypatch.setattr(Registrar, 'register', by_depth)
    updates = track(Odometry(), rendered[0][:2])
    assert updates[1].status is Status.OK
    assert updates[1].support == 0


@pytest.mark.parametrize('step', [0, -1, -500_000_000])
def test_stamps_that_repeat_or_go_back_change_nothing(rendered, step):
    frames, _ = rendered
    odometry, other = Odometry(), Odometry()
    track(odometry, frames[:3])
    track(other, frames[:3])
    late = odometry.register_frame(dataclasses.replace(frames[9], stamp=frames[2].stamp + step))
    assert late.status is Status.BAD_STAMP
    np.testing.assert_array_equal(odometry.register_frame(frames[3]).T_odom_camera,
                                  other.register_frame(frames[3]).T_odom_camera)


def test_a_recording_that_starts_again_goes_on_at_the_pose_reached(rendered):
    frames, _ = rendered
    again = [dataclasses.replace(frame, stamp=frame.stamp - 5 * 10 ** 9) for frame in frames]
    odometry = Odometry()
    before = track(odometry, frames[:6])[-1]
    first, second = track(odometry, again[:2])
    assert first.status is Status.FIRST_FRAME
    np.testing.assert_array_equal(first.T_odom_camera, before.T_odom_camera)
    assert first.recovered  # where the camera was in between nobody knows
    assert second.status is Status.OK
    assert not second.recovered


def test_a_recording_that_starts_again_while_lost_has_recovered_with_its_first_frame(rendered):
    frames, _ = rendered
    odometry = Odometry()
    track(odometry, [*frames[:6], black(frames[6])])
    again = dataclasses.replace(frames[0], stamp=frames[0].stamp - 5 * 10 ** 9)
    first = odometry.register_frame(again)
    assert first.status is Status.FIRST_FRAME
    assert first.recovered


def test_before_the_first_good_frame_the_pose_is_the_start(rendered):
    frames, _ = rendered
    odometry = Odometry()
    dark = odometry.register_frame(black(frames[0]))
    assert dark.status is Status.TOO_FEW_KEYPOINTS
    np.testing.assert_array_equal(dark.T_odom_camera, np.eye(4))
    assert odometry.register_frame(frames[1]).status is Status.FIRST_FRAME
    assert odometry.register_frame(frames[2]).status is Status.OK


def test_reset(rendered):
    frames, _ = rendered
    odometry = Odometry()
    track(odometry, frames[:5])
    odometry.reset()
    assert odometry.register_frame(frames[0]).status is Status.FIRST_FRAME


def test_a_lost_frame_is_where_another_sensor_saw_it(rendered):
    """The prediction carries the pose through the dark, and from there it is tracked on."""
    frames, truth = rendered
    true_pose = {frame.stamp: pose for frame, pose in zip(frames, truth)}
    updates = track(
        Odometry(), [*frames[:6], *map(black, frames[6:16]), *frames[16:]],
        predict=lambda before, now: se3.inverse(true_pose[before]) @ true_pose[now])
    assert [update.predicted for update in updates] == 6 * [False] + 10 * [True] + 8 * [False]
    for i in (10, 15, 16, 23):
        assert error(updates[i], truth, 0, i)[0] < 0.03
    assert np.sqrt(updates[15].pose.covariance[0, 0]) < 0.1  # not that of ten frames of guessing


def test_wheels_that_slip_do_not_pull_a_camera_that_sees(rendered):
    """They turn by 30 % more than the robot moves, all the time."""
    frames, truth = rendered
    true_pose = {frame.stamp: pose for frame, pose in zip(frames, truth)}

    def slipping(before, now):
        motion = se3.inverse(true_pose[before]) @ true_pose[now]
        return se3.exp(1.3 * se3.log(motion))

    alone, with_wheels = track(Odometry(), frames), track(Odometry(), frames, predict=slipping)
    apart = [np.linalg.norm(one.T_odom_camera[:3, 3] - other.T_odom_camera[:3, 3])
             for one, other in zip(alone, with_wheels)]
    assert 0.0 < max(apart) < 0.005


def test_without_a_prediction_the_velocity_is_held(rendered):
    frames, _ = rendered
    shown = [*frames[:6], black(frames[6])]
    silent = track(Odometry(), shown, predict=lambda before, now: None)[-1]
    plain = track(Odometry(), shown)[-1]
    np.testing.assert_array_equal(silent.T_odom_camera, plain.T_odom_camera)
    assert not silent.predicted


def test_settings_change_between_two_frames_without_losing_the_pose(rendered):
    frames, truth = rendered
    odometry = Odometry()
    track(odometry, frames[:6])
    fewer = with_values(Settings(), {'features.max_keypoints': 200})
    odometry.change_settings(fewer)
    updates = track(odometry, frames[6:])
    assert {update.status for update in updates} == {Status.OK}
    assert {len(update.keypoints) for update in updates} == {200}
    assert error(updates[-1], truth, 0, COUNT - 1)[0] < 0.03


@pytest.mark.parametrize('pose', [
    np.full((4, 4), np.nan), np.zeros((4, 4)), np.diag([1.0, 1.0, -1.0, 1.0]),
    np.diag([1e300, 1.0, 1.0, 1.0]), np.eye(3), 'origin'])
def test_a_first_pose_that_is_none_is_rejected_and_changes_nothing(rendered, pose):
    with pytest.raises(InputError, match='T_odom_camera is not a pose'):
        Odometry(T_odom_camera=pose)
    frames, _ = rendered
    odometry = Odometry()
    odometry.register_frame(frames[0])
    with pytest.raises(InputError, match='T_odom_camera is not a pose'):
        odometry.reset(pose)
    assert odometry.register_frame(frames[1]).status is Status.OK


@pytest.mark.parametrize('prediction', [np.full((4, 4), np.nan), np.zeros((4, 4)), np.eye(3)])
def test_a_prediction_that_is_no_motion_is_rejected_and_forgotten(rendered, prediction):
    frames, truth = rendered
    odometry = Odometry()
    odometry.register_frame(frames[0])
    with pytest.raises(InputError, match='the predicted motion is not a pose'):
        odometry.register_frame(black(frames[1]), predict=lambda before, now: prediction)
    update = odometry.register_frame(frames[2])
    assert update.status is Status.OK
    distance, angle = error(update, truth, index=2)
    assert distance < 0.01 and angle < 0.01


def test_the_local_map_is_the_keypoints_of_the_keyframes(rendered):
    """As long as none is found again the keyframes are where their poses were published."""
    odometry = Odometry(with_values(AS_MEASURED, {'odometry.min_overlap': 0.95}))
    assert len(odometry.local_map()) == 0
    updates = track(odometry, rendered[0])
    references = {id(update.reference) for update in updates[1:]}
    keyframes = [update for update in updates if id(update.keypoints) in references]
    assert len(keyframes) > 2
    expected = np.concatenate([
        se3.transform(se3.inverse(updates[-1].T_odom_camera) @ keyframe.T_odom_camera,
                      keyframe.keypoints.positions) for keyframe in keyframes])
    seen = odometry.local_map()  # the last frame may be a keyframe already
    np.testing.assert_allclose(seen[:len(expected)], expected, atol=1e-6)
    assert len(seen) - len(expected) in (0, len(updates[-1].keypoints))
    odometry.reset()
    assert len(odometry.local_map()) == 0
