# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sudden motions of the camera, and of objects in front of it, in rendered views."""

import dataclasses
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.pose_fusion import fused
from aick_ros.registration.apparent_acceleration import ApparentAcceleration
from aick_ros.registration.dynamic_objects import DynamicObjectCheck, _is_for_second
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.found_objects import FoundObjects, Places
from aick_ros.registration.pose_vote import PoseVote
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.refined import Refined
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Evidence, Fit
from aick_ros.registration.sensor_agreement import SensorAgreement
from aick_ros.registration.tracks import Tracks
from aick_ros.registration.two_motions import TwoMotions
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

PERIOD = 1 / 30
LEAP = 35  # px a frame, at one metre 2 m/s
JOLT = se3.exp([0.08, -0.03, 0.02, 0, 0, 0])
"""A deviation from constant velocity by 79 m/s^2 in one frame."""


@pytest.fixture(scope='module')
def frames():
    source = SyntheticSource(SyntheticOptions(seed=5, frames=3))
    return [source.frame(i) for i in range(3)], source.ground_truth.poses


@pytest.fixture(scope='module')
def picture():
    colour = SyntheticSource(SyntheticOptions(seed=77, frames=1)).frame(0).colour
    return cv2.GaussianBlur(colour, (0, 0), 1.5)


def paste(frame, picture, left, width, top=60):
    """Return a frame, its colours faint, with a board one metre away."""
    colour, depth = cv2.convertScaleAbs(frame.colour, alpha=0.25, beta=96), frame.depth.copy()
    board = slice(top, 480 - top), slice(left, left + width)
    colour[board], depth[board] = picture[board[0], 60:60 + width], 1.0
    return dataclasses.replace(frame, colour=colour, depth=depth)


def pair(frames, changes=None):
    """Return the prepared last two of some frames, and their registration."""
    registrar = Registrar(with_values(Settings(), changes or {}))
    target, source = (registrar.prepare(frame) for frame in frames)
    return source, target, registrar.register(source, target)


def opinion(settings=Settings()):
    return DynamicObjectCheck(Refinement(settings.refinement, settings.sensor), settings,
                              SensorAgreement(MeasuredNoise()),
                              ApparentAcceleration(settings.odometry))


def off(pose, truth):
    E = se3.inverse(truth) @ pose
    return np.linalg.norm(E[:3, 3]), se3.angle(E[:3, :3])


def test_a_sudden_motion_is_one_beyond_the_motion_model(frames):
    """Five times the noise of the acceleration: with a calmer model less is sudden."""
    shown, _ = frames
    source, target, found = pair(shown[:2])
    moved = found.T_target_source @ se3.exp([0.015, 0, 0, 0, 0, 0])  # 13.5 m/s^2
    assert opinion().check(found, source, target, ExpectedPose(moved, PERIOD)) is found
    asked = []
    calm = opinion(with_values(Settings(), {'odometry.acceleration_sigma': 1.0}))
    calm._refinement.refine = lambda *args: asked.append(args) or Refinement(
        Settings().refinement, Settings().sensor).refine(*args)
    calm.check(found, source, target, ExpectedPose(moved, PERIOD))
    assert asked


def test_a_second_pose_that_nothing_observes_is_that_of_the_motion_model(frames, monkeypatch):
    """Its deviations are a t^2 / 2: 5/3 sigma of the acceleration, one of the angular one."""
    source, target, found = pair(frames[0][:2])
    expected = found.T_target_source @ JOLT
    none = Tracks(*(np.empty(shape) for shape in [0, (0, 3), (0, 2), 0, 0]))
    blind = Refined(found.T_target_source, 1e9 * np.eye(6), np.zeros((6, 6)), dataclasses.replace(
        none, keypoints=np.empty(0, int)))
    monkeypatch.setattr('aick_ros.registration.dynamic_objects.pose_vote',
                        lambda *_: PoseVote(first=0.0, second=1.0, seen=1.0))
    check = opinion(with_values(Settings(), {'odometry.acceleration_sigma': 3.0,
                                             'odometry.angular_acceleration_sigma': 7.0}))
    check._refinement.refine = lambda *_: blind
    elapsed = 0.05
    biased = dataclasses.replace(found, covariance=found.covariance + np.eye(6),
                                 systematic=found.systematic + np.eye(6))
    weighed = check.check(biased, source, target, ExpectedPose(expected, elapsed))
    np.testing.assert_allclose(weighed.T_target_source, expected, atol=1e-9)
    # the bias of the registration that was not taken is no part of this one
    assert np.linalg.eigvalsh(weighed.varying_pose.covariance).min() > 0
    sigmas = 0.5 * elapsed ** 2 * np.repeat([5.0 / 3.0 * 3.0, 7.0], 3)
    np.testing.assert_allclose(weighed.covariance, np.diag(sigmas ** 2), rtol=1e-6, atol=1e-15)


def moving(frames, picture, width, leap=LEAP):
    """Return prepared frames with a board that leaps, the registration, and the truth."""
    shown, poses = frames
    shown = [paste(shown[0], picture, 60, width), paste(shown[1], picture, 60 + leap, width)]
    return *pair(shown), se3.inverse(poses[0]) @ poses[1]


@pytest.mark.parametrize('width', [330, 460])
def test_a_board_with_most_keypoints_is_recognised_as_an_object(frames, picture, width):
    source, target, found, truth = moving(frames, picture, width)
    assert off(found.T_target_source, truth)[0] > 0.05
    weighed = opinion().check(found, source, target, ExpectedPose(truth, PERIOD))
    translation, rotation = off(weighed.T_target_source, truth)
    assert translation < 0.004
    assert rotation < np.radians(0.2)
    assert np.sqrt(np.linalg.eigvalsh(weighed.covariance).max()) < 0.02
    error = se3.difference(weighed.T_target_source, truth)
    assert error @ np.linalg.solve(weighed.covariance, error) < 30
    tracks = weighed.tracks
    assert not np.isin(tracks.keypoints, found.tracks.keypoints).any()
    np.testing.assert_array_equal(tracks.points, source.keypoints.positions[tracks.keypoints])
    assert 'keypoints move by themselves' in weighed.reason
    assert weighed.support == len(weighed.tracks)
    assert weighed.evidence is Evidence.DEPTH
    assert found.evidence is Evidence.KEYPOINTS
    assert len(weighed.matches) == 0


def test_an_undecided_vote_enlarges_the_covariance(frames, picture):
    """The board has most of the view and starts slowly: the difference of the poses is added."""
    source, target, found, truth = moving(frames, picture, 460, 11)
    weighed = opinion().check(found, source, target, ExpectedPose(truth, PERIOD))
    np.testing.assert_array_equal(weighed.T_target_source, found.T_target_source)
    error = se3.difference(found.T_target_source, truth)
    before, after = (error @ np.linalg.solve(registration.covariance, error)
                     for registration in (found, weighed))
    assert after < 0.1 * before


def test_frames_of_two_resolutions_are_not_checked(frames):
    (first, second, *_), _ = frames
    smaller = RgbdFrame(second.stamp, cv2.resize(second.colour, (320, 240)),
                        np.ascontiguousarray(second.depth[::2, ::2]),
                        Camera(320, 240, *(0.5 * np.array([
                            first.camera.fx, first.camera.fy, first.camera.cx - 0.5,
                            first.camera.cy - 0.5]))))
    registrar = Registrar()
    target, source = registrar.prepare(first), registrar.prepare(smaller)
    found = registrar.register(source, target)
    assert found.status.ok
    again = registrar.register(source, target, ExpectedPose(found.T_target_source @ JOLT, PERIOD))
    np.testing.assert_array_equal(again.T_target_source, found.T_target_source)


@pytest.mark.parametrize('jolt', [JOLT, se3.exp([0, 0, 0, 0.05, 0.1, -0.05])])
def test_a_jolt_of_the_camera_is_accepted(frames, jolt):
    """Only the camera moves: all of the view supports the motion, however sudden."""
    shown, poses = frames
    source, target, found = pair(shown[:2])
    weighed = opinion().check(
        found, source, target, ExpectedPose(found.T_target_source @ jolt, PERIOD))
    np.testing.assert_array_equal(weighed.T_target_source, found.T_target_source)
    assert weighed.support == found.support
    sigmas = [np.sqrt(np.trace(r.covariance[:3, :3])) for r in (found, weighed)]
    assert sigmas[1] < sigmas[0] + 0.01


def test_motions_within_the_model_are_not_checked(frames, picture):
    source, target, found, truth = moving(frames, picture, 460)
    near = found.T_target_source @ se3.exp([0.015, 0, 0, 0, 0.03, 0])
    assert opinion().check(found, source, target, ExpectedPose(near, PERIOD)) is found
    # nor a motion over a time so long that the model allows it
    assert opinion().check(found, source, target, ExpectedPose(truth, 0.3)) is found


def test_frames_without_surfaces_are_not_checked(frames, picture):
    shown, poses = frames
    settings = {'refinement.mode': 'keypoints'}
    source, target, found = pair(shown[:2], settings)
    expected = found.T_target_source @ JOLT
    assert opinion(with_values(Settings(), settings)).check(
        found, source, target, ExpectedPose(expected, PERIOD)) is found


def test_a_registration_without_expected_pose_is_not_checked(frames, picture, monkeypatch):
    monkeypatch.setattr(DynamicObjectCheck, 'check', lambda *_: pytest.fail('asked'))
    shown, _ = frames
    pair([paste(shown[0], picture, 60, 460), paste(shown[1], picture, 60 + LEAP, 460)])


@pytest.mark.parametrize('first, second, seen, sudden, decides', [
    (0.2, 0.8, 0.61, 1.0, True), (0.2, 0.8, 0.6, 1.0, False), (0.2, 0.8, 0.2, 1.0, False),
    (0.0, 0.071, 1.0, 1.0, True), (0.0, 0.07, 1.0, 1.0, False),
    (0.41, 0.59, 1.0, 1.0, False), (0.39, 0.61, 1.0, 1.0, True),
    (0.41, 0.59, 1.0, 2.0, True), (0.89, 0.11, 1.0, 9.0, True), (0.91, 0.09, 1.0, 9.0, False)])
def test_the_view_decides_if_enough_of_it_is_seen_and_votes(first, second, seen, sudden, decides):
    """The more sudden the motion, the fewer must vote for the expected one: 60 % down to 10 %."""
    assert _is_for_second(PoseVote(first, second, seen), sudden) == decides


EXPECTED = se3.exp([0.05, 0.02, 0.01, 0.02, 0.1, -0.05])
ELAPSED = 0.1
AWAY = np.array([0.3, 0.1, 0.0, 0.02, 0.0, 0.01])
"""Error of a registration, an apparent acceleration of 63 m/s^2."""


class Played:
    """A check whose refinements and vote have known answers, and two frames."""

    def __init__(self, monkeypatch, made, vote=PoseVote(0.0, 1.0, 1.0), tracked=(30,)):
        self.made, self.refined, self.voted = made, [], []
        self.answers = [dataclasses.replace(
            made.refined(count, bias=f'bias {count}', measure=pytest.fail),  # learned from by none
            T_target_source=se3.perturbed(EXPECTED, np.array([0.01, 0, 0, 0, 0.005, 0])))
            for count in tracked]
        monkeypatch.setattr('aick_ros.registration.dynamic_objects.pose_vote',
                            lambda *of: self.voted.append(of) or vote)
        self.settings, self.opinion = Settings(), opinion()
        self.opinion._refinement = SimpleNamespace(
            refine=lambda *of: self.refined.append(of) or self.answers[len(self.refined) - 1],
            without_small_objects=lambda *of: self.small.append(of) or self.without_small,
            refine_near=lambda *of: self.near.append(of) or self.nearer,
            without_known_objects=lambda *of: self.beside.append(of) or self.scene,
            first_tracks=SimpleNamespace(of_some=lambda *of: ('known tracks', *of)))
        self.near, self.nearer = [], self.answers[0]
        self.small, self.without_small = [], made.refined(70)
        self.beside, self.scene = [], None  # nothing has moved before
        self.lost_by, self.better = [], []  # what agreement is asked for, and answers about it
        self.is_lost = False
        self.opinion._agreement = SimpleNamespace(
            is_lost_by=lambda *of: self.lost_by.append(of) or (
                self.is_lost and of[0] is self.found),
            is_better_by=lambda *of: self.better.pop(0))
        self.source, self.target = (made.prepared(stamp, surface='a surface')
                                    for stamp in (2, 1))
        tracks = made.tracks(20)
        self.found = dataclasses.replace(
            made.registration(systematic=made.covariance(), measure='of objects'),
            T_target_source=se3.perturbed(EXPECTED, AWAY),
            tracks=dataclasses.replace(tracks, keypoints=np.arange(20) * 3))

    def check(self, **replaced):
        views = {'source': self.source, 'target': self.target, **replaced}
        return self.opinion.check(self.found, views['source'], views['target'],
                                  ExpectedPose(EXPECTED, ELAPSED))

    def second(self, number=0):
        """Return the pose of a refinement, fused with the motion expected."""
        odometry, refined = self.settings.odometry, self.answers[number]
        sigmas = np.repeat([5 / 3 * odometry.acceleration_sigma,
                            odometry.angular_acceleration_sigma], 3) * ELAPSED ** 2 / 2
        return fused(PoseWithCovariance(EXPECTED, np.diag(sigmas ** 2)),
                     PoseWithCovariance(refined.T_target_source, refined.covariance))


@pytest.fixture
def play(monkeypatch, made):
    return lambda **values: Played(monkeypatch, made, **values)


def objects(count):
    """Return objects that some tracks show."""
    places = Places(np.empty((0, 3)), np.ones((count, 3)), 0)
    return FoundObjects(places, places)


REST = np.setdiff1d(np.arange(100), np.arange(20) * 3)


def test_it_is_refined_from_the_motion_expected_without_the_keypoints_found(play):
    played = play()
    played.source = dataclasses.replace(played.source, keypoints=dataclasses.replace(
        played.source.keypoints, words='words of all'))
    played.check()
    (source, target, pose, predicted, (known, *of), moving), = played.refined
    assert predicted is None and known == 'known tracks' and moving is played.found.tracks
    for asked, expected in zip(of, (played.source, played.target, EXPECTED)):
        assert asked is expected
    np.testing.assert_array_equal(of[3], REST)
    assert source.keypoints.words is None  # they are by rows of all keypoints
    assert target is played.target and pose is EXPECTED and source.frame is played.source.frame
    for name in ('positions', 'descriptors', 'covariances', 'pixels'):
        np.testing.assert_array_equal(getattr(source.keypoints, name),
                                      getattr(played.source.keypoints, name)[REST])


def test_where_no_tracks_confirmed_it_all_keypoints_are_left(play):
    played = play()
    played.found = dataclasses.replace(played.found, tracks=None)
    played.check()
    np.testing.assert_array_equal(played.refined[0][0].keypoints.pixels,
                                  played.source.keypoints.pixels)


def test_the_view_votes_on_both_poses_and_the_second_replaces_all(play):
    played = play()
    checked, second, refined = played.check(), played.second(), played.answers[0]
    (source, target, first, other, sensor), = played.voted
    assert source is played.source and target is played.target
    assert first is played.found.T_target_source and sensor is played.settings.sensor
    np.testing.assert_allclose(other, second.matrix, atol=1e-12)
    np.testing.assert_allclose(checked.T_target_source, second.matrix, atol=1e-12)
    np.testing.assert_allclose(checked.covariance, second.covariance, rtol=1e-9)
    assert not checked.systematic.any() and checked.measure is None
    assert checked.bias is refined.bias and checked.matches.shape == (0, 2)
    np.testing.assert_array_equal(checked.tracks.keypoints, REST[refined.tracked.keypoints])
    assert checked.tracks.points is refined.tracked.points
    assert (checked.support, checked.evidence) == (30, Evidence.DEPTH)
    assert checked.reason == ('70 keypoints move by themselves, 100% of the view shows another '
                              'motion')


@pytest.mark.parametrize('tracked, is_by_depth', [(12, False), (11, True)])
def test_with_few_other_keypoints_the_depth_images_decide_alone(play, tracked, is_by_depth):
    """Which have no bias against keypoints then."""
    played = play(tracked=(tracked, 0))
    checked = played.check()
    assert len(played.refined) == 1 + is_by_depth
    assert checked.bias == (None if is_by_depth else 'bias 12')
    if is_by_depth:
        source, target, pose, _, tracks, moving = played.refined[1]
        assert tracks is None  # none that are known
        assert moving is played.found.tracks  # whose depth has no part
        assert len(source.keypoints) == 0 and source.frame is played.source.frame
        assert target is played.target and pose is EXPECTED
        assert checked.support == len(checked.tracks.keypoints) == 0
        np.testing.assert_allclose(checked.T_target_source, played.second(1).matrix, atol=1e-12)


def test_where_the_view_does_not_decide_the_choice_adds_its_variance(play):
    """By the share of the votes for the second pose."""
    played = play(vote=PoseVote(0.3, 0.1, 1.0))
    checked = played.check()
    difference = se3.difference(played.found.T_target_source, played.second().matrix)
    np.testing.assert_allclose(
        checked.covariance, played.found.covariance + 0.25 * np.outer(difference, difference))
    assert checked.T_target_source is played.found.T_target_source
    assert checked.systematic is played.found.systematic


def test_a_second_pose_that_is_the_same_is_not_voted_on(play):
    """Within 15 mm and 0.8 degrees."""
    for away, is_same in ((0.014, True), (0.016, False)):
        played = play()
        moved = played.second().matrix @ se3.exp([away, 0, 0, 0, 0, 0])
        played.found = dataclasses.replace(played.found, T_target_source=moved)
        played.opinion._sudden = np.array([1e-3, 1e-3])
        assert (played.check() is played.found) == is_same
        assert bool(played.voted) != is_same


@pytest.mark.parametrize('which', ['source', 'target'])
def test_it_is_not_checked_where_one_frame_has_no_surface(play, which):
    played = play()
    blind = dataclasses.replace(getattr(played, which), surface=None)
    assert played.check(**{which: blind}) is played.found and not played.refined


def test_nor_between_two_resolutions(play, made):
    played = play()
    other = made.prepared(2, size=(20, 24), surface='a surface')
    assert played.check(source=other) is played.found and not played.refined


@pytest.mark.parametrize('factor, is_checked', [(0.999, False), (1.001, True)])
def test_what_is_checked_is_sudden_by_the_motion_model(play, factor, is_checked):
    """By five of its accelerations: 15 cm in a tenth of a second."""
    played = play()
    limit = 5 * played.settings.odometry.acceleration_sigma * ELAPSED ** 2
    assert limit == pytest.approx(0.15)
    played.found = dataclasses.replace(
        played.found, T_target_source=EXPECTED @ se3.exp([factor * limit, 0, 0, 0, 0, 0]))
    played.check()
    assert bool(played.refined) == is_checked


SLIGHTLY = np.array([0.06, 0.02, 0.0, 0.01, 0.02, 0.01])
"""Error of a registration that is not sudden."""


def contradicted(play, made, *better, error=SLIGHTLY, nearer=(0.0, 70)):
    """Return a check of a registration that depth contradicts, by whether others are better."""
    played = play()
    played.is_lost, played.better = True, list(better)
    away, tracked = nearer
    played.nearer = dataclasses.replace(
        made.refined(tracked, bias='bias of all', measure=pytest.fail),
        T_target_source=played.answers[0].T_target_source @ se3.exp([away, 0, 0, 0, 0, 0]))
    played.found = dataclasses.replace(played.found, covariance=1e-6 * np.eye(6),
                                       T_target_source=se3.perturbed(EXPECTED, error))
    played.answers[0] = dataclasses.replace(played.answers[0], covariance=2e-6 * np.eye(6))
    return played


@pytest.mark.parametrize('error', [SLIGHTLY, AWAY], ids=['slow', 'sudden'])
def test_where_depth_contradicts_keypoints_those_that_agree_with_it_decide(play, made, error):
    """However slow the motion is; all keypoints near the pose of the rest make it better."""
    played = contradicted(play, made, True, True, error=error)
    checked = played.check()
    assert played.lost_by == 2 * [(played.found, played.target)] and not played.voted
    (source, target, pose), = played.near
    assert source is played.source and target is played.target
    assert pose is played.answers[0].T_target_source
    nearer = played.nearer
    assert checked.T_target_source is nearer.T_target_source
    assert checked.covariance is nearer.covariance and checked.systematic is nearer.systematic
    assert checked.tracks is nearer.tracked and checked.support == 70
    assert checked.bias == 'bias of all' and checked.measure is None
    assert checked.matches.shape == (0, 2) and checked.evidence is Evidence.KEYPOINTS
    assert checked.reason == '70 keypoints move by themselves, depth agrees with 70 others'


@pytest.mark.parametrize('error, support, is_found', [
    (0.06, 299, True), (0.06, 301, False), (0.13, 301, True)],
    ids=['more than few', 'few', 'few, off the motion expected'])
def test_few_that_agree_with_depth_replace_no_motion_that_is_expected(
        play, made, error, support, is_found):
    """Thirty of three hundred may agree with depth by chance."""
    played = contradicted(play, made, True, True, error=np.array([error, 0, 0, 0, 0, 0]))
    played.found = dataclasses.replace(played.found, support=support)
    assert ('depth agrees with 70 others' in played.check().reason) == is_found


@pytest.mark.parametrize('squared, is_found', [(22.3, True), (22.6, False)])
def test_poses_that_differ_by_their_errors_show_no_object(play, made, squared, is_found):
    """Errors of six values exceed 22.46 once in a thousand times."""
    played = contradicted(play, made, True, True)
    pose = played.answers[0].T_target_source.copy()
    pose[0, 3] += np.sqrt(squared * 3e-6)
    played.found = dataclasses.replace(played.found, T_target_source=pose)
    assert (played.check() is played.found) == is_found


@pytest.mark.parametrize('away, is_better, is_taken', [
    (0.014, True, True), (0.016, True, False), (0.0, False, False)])
def test_all_keypoints_count_if_they_lead_to_the_same_pose(play, made, away, is_better, is_taken):
    """Within 15 mm, and if depth agrees with them as well."""
    played = contradicted(play, made, True, is_better, nearer=(away, 70))
    taken = played.nearer if is_taken else played.answers[0]
    assert played.check().T_target_source is taken.T_target_source


@pytest.mark.parametrize('error, is_voted_on', [(SLIGHTLY, False), (AWAY, True)])
def test_where_no_others_agree_the_view_decides_on_sudden_motions(play, made, error, is_voted_on):
    played = contradicted(play, made, False, error=error)
    checked = played.check()
    assert bool(played.voted) == is_voted_on and not played.near
    assert (checked is played.found) != is_voted_on


def test_a_motion_that_depth_does_not_contradict_is_not_refined_again(play, made):
    played = contradicted(play, made)
    played.is_lost = False
    assert played.check() is played.found and not played.refined


@pytest.mark.parametrize('count, has_objects, is_better, is_taken', [
    (35, True, True, True), (34, True, True, False), (70, False, True, False),
    (70, True, False, False)])
def test_a_few_keypoints_that_depth_contradicts_a_motion_by_are_left_out(
        play, made, count, has_objects, is_better, is_taken):
    """If half of those found are left, and depth agrees far better with them."""
    played = contradicted(play, made, *([is_better, False] if has_objects and count > 34
                                        else [False]))
    share = 0.9 if has_objects else 1.0
    played.without_small = made.refined(count, fit=Fit(np.ones(count), share))
    found = played.found
    checked = played.check()
    (source, target, pose), = played.small
    assert source is played.source and target is played.target and pose is found.T_target_source
    if is_taken:
        assert checked.T_target_source is played.without_small.T_target_source
        assert checked.reason == found.reason and checked.support == count
    else:
        assert checked is found


def on_known_objects(play, made, share, rest, tracked=3):
    """Return a check of a motion that objects explain which have moved before."""
    played = play(tracked=(tracked, tracked))
    played.answers = [dataclasses.replace(each, fit=rest) for each in played.answers]
    played.found = dataclasses.replace(
        played.found, T_target_source=se3.perturbed(EXPECTED, SLIGHTLY),
        fit=Fit(np.ones(70), 1.0, share))
    return played


def test_the_motion_of_what_has_moved_before_is_not_believed(play, made):
    """The pose of the rest replaces it, with that of the motion model: few keypoints show it."""
    played = on_known_objects(play, made, 0.71, Fit(np.ones(3), 0.03, 0.29))
    checked = played.check()
    second = played.second(1)
    np.testing.assert_allclose(checked.T_target_source, second.matrix, atol=1e-12)
    np.testing.assert_allclose(checked.covariance, second.covariance, rtol=1e-9)
    assert not played.voted and checked.evidence is Evidence.DEPTH and checked.measure is None
    assert checked.reason == '70 keypoints are on what has moved before'


@pytest.mark.parametrize('sigma, differs', [(0.001, True), (0.1, False)])
def test_only_two_motions_that_differ_show_that_objects_move(play, made, sigma, differs):
    """Else nothing is known of objects, though the images vote for the other motion."""
    now = objects(70)
    rest = Fit(np.ones(3), 0.5, objects=now)
    played = play(tracked=(11, 0))
    played.answers = [dataclasses.replace(each, fit=rest, covariance=sigma ** 2 * np.eye(6))
                      for each in played.answers]
    played.found = dataclasses.replace(played.found, covariance=1e-8 * np.eye(6),
                                       fit=Fit(np.ones(70), 1.0, 0.0))
    checked = played.check()
    assert checked.evidence is Evidence.DEPTH
    assert checked.fit.objects == (now if differs else None)
    assert checked.fit.scene_share == 0.5


@pytest.mark.parametrize('shift, known, aside, is_shown', [
    (0.0, 0.0, 59, False), (0.0, 0.0, 60, True), (0.0, 1.0, 59, True), (0.05, 0.0, 59, True)],
    ids=['as the scene', 'few of them', 'as the scene, known', 'by itself'])
def test_what_moves_with_the_scene_is_no_object(play, shift, known, aside, is_shown):
    """
    Its keypoints may have been put aside by noise; what has moved before may be slow now.

    Few keypoints of the scene beside an object say nothing about it.
    """
    found = objects(aside)
    played = play()
    rest = se3.perturbed(EXPECTED, np.array([shift, 0, 0, 0, 0, 0]))
    played.answers = [dataclasses.replace(
        played.answers[0], T_target_source=rest, covariance=1e-6 * np.eye(6), bias=None,
        fit=Fit(np.ones(30), 0.5, known))]
    played.found = dataclasses.replace(
        played.found, T_target_source=EXPECTED, covariance=1e-6 * np.eye(6), bias=None,
        fit=Fit(np.ones(70), 0.9, 0.0, found))
    checked = played.check()
    np.testing.assert_array_equal(checked.T_target_source, EXPECTED)
    assert checked.fit.objects is (found if is_shown else None)


@pytest.mark.parametrize('off, before, moves', [
    (AWAY, 140, True), (AWAY, 141, False), (SLIGHTLY, 140, False)],
    ids=['it moves', 'a small part moves', 'it moves slightly'])
def test_what_has_moved_before_moves_still_if_it_differs_from_the_motion_expected(
        play, made, off, before, moves):
    """Before a wall depth does not show it; else it stays known as long as it was."""
    now, known = objects(70), objects(before)
    rest = Fit(np.ones(3), 0.5, objects=now)
    played = on_known_objects(play, made, 1.0, rest)
    played.answers = [dataclasses.replace(each, fit=rest, covariance=0.3 ** 2 * np.eye(6))
                      for each in played.answers]
    played.found = dataclasses.replace(
        played.found, T_target_source=se3.perturbed(EXPECTED, off), covariance=1e-8 * np.eye(6),
        fit=Fit(np.ones(70), 1.0, 1.0, known))
    checked = played.check()
    assert checked.evidence is Evidence.DEPTH
    assert checked.fit.objects is (now if moves else known)
    assert checked.fit.scene_share == 0.5


@pytest.mark.parametrize('off, elapsed, is_rejected', [
    (0.06, 0.1, False), (0.06, 0.101, True), (0.13, 0.1, True)],
    ids=['it continues the motion', 'for long', 'it moves'])
def test_where_only_what_has_moved_before_is_in_the_view_the_frame_is_lost(
        play, made, off, elapsed, is_rejected):
    played = on_known_objects(play, made, 1.0, None)
    played.found = dataclasses.replace(
        played.found, T_target_source=se3.perturbed(EXPECTED, np.array([off, 0, 0, 0, 0, 0])),
        covariance=1e-8 * np.eye(6))
    checked = played.opinion.check(played.found, played.source, played.target,
                                   ExpectedPose(EXPECTED, elapsed))
    assert checked.status.ok is not is_rejected
    if is_rejected:
        assert checked.reason == ('70 keypoints are on what has moved before, nothing else shows '
                                  'the motion')


@pytest.mark.parametrize('share, rest', [
    (0.69, Fit(np.ones(3), 0.5)), (1.0, Fit(np.ones(3), 0.01)), (1.0, Fit(np.ones(3), 0.5, 0.31)),
    (1.0, None)])
def test_it_is_where_little_shows_another_motion(play, made, share, rest):
    played = on_known_objects(play, made, share, rest)
    assert played.check() is played.found


@pytest.mark.parametrize('known, is_taken', [(0.69, True), (0.71, False)])
def test_what_has_moved_before_is_not_the_scene_though_depth_agrees_with_it(play, made, known,
                                                                            is_taken):
    """As where a small part of an object makes depth contradict the motion of the camera."""
    played = contradicted(play, made, True, True)
    played.answers = [dataclasses.replace(played.answers[0], fit=Fit(np.ones(30), 0.5, known))]
    played.without_small = made.refined(0)
    checked = played.check()
    assert (checked is not played.found) == is_taken


def test_where_both_are_on_what_has_moved_before_depth_decides_without_keypoints(play, made):
    played = on_known_objects(play, made, 1.0, Fit(np.ones(30), 0.5, 1.0), tracked=30)
    played.answers[1] = dataclasses.replace(played.answers[1], fit=Fit(np.ones(0), 0.5),
                                            tracked=made.tracks(0))
    checked = played.check()
    assert len(played.refined) == 2 and len(played.refined[1][0].keypoints) == 0
    np.testing.assert_allclose(checked.T_target_source, played.second(1).matrix, atol=1e-12)


@pytest.mark.parametrize('shift, is_scene', [(0.0, True), (0.2, False)],
                         ids=['as expected', 'suddenly'])
def test_of_what_has_moved_before_that_which_moves_as_expected_is_the_scene(
        play, shift, is_scene):
    """Where a board hides most of a room, keypoints of the rest are near to those on the board."""
    rest = se3.perturbed(EXPECTED, np.array([shift, 0, 0, 0, 0, 0]))
    played = play(tracked=(12, 0))
    played.answers[0] = dataclasses.replace(
        played.answers[0], T_target_source=rest, covariance=1e-6 * np.eye(6), bias=None,
        fit=Fit(np.ones(12), 0.01, 1.0))
    played.answers[1] = dataclasses.replace(played.answers[1], fit=Fit(np.ones(0), 0.01))
    played.found = dataclasses.replace(played.found, covariance=1e-6 * np.eye(6), bias=None,
                                       fit=Fit(np.ones(300), 1.0, 1.0))
    checked = played.check()
    assert len(played.refined) == (1 if is_scene else 2)  # once more by depth alone
    if is_scene:
        assert checked.reason == '70 keypoints are on what has moved before'
        np.testing.assert_allclose(checked.T_target_source, rest, atol=1e-3)


def beside(play, made, off, shift, confirmed=30):
    """Return a check of a motion, and of that of the tracks on nothing that has moved before."""
    played = play()
    played.scene = dataclasses.replace(
        made.refined(confirmed), covariance=1e-6 * np.eye(6),
        T_target_source=se3.perturbed(EXPECTED, np.array([shift, 0, 0, 0, 0, 0])))
    played.found = dataclasses.replace(
        played.found, T_target_source=se3.perturbed(EXPECTED, off), covariance=1e-6 * np.eye(6))
    return played


def test_where_only_what_has_not_moved_before_continues_the_motion_it_is_the_scene(play, made):
    """One motion of the camera may fit a poster that moves, and a wall behind it, too."""
    played = beside(play, made, AWAY, 0.001)
    checked = played.check()
    assert not played.refined and not played.voted
    (source, target, pose), = played.beside
    assert source is played.source and target is played.target and pose is EXPECTED
    assert checked.T_target_source is played.scene.T_target_source
    assert checked.covariance is played.scene.covariance and checked.measure is None
    assert checked.reason == '30 keypoints beside what has moved before continue the motion'


def test_where_little_else_is_in_the_view_what_has_moved_before_may_be_the_scene(play, made):
    """If it moves as expected, and what is found does not; the reason says what shows it."""
    played = beside(play, made, AWAY, 0.001)
    played.scene = dataclasses.replace(played.scene, fit=Fit(np.ones(30), 1.0, 0.9))
    checked = played.check()
    assert checked.T_target_source is played.scene.T_target_source
    assert checked.reason == ('30 keypoints (few of them beside what has moved before) continue '
                              'the motion')


def assert_as_without_a_memory(played):
    """Assert that a check has the result that it has where nothing has moved before."""
    checked, count = played.check(), len(played.refined)
    played.scene = None
    played.refined.clear()
    expected = played.check()
    assert len(played.refined) == count and checked.reason == expected.reason
    np.testing.assert_array_equal(checked.T_target_source, expected.T_target_source)
    np.testing.assert_array_equal(checked.covariance, expected.covariance)


@pytest.mark.parametrize('off, shift, confirmed', [
    (0.01 * AWAY, 0.001, 30), (AWAY, 0.3, 30), (AWAY, 0.001, 11)],
    ids=['both continue it', 'neither does', 'too few'])
def test_otherwise_what_moves_is_found_as_without_a_memory(play, made, off, shift, confirmed):
    """As where the camera itself is pushed."""
    assert_as_without_a_memory(beside(play, made, off, shift, confirmed))


def test_nor_is_it_the_scene_where_depth_contradicts_it(play, made):
    played = beside(play, made, AWAY, 0.001)
    contradicted_pose = played.scene.T_target_source
    played.opinion._agreement.is_lost_by = lambda found, target: (
        found.T_target_source is contradicted_pose)
    assert_as_without_a_memory(played)


def test_a_motion_of_which_nothing_is_known_is_compared_without_a_prior(play):
    """As of a pair without stamps that tell: the time since its velocity was measured is inf."""
    played = play()
    played.is_lost, played.better = True, [False]
    found = played.opinion.check(played.found, played.source, played.target,
                                 ExpectedPose(EXPECTED).checked())
    assert found is played.found and played.refined


@pytest.mark.parametrize('away, is_found', [(0.008, True), (0.02, False)])
def test_of_two_confirmed_motions_only_one_that_differs_replaces_the_first(
        play, made, monkeypatch, away, is_found):
    """All evidence is for the second one, by four times the keypoints."""
    played = play()
    played.found = dataclasses.replace(
        played.found, covariance=2e-6 * np.eye(6), fit=Fit(np.ones(20), 0.5),
        T_target_source=played.answers[0].T_target_source @ se3.exp([away, 0, 0, 0, 0, 0]))
    played.answers[0] = dataclasses.replace(played.answers[0], covariance=2e-6 * np.eye(6))
    monkeypatch.setattr('aick_ros.registration.dynamic_objects.TwoMotions.of',
                        lambda *of: TwoMotions(20, 80, 1.0))
    played.better = [True]
    checked = played.check()
    assert ('others with the scene' in checked.reason) != is_found
