# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Motions along a wall whose picture repeats itself: the images fit several of them."""

import dataclasses
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.apparent_acceleration import ApparentAcceleration
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.repeating_scene import RepeatingSceneCheck
from aick_ros.registration.result import Evidence, Fit, SensorBias
from aick_ros.registration.sensor_agreement import SensorAgreement
from aick_ros.registration.two_motions import TwoMotions
from aick_ros.settings import Settings

SETTINGS = Settings()
CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
DEPTH, PERIOD = 2.0, 0.4  # of the wall [m]
MOVED = 0.03  # m
TRUTH = se3.exp([MOVED, 0, 0, 0, 0, 0])
ONE_ON = se3.exp([PERIOD, 0, 0, 0, 0, 0])
AGREEMENT = SensorAgreement(MeasuredNoise())
SLOW = 0.25  # s between frames: an acceleration of 3 m/s^2 moves a camera by 9.4 cm


def wall(x):
    """Return a view of a picture that repeats itself, with the camera at a place [m]."""
    rng = np.random.default_rng(3)
    period = round(PERIOD / DEPTH * 4 * CAMERA.fx)
    tile = cv2.GaussianBlur(rng.uniform(0, 255, (960, period, 3)), (0, 0), 4.0)
    tile = cv2.normalize(np.tile(tile, (1, 8, 1)), None, 0, 255, cv2.NORM_MINMAX, cv2.CV_8U)
    shift = 4 * CAMERA.fx * x / DEPTH
    seen = cv2.warpAffine(tile, np.float32([[1, 0, -period - shift], [0, 1, 0]]), (1280, 960))
    depth = DEPTH + rng.normal(0, 0.002, (240, 320)).astype(np.float32)
    return RgbdFrame(round(1e9 * (x + 1)), cv2.resize(seen, (320, 240),
                                                      interpolation=cv2.INTER_AREA), depth, CAMERA)


@pytest.fixture(scope='module')
def views():
    """Return the prepared target and source, and registrations by the pose they begin with."""
    registrar, refinement = Registrar(), Refinement(SETTINGS.refinement, SETTINGS.sensor)
    target, source = (registrar.prepare(wall(x)) for x in (0.0, MOVED))
    some = registrar.register(source, target)

    def found(pose):
        refined = refinement.refine(source, target, pose)
        assert error(refined.T_target_source, pose) < 0.02  # the images confirm it
        return dataclasses.replace(
            some, T_target_source=refined.T_target_source, covariance=refined.covariance,
            support=len(refined.tracked), tracks=refined.tracked, fit=refined.fit)

    return source, target, found


def error(pose, truth):
    return float(np.linalg.norm(se3.difference(pose, truth)))


def check(refinement=None):
    return RepeatingSceneCheck(refinement or Refinement(SETTINGS.refinement, SETTINGS.sensor),
                               SETTINGS.odometry, AGREEMENT,
                               ApparentAcceleration(SETTINGS.odometry)).check


@pytest.mark.parametrize('elapsed', [1 / 30, SLOW])
def test_of_poses_that_the_same_keypoints_confirm_the_likelier_one_is_returned(views, elapsed):
    """By the images alone the camera may have moved by one period more, sudden or not."""
    source, target, found = views
    expected = se3.exp([0.01, 0.005, 0, 0, 0, 0])
    checked = check()(found(ONE_ON @ TRUTH), source, target, ExpectedPose(expected, elapsed))
    assert error(checked.T_target_source, TRUTH) < 0.02
    assert 'repeats itself after 0.40 m' in checked.reason
    assert checked.support == len(checked.tracks)
    assert np.sqrt(checked.covariance[0, 0]) < 0.02


def test_a_motion_near_the_one_expected_is_not_checked(views):
    source, target, found = views
    mistaken = found(ONE_ON @ TRUTH)
    expected = ONE_ON @ TRUTH @ se3.exp([0.04, 0, 0, 0, 0.04, 0])
    assert check()(mistaken, source, target, ExpectedPose(expected, SLOW)) is mistaken


@pytest.mark.parametrize('beside, is_checked', [
    ([0.049, 0, 0, 0, 0, 0], False), ([0.051, 0, 0, 0, 0, 0], True),
    ([0, 0, 0, 0, np.radians(2.9), 0], False), ([0, 0, 0, 0, np.radians(3.1), 0], True)])
def test_a_motion_is_checked_from_five_centimetres_or_three_degrees_on(views, beside, is_checked):
    """After a second, in which neither is sudden."""
    source, target, found = views
    asked = []
    refinement = Refinement(SETTINGS.refinement, SETTINGS.sensor)
    noted = SimpleNamespace(refine=lambda *of: asked.append(of) or refinement.refine(*of))
    check(noted)(found(TRUTH), source, target, ExpectedPose(TRUTH @ se3.exp(beside), 1.0))
    assert bool(asked) == is_checked


@pytest.fixture
def beyond(views):
    """Return a refinement that finds the pose one period on, wherever it begins."""
    source, target, _ = views
    refined = Refinement(SETTINGS.refinement, SETTINGS.sensor).refine(
        source, target, ONE_ON @ TRUTH)
    return SimpleNamespace(refine=lambda *_: refined)


def test_the_likelier_pose_is_that_of_the_smaller_acceleration(views, beyond):
    """The registration is kept unless the pose beside it is far likelier."""
    source, target, found = views
    kept = found(TRUTH)
    expected = se3.exp([MOVED + 0.06, 0, 0, 0, 0, 0])
    checked = check(refinement=beyond)(kept, source, target, ExpectedPose(expected, SLOW))
    np.testing.assert_array_equal(checked.T_target_source, kept.T_target_source)
    assert 'repeats itself' in checked.reason
    assert np.sqrt(checked.covariance[0, 0]) < 0.02


@pytest.mark.parametrize('more, is_rejected', [(1, True), (0, False)])
def test_few_keypoints_are_not_believed_beside_more_that_depth_contradicts(
        views, beyond, more, is_rejected):
    """A few find some motion by which wrong depths agree; the rest goes on as expected."""
    source, target, found = views
    refined = dataclasses.replace(beyond.refine(), is_contradicted=True)
    kept = dataclasses.replace(found(TRUTH), support=len(refined.tracked) - more)
    checked = check(SimpleNamespace(refine=lambda *_: refined))(
        kept, source, target, ExpectedPose(ONE_ON @ TRUTH, SLOW))
    assert ('contradict each other' in checked.reason) == is_rejected
    assert checked.status.ok != is_rejected
    unconfirmed = dataclasses.replace(kept, tracks=None, support=1000)  # matches alone
    assert not check(SimpleNamespace(refine=lambda *_: refined))(
        unconfirmed, source, target, ExpectedPose(ONE_ON @ TRUTH, SLOW)).status.ok


def test_where_the_motion_model_does_not_decide_the_covariance_has_both_poses(views, beyond):
    """Half-way between two of them either is as likely: its variance is half the difference's."""
    source, target, found = views
    halfway = se3.exp([MOVED + 0.5 * PERIOD, 0, 0, 0, 0, 0])
    checked = check(refinement=beyond)(found(TRUTH), source, target, ExpectedPose(halfway, SLOW))
    assert checked.covariance[0, 0] == pytest.approx(0.5 * PERIOD ** 2, rel=0.3)
    for pose in (TRUTH, ONE_ON @ TRUTH):
        difference = se3.difference(checked.T_target_source, pose)
        assert difference @ np.linalg.solve(checked.covariance, difference) < 12.6


def test_a_motion_that_begins_with_a_slip_does_not_go_on_slipping(views):
    """The first motion seems to be one period a frame; the next frame is right, and is kept."""
    source, target, found = views
    shown = ApparentAcceleration(SETTINGS.odometry)
    tester = RepeatingSceneCheck(Refinement(SETTINGS.refinement, SETTINGS.sensor),
                                 SETTINGS.odometry, AGREEMENT, shown)
    slipped = dataclasses.replace(found(TRUTH), T_target_source=se3.inverse(ONE_ON))
    shown.note(target.stamp, slipped, ExpectedPose(np.eye(4), SLOW))
    kept = tester.check(found(TRUTH), source, target, ExpectedPose(ONE_ON @ TRUTH, SLOW))
    assert error(kept.T_target_source, TRUTH) < 0.02
    difference = se3.difference(kept.T_target_source, ONE_ON @ TRUTH)
    assert difference @ np.linalg.solve(kept.covariance, difference) < 12.6
    again = tester.check(found(TRUTH), source, target, ExpectedPose(ONE_ON @ TRUTH, SLOW))
    np.testing.assert_array_equal(again.T_target_source, kept.T_target_source)


def test_of_two_poses_the_one_that_more_keypoints_confirm_is_returned(views):
    source, target, found = views
    mistaken = found(ONE_ON @ TRUTH)
    few = mistaken.tracks[np.arange(18)]
    few = dataclasses.replace(few, keypoints=few.keypoints + len(source.keypoints))
    mistaken = dataclasses.replace(mistaken, tracks=few, support=len(few), fit=None)
    checked = check()(mistaken, source, target, ExpectedPose(np.eye(4), SLOW))
    assert error(checked.T_target_source, TRUTH) < 0.02
    assert checked.support > 100
    np.testing.assert_array_equal(
        check()(dataclasses.replace(mistaken, support=1000), source, target,
                ExpectedPose(np.eye(4), SLOW)).T_target_source, mistaken.T_target_source)


EXPECTED = se3.exp([0.1, 0.0, 0.0, 0.0, 0.0, 0.1])
SIGMAS = np.repeat([SETTINGS.odometry.acceleration_sigma,
                    SETTINGS.odometry.angular_acceleration_sigma], 3)
AWAY = np.array([0.2, 0.1, -0.1, 0.1, 0.05, 0.02])
"""Error of a registration, by which it is checked."""


BIAS = SensorBias(np.zeros(6), np.eye(6), np.zeros((6, 6)), np.eye(6))


def fit_of(tracked):
    """Return the fit of so many keypoints, with an error that is usual."""
    return Fit(np.full(tracked, 0.5), 0.6)


class Played:
    """A check whose refinement has a known answer, and two frames."""

    def __init__(self, made, beside, tracked=60):
        self.made, self.asked = made, []
        self.other = dataclasses.replace(
            made.refined(tracked, bias=BIAS, measure=self._measure, fit=fit_of(tracked)),
            T_target_source=se3.perturbed(EXPECTED, np.asarray(beside)))
        self.measured = 0
        self.scene = RepeatingSceneCheck(SimpleNamespace(
            refine=lambda *given: self.asked.append(given) or self.other), SETTINGS.odometry,
            SimpleNamespace(is_lost_by=lambda *of: self.lost_by.append(of) or self.is_lost,
                            is_better_by=lambda *of: self.better_by.append(of) or self.is_better,
                            is_only_by=lambda *of: self.only_by.append(of) or self.is_only),
            SimpleNamespace(sigmas=self.sigmas_of))
        self.uncertain, self.shown = [], np.zeros(6)
        self.lost_by, self.better_by, self.is_lost, self.is_better = [], [], False, True
        self.only_by, self.is_only = [], False
        self.target, self.source = made.prepared(10 ** 9), made.prepared(11 * 10 ** 8)

    def sigmas_of(self, stamp, expected):
        self.uncertain.append((stamp, expected.elapsed))
        return self.sigmas(expected.elapsed)

    def sigmas(self, elapsed):
        return 0.5 * elapsed ** 2 * np.hypot(SIGMAS, self.shown)

    def _measure(self):
        self.measured += 1
        return 'a noise', 'a shift'

    def found(self, error=AWAY, tracked=60, **values):
        """Return a registration with an error against the motion expected, by its tracks."""
        return dataclasses.replace(
            self.made.registration(count=tracked), T_target_source=se3.perturbed(EXPECTED, error),
            tracks=self.made.tracks(tracked), **{'fit': fit_of(tracked), **values})

    def check(self, found, elapsed=SLOW, source=None):
        return self.scene.check(found, source or self.source, self.target,
                                ExpectedPose(EXPECTED, elapsed))


def probabilities(errors, elapsed, shown=np.zeros(6)):
    """Return the probability of each error, by the normal density of its acceleration."""
    sigmas = 0.5 * elapsed ** 2 * np.hypot(SIGMAS, shown)
    densities = [np.exp(-0.5 * np.sum((error / sigmas) ** 2)) for error in errors]
    return np.array(densities) / sum(densities)


def test_it_is_refined_once_more_from_the_motion_expected(made):
    played = Played(made, np.zeros(6))
    played.check(played.found())
    (source, target, pose), = played.asked
    assert source is played.source and target is played.target and pose is EXPECTED


@pytest.mark.parametrize('error, elapsed, is_checked', [
    ([0.0149, 0, 0, 0, 0, 0], 0.0316228, False), ([0.0151, 0, 0, 0, 0, 0], 0.0316228, True),
    ([0.0499, 0, 0, 0, 0, 0], 1.0, False), ([0.0501, 0, 0, 0, 0, 0], 1.0, True),
    ([0, 0, 0, 0, np.radians(2.99), 0], 1.0, False),
    ([0, 0, 0, 0, np.radians(3.01), 0], 1.0, True)])
def test_a_small_motion_is_checked_where_it_is_sudden(made, error, elapsed, is_checked):
    """15 m/s^2, five times the noise of 3, move a camera by 15 mm in 32 ms; else from 5 cm on."""
    assert SIGMAS[0] == 3.0
    played = Played(made, np.zeros(6))
    played.check(played.found(np.array(error)), elapsed)
    assert bool(played.asked) == is_checked


def test_frames_of_two_resolutions_are_not_compared(made):
    played = Played(made, np.zeros(6))
    found = played.found()
    assert played.check(found, source=made.prepared(11 * 10 ** 8, size=(20, 24))) is found
    assert played.asked == []


def test_what_is_refined_to_the_same_pose_stays(made):
    played = Played(made, AWAY + np.array([0.014, 0, 0, 0, 0, 0]))
    found = played.found()
    assert played.check(found) is found and played.asked
    assert played.measured == 0  # what shows the camera's noise is not asked for


@pytest.mark.parametrize('beside', [[0.1, 0, 0, 0, 0.1, 0], AWAY + 0.3])
def test_of_two_poses_the_covariance_has_the_variance_of_the_choice(made, beside):
    """By the probability of the other one; it is the first, unless that is far less likely."""
    played = Played(made, beside)
    found = played.found()
    checked = played.check(found, 0.4)
    first, second = probabilities([AWAY, np.array(beside)], 0.4)
    assert 0.0 < second < 0.9
    difference = se3.difference(found.T_target_source, played.other.T_target_source)
    np.testing.assert_allclose(
        checked.covariance, found.covariance + second * np.outer(difference, difference),
        rtol=1e-6)
    assert checked.T_target_source is found.T_target_source
    assert checked.reason == ('as told; the scene repeats itself after '
                              f'{np.linalg.norm(difference[:3]):.2f} m')


@pytest.mark.parametrize('is_lost, is_better', [(True, True), (True, False), (False, True)])
def test_a_pose_where_keypoints_and_depth_agree_replaces_one_where_they_do_not(
        made, is_lost, is_better):
    """However few keypoints confirm it, and however unlikely the motion expected is."""
    played = Played(made, AWAY + 0.3, tracked=20)
    played.is_lost, played.is_better = is_lost, is_better
    found = played.found()
    checked = played.check(found, 0.4)
    assert played.lost_by == [(found, played.target)]
    assert played.better_by == ([(played.other, found)] if is_lost else [])
    if is_lost and is_better:
        assert checked.T_target_source is played.other.T_target_source
        assert checked.covariance is played.other.covariance
        assert checked.tracks is played.other.tracked and checked.support == 20
        assert checked.reason == 'as told; 20 tracked where the motion continues'
    else:
        assert checked.T_target_source is found.T_target_source


def test_a_pose_where_alone_keypoints_and_depth_agree_stays(made):
    """However many more keypoints confirm the one expected, as those of an object that passes."""
    played = Played(made, np.zeros(6), tracked=90)
    played.is_only = True
    found = played.found()
    assert played.check(found, 0.26) is found
    assert played.only_by == [(found, played.other, played.target)]
    played.is_only = False
    assert played.check(found, 0.26).T_target_source is played.other.T_target_source


def test_a_far_likelier_pose_replaces_all_of_a_registration(made):
    played = Played(made, np.array([0.05, 0, 0, 0.01, 0, 0]), tracked=50)
    found = played.found()
    checked, other = played.check(found, 0.26), played.other
    first, second = probabilities([AWAY, np.array([0.05, 0, 0, 0.01, 0, 0])], 0.26)
    assert 0.9 < second < 0.999
    assert checked.T_target_source is other.T_target_source
    difference = se3.difference(found.T_target_source, other.T_target_source)
    np.testing.assert_allclose(
        checked.covariance, other.covariance + first * np.outer(difference, difference),
        rtol=1e-6)
    for name in ('systematic', 'bias', 'measure'):
        assert getattr(checked, name) is getattr(other, name) is not None
    assert checked.tracks is other.tracked and checked.support == 50
    assert len(checked.matches) == 0 and checked.matches.shape[1] == 2
    assert checked.reason.startswith('as told; 50 tracked where the motion continues; the scene')


@pytest.mark.parametrize('common, is_alike', [(18, True), (17, False)])
def test_poses_are_alike_if_three_of_ten_keypoints_confirm_both_as_well(made, common, is_alike):
    played = Played(made, np.zeros(6))
    found = played.found()
    found.tracks.keypoints[common:] += 1000
    assert ('repeats itself' in played.check(found).reason) == is_alike


@pytest.mark.parametrize('found, other, common, is_other', [
    (40, 200, 12, True), (20, 300, 6, True), (13, 4, 4, False), (13, 12, 4, False)])
def test_of_unequal_poses_the_one_that_more_keypoints_confirm_is_right_though_few_are_alike(
        made, found, other, common, is_other):
    """Nor are few keypoints alike enough to replace a pose."""
    played = Played(made, np.zeros(6), tracked=other)
    first = played.found(tracked=found)
    first.tracks.keypoints[common:] += 1000
    checked = played.check(first, 0.1 if found == 13 else 0.4)
    assert (checked.tracks is played.other.tracked) == is_other
    assert 'repeats itself' not in checked.reason


@pytest.mark.parametrize('common, is_alike', [(30, True), (29, False)])
def test_poses_are_alike_if_half_of_the_keypoints_confirm_both_though_one_of_them_is_rough(
        made, common, is_alike):
    played = Played(made, np.zeros(6), tracked=40)
    played.other = dataclasses.replace(played.other, fit=Fit(np.full(40, 3.0), 0.6))
    found = played.found()
    found.tracks.keypoints[common:] += 1000
    assert ('repeats itself' in played.check(found).reason) == is_alike


@pytest.mark.parametrize('tracked, support, is_replaced', [
    (61, 60, True), (60, 60, False), (13, 0, True), (12, 0, False)])
def test_where_others_confirm_the_second_pose_they_must_be_more(
        made, tracked, support, is_replaced):
    """By depth a registration has no tracks."""
    played = Played(made, np.zeros(6), tracked)
    found = dataclasses.replace(played.found(), tracks=None, support=support,
                                evidence=Evidence.DEPTH)
    checked = played.check(found)
    if is_replaced:
        assert checked.T_target_source is played.other.T_target_source
        assert checked.covariance is played.other.covariance
        assert checked.evidence is Evidence.KEYPOINTS
        assert checked.reason == f'as told; {tracked} tracked where the motion continues'
    else:
        assert checked is found


def test_the_motion_expected_is_as_uncertain_as_accelerations_have_been(made):
    played = Played(made, [0.1, 0, 0, 0, 0.1, 0])
    played.shown = np.array([20.0, 10.0, 5.0, 20.0, 10.0, 5.0])
    found = played.found()
    added = played.check(found, 0.4).covariance - found.covariance
    assert played.uncertain == [(played.source.stamp, 0.4)]
    difference = se3.difference(found.T_target_source, played.other.T_target_source)
    _, second = probabilities([AWAY, np.array([0.1, 0, 0, 0, 0.1, 0])], 0.4, played.shown)
    assert added[0, 0] / difference[0] ** 2 == pytest.approx(second, rel=1e-6)


def two_motions(played, monkeypatch, first, second, evidence, alike=0):
    """Let two motions be shown; return the registration, and what they were asked for."""
    asked, motions = [], TwoMotions(first, second, evidence, alike)
    monkeypatch.setattr('aick_ros.registration.repeating_scene.TwoMotions', SimpleNamespace(
        of=lambda *of: asked.append(of) or motions))
    found = played.found()
    found.tracks.keypoints[20:] += 1000  # few confirm both
    return found, asked


@pytest.mark.parametrize('evidence, is_replaced', [(0.1, True), (-0.1, False)])
def test_of_two_motions_the_camera_has_the_one_that_the_evidence_is_for(
        made, monkeypatch, evidence, is_replaced):
    played = Played(made, np.zeros(6))
    found, asked = two_motions(played, monkeypatch, 40, 30, evidence)
    checked = played.check(found, 0.4)
    (first, second, expected, sigmas), = asked
    assert first is found and second.tracks is played.other.tracked and expected is EXPECTED
    np.testing.assert_array_equal(sigmas, played.sigmas(0.4))
    assert (checked.tracks is played.other.tracked) == is_replaced
    assert (checked is found) != is_replaced


@pytest.mark.parametrize('less, is_replaced', [(0, True), (1, False)])
def test_a_motion_that_three_of_ten_keypoints_confirm_too_is_judged_by_the_motion_model(
        made, monkeypatch, less, is_replaced):
    """Whatever the evidence is, the scene repeats itself then."""
    played = Played(made, np.zeros(6))
    support = played.found().support
    _, asked = two_motions(played, monkeypatch, 40, 30, -1.0, 3 * support // 10 - less)
    checked = played.check(played.found(), 0.1)
    assert len(asked) == 1
    assert (checked.tracks is played.other.tracked) == is_replaced
    assert ('repeats itself' in checked.reason) == is_replaced


@pytest.mark.parametrize('first, second, is_replaced', [
    (100, 101, True), (100, 16, False), (2, 13, True), (2, 12, False)])
def test_where_few_confirm_one_of_them_the_other_one_is_right(
        made, monkeypatch, first, second, is_replaced):
    """Whatever the evidence is, if keypoints tell two poses apart at all."""
    played = Played(made, np.zeros(6))
    found, _ = two_motions(played, monkeypatch, first, second, 1.0 if first > second else -1.0)
    if first == 100 and second == 101:
        played.other = dataclasses.replace(played.other, is_contradicted=True)
    assert (played.check(found).tracks is played.other.tracked) == is_replaced
