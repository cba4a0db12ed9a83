# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keypoints of one rendered view tracked into another, against the exact motion."""

import dataclasses

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.refinement.measured_noise import MeasuredNoise, Noise
from aick_ros.registration.refinement.refined import CONTRADICTION
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Evidence, Fit
from aick_ros.registration.status import Status
from aick_ros.registration.tracked_keypoints import TrackedKeypoints
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
ERROR = np.array([0.004, -0.003, 0.002, 0.006, -0.005, 0.004])  # of the motion expected [m, rad]
LONG = 1.0  # s; the motion expected may be wrong by much after it


def test_the_motion_is_found_without_keypoints_of_the_source(rendered_views):
    registrar, source, target, motion = rendered_views
    assert len(source.keypoints) == 0
    _, found = registrar.track(source, target, ExpectedPose(se3.perturbed(motion, ERROR), LONG))
    error = se3.difference(found.T_target_source, motion)
    assert found.status.ok and found.iterations == 0
    assert np.linalg.norm(error[:3]) < 0.001 and np.linalg.norm(error[3:]) < 0.001
    assert error @ np.linalg.solve(found.covariance, error) < 30.0


def test_the_source_gets_the_keypoints_where_it_sees_them(rendered_views):
    registrar, source, target, motion = rendered_views
    tracked, found = registrar.track(source, target, ExpectedPose(motion, LONG))
    rows, known = found.matches.T
    assert tracked.is_tracked and len(rows) == len(tracked.keypoints) == found.support
    expected = se3.transform(se3.inverse(motion), target.keypoints.positions[known])
    distances = np.linalg.norm(tracked.keypoints.positions[rows] - expected, axis=1)
    assert np.median(distances) < 0.003
    np.testing.assert_array_equal(tracked.keypoints.descriptors[rows],
                                  target.keypoints.descriptors[known])
    np.testing.assert_array_equal(tracked.keypoints.covariances[rows],
                                  target.keypoints.covariances[known])
    assert tracked.keypoints.stamp == source.stamp != target.stamp
    assert len(known) < len(target.keypoints)  # else it could be any of them in order
    np.testing.assert_allclose(CAMERA.project(tracked.keypoints.positions.astype(float)),
                               tracked.keypoints.pixels, atol=1e-2)


def test_keypoints_of_its_own_are_those_of_a_frame_that_is_not_tracked(rendered_views):
    registrar, source, target, motion = rendered_views
    tracked, _ = registrar.track(source, target, ExpectedPose(motion, LONG))
    own, prepared = registrar.with_own_keypoints(tracked), registrar.prepare(source.frame)
    np.testing.assert_array_equal(own.keypoints.positions, prepared.keypoints.positions)
    assert not own.is_tracked


def test_keypoints_of_its_own_are_found_once(rendered_views):
    registrar, source, target, motion = rendered_views
    found = registrar.with_own_keypoints(source)
    again = registrar.with_own_keypoints(dataclasses.replace(source, twist=np.ones(6)))
    assert again.keypoints is found.keypoints
    assert registrar.with_own_keypoints(target).keypoints is not found.keypoints


@pytest.mark.parametrize('error, is_contradicted', [
    ([0.04, 0.0, 0.0, 0.0, 0.0, 0.0], False), ([0.06, 0.0, 0.0, 0.0, 0.0, 0.0], True),
    ([0.0, 0.0, 0.0, 0.0, 0.0, np.radians(2.5)], False),
    ([0.0, 0.0, 0.0, 0.0, 0.0, np.radians(3.5)], True)])
def test_aick_contradicts_poses_that_are_wrong_by_more_than_it_may_be(
        rendered_views, error, is_contradicted):
    registrar, source, target, motion = rendered_views
    own = registrar.with_own_keypoints(source)
    assert registrar.contradicts(own, target, se3.perturbed(motion, error)) is is_contradicted


def test_aick_checks_a_pose_by_the_strongest_keypoints(rendered_views, monkeypatch):
    registrar, source, target, motion = rendered_views
    own, counts, align = registrar.with_own_keypoints(source), [], Aick.align
    monkeypatch.setattr(Aick, 'align', lambda self, *frames: counts.append(
        [len(frame) for frame in frames]) or align(self, *frames))
    registrar.contradicts(own, target, motion)
    assert min(len(own.keypoints), len(target.keypoints)) > 200 and counts == [[200, 200]]


def test_where_aick_finds_no_pose_it_contradicts_none(rendered_views):
    registrar, source, target, motion = rendered_views
    away = se3.perturbed(motion, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert registrar.contradicts(registrar.with_own_keypoints(source), target, away)
    assert not registrar.contradicts(source, target, away)  # it has no keypoints of its own


@pytest.mark.parametrize(('error', 'elapsed', 'reason'), [
    (np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0]), LONG, 'keypoints tracked from the keyframe, of'),
    (ERROR, 1e-3, 'sudden'),  # no camera is off by so much after a millisecond
])
def test_aick_has_to_decide_where_the_motion_expected_is_wrong(
        rendered_views, error, elapsed, reason):
    registrar, source, target, motion = rendered_views
    same, found = registrar.track(source, target,
                                  ExpectedPose(se3.perturbed(motion, error), elapsed))
    assert found.status is Status.TOO_FEW_MATCHES and reason in found.reason
    assert not same.is_tracked


def test_views_of_two_resolutions_are_not_tracked(rendered_views):
    registrar, source, target, motion = rendered_views
    small = dataclasses.replace(source, grey=source.grey[::2, ::2])
    assert not registrar.track(small, target, ExpectedPose(motion, LONG))[1].status.ok


def test_nothing_is_tracked_without_a_refinement(rendered_views):
    _, source, target, motion = rendered_views
    for settings, is_ok in ((preset('paper-fast'), False), (Settings(), True)):
        _, found = Registrar(settings).track(source, target, ExpectedPose(motion, LONG))
        assert found.status.ok == is_ok


class Back:
    """A refinement that tracks some keypoints back to a pose, and notes what it is given."""

    def __init__(self, made, pose, tracked, known, on_objects=0.0):
        refined = made.refined(tracked, bias='a bias', measure='a measurement',
                               fit=Fit(np.ones(tracked), 1.0, on_objects))
        rows = np.linspace(0, known - 1, tracked).astype(int)  # of the target's keypoints
        self.refined = dataclasses.replace(
            refined, T_target_source=pose, by_readout=np.arange(6.0),
            tracked=dataclasses.replace(refined.tracked, keypoints=rows))
        self.given, self.believed = [], []

    def remember_objects(self, *of):
        self.believed.append(of)

    def refine_back(self, *given):
        self.given.append(given)
        return self.refined

    def refine_without_depth(self, *given):
        self.given.append(given)
        return self.refined


@pytest.fixture
def play(made):
    """Return the function that registers two frames by a refinement of known answers."""
    def play(tracked=60, known=100, error=np.zeros(6), elapsed=LONG, settings=Settings(),
             on_objects=0.0, method='register', **how):
        expected = made.pose()
        play.back = Back(made, expected @ se3.exp(error), tracked, known, on_objects)
        play.views = (made.prepared(2, 0, twist=np.arange(1.0, 7.0)), made.prepared(1, known))
        play.expected = expected
        return getattr(TrackedKeypoints(settings, play.back), method)(
            *play.views, ExpectedPose(expected, elapsed), **how)
    return play


def test_of_two_resolutions_nothing_is_refined(made):
    source, target = made.prepared(2, size=(20, 24)), made.prepared(1)
    same, found = TrackedKeypoints(Settings(), None).register(
        source, target, ExpectedPose(np.eye(4), LONG))
    assert same is source
    assert (found.status, found.reason) == (
        Status.TOO_FEW_MATCHES, 'the images differ in size')


def test_the_refinement_is_given_the_motion_expected_and_the_velocity(play):
    source, found = play(elapsed=0.25)
    (given_source, target, pose, predicted), = play.back.given
    assert (given_source, target) == play.views and pose is play.expected
    assert predicted.T_target_source is play.expected and predicted.elapsed == 0.25
    np.testing.assert_array_equal(predicted.twist, np.arange(1.0, 7.0))


def test_a_registration_has_all_that_was_refined(play):
    """Its matches are rows of the tracked keypoints and of those of the target."""
    source, found = play()
    refined = play.back.refined
    assert play.back.believed == [(source, play.views[1], refined.T_target_source,
                                   refined.tracked, refined.fit)]
    for name in ('T_target_source', 'covariance', 'systematic', 'bias', 'measure', 'fit'):
        assert getattr(found, name) is getattr(refined, name)
    assert found.reason == '60 keypoints tracked from the keyframe' and found.support == 60
    np.testing.assert_array_equal(found.matches, np.column_stack([
        np.arange(60), refined.tracked.keypoints]))
    np.testing.assert_array_equal(found.tracks.keypoints, np.arange(60))
    assert found.tracks.points is refined.tracked.points
    known, keypoints = play.views[1].keypoints, source.keypoints
    assert keypoints.stamp == 2 and source.is_tracked
    for name in ('descriptors', 'covariances'):
        np.testing.assert_array_equal(getattr(keypoints, name),
                                      getattr(known, name)[refined.tracked.keypoints])
    np.testing.assert_allclose(keypoints.positions, refined.tracked.points, rtol=1e-6)
    np.testing.assert_allclose(keypoints.pixels, source.frame.camera.project(
        refined.tracked.points), rtol=1e-5)


@pytest.mark.parametrize('known, most, fewest, sought', [
    (100, 400, 46, 100), (200, 100, 46, 100), (20, 400, 12, 20)])
def test_a_share_of_what_is_sought_must_be_tracked(play, known, most, fewest, sought):
    settings = with_values(Settings(), {'refinement.max_tracks': most})
    assert play(fewest, known, settings=settings)[1].status.ok
    source, found = play(fewest - 1, known, settings=settings)
    assert found.status is Status.TOO_FEW_MATCHES and source is play.views[0]
    assert found.reason == f'{fewest - 1} keypoints tracked from the keyframe, of {sought}'


@pytest.mark.parametrize('tracked, known, error, is_rough', [
    (45, 100, 0.0, True), (12, 100, 0.0, True), (11, 100, 0.0, False), (60, 100, 0.06, True)])
def test_aick_may_confirm_a_pose_that_enough_keypoints_show(play, tracked, known, error,
                                                            is_rough):
    source, found = play(tracked, known, error * np.eye(6)[0])
    assert not found.status.ok and found.is_rough == is_rough and not source.is_tracked
    pose = play.back.refined.T_target_source if is_rough else np.eye(4)
    np.testing.assert_array_equal(found.T_target_source, pose)
    assert np.isinf(np.diag(found.covariance)).all()


@pytest.mark.parametrize('on_objects, is_found', [(0.69, True), (0.71, False)])
def test_aick_has_to_decide_where_keypoints_are_on_what_has_moved_before(play, on_objects,
                                                                         is_found):
    source, found = play(on_objects=on_objects)
    assert bool(play.back.believed) == is_found
    assert found.status.ok == source.is_tracked == is_found and found.is_rough != is_found
    if not is_found:
        assert found.reason == ('60 keypoints tracked from the keyframe are on what has moved '
                                'before')


@pytest.mark.parametrize('error, elapsed, is_found', [
    ([0.0499, 0, 0, 0, 0, 0], 1.0, True), ([0.0501, 0, 0, 0, 0, 0], 1.0, False),
    ([0, 0, 0, 0, np.radians(2.99), 0], 1.0, True),
    ([0, 0, 0, 0, np.radians(3.01), 0], 1.0, False),
    ([0.0149, 0, 0, 0, 0, 0], 0.0316228, True), ([0.0151, 0, 0, 0, 0, 0], 0.0316228, False)])
def test_a_motion_far_from_the_one_expected_is_not_taken(play, error, elapsed, is_found):
    """Nor one that is sudden: 15 m/s^2, five times 3, move a camera by 15 mm in 32 ms."""
    settings = with_values(Settings(), {'odometry.acceleration_sigma': 3.0})
    source, found = play(error=np.array(error), elapsed=elapsed, settings=settings)
    assert found.status.ok == source.is_tracked == is_found
    if not is_found:
        assert found.status is Status.TOO_FEW_MATCHES and source is play.views[0]
        assert found.reason == '60 keypoints tracked from the keyframe show a sudden motion'


WITHOUT_DEPTH = {'method': 'register_without_depth'}


@pytest.mark.parametrize('how', [{}, WITHOUT_DEPTH])
def test_what_a_readout_makes_of_a_pose_goes_with_it(play, how):
    found = play(**how) if how else play(**how)[1]
    np.testing.assert_array_equal(found.by_readout, play.back.refined.by_readout)


def without_depth(frame):
    return dataclasses.replace(frame, depth=np.full_like(frame.depth, np.nan))


def test_the_motion_is_found_without_depth_of_the_source(rendered_views):
    registrar, source, target, motion = rendered_views
    blind = registrar.prepare(without_depth(source.frame))
    assert len(blind.keypoints) == 0
    found = registrar.register_colour(blind, target, ExpectedPose(se3.perturbed(motion, ERROR),
                                                                  LONG))
    error = se3.difference(found.T_target_source, motion)
    assert found.status.ok and found.evidence is Evidence.COLOUR_ALONE and found.is_by_colour
    assert np.linalg.norm(error[:3]) < 0.002 and np.linalg.norm(error[3:]) < 0.001
    assert error @ np.linalg.solve(found.covariance, error) < 30.0


@pytest.mark.parametrize('has_surface', [True, False])
def test_without_depth_a_pose_has_the_bias_to_what_depth_shows(rendered_views, monkeypatch,
                                                               has_surface):
    """Where frames with depth are registered by that, too."""
    registrar, source, target, motion = rendered_views
    monkeypatch.setattr(MeasuredNoise, 'expected', lambda self, motion: Noise(bias=np.diag(
        [motion] * 6)))
    refinement = Refinement(Settings().refinement, Settings().sensor)
    blind = registrar.prepare(without_depth(source.frame))
    found = refinement.refine_without_depth(
        blind, target if has_surface else dataclasses.replace(target, surface=None), motion)
    shift = found.tracked.displacement(CAMERA.fx) if has_surface else 0.0
    assert len(found.tracked) > 100 and (shift > 1.0) == has_surface
    np.testing.assert_array_equal(found.systematic, shift * np.eye(6))
    assert 0.0 < np.trace(found.covariance - found.systematic) < 1e-3


def test_colour_alone_needs_a_refinement_and_a_pose_expected(rendered_views):
    _, source, target, motion = rendered_views
    registrar = Registrar(preset('paper-fast'))
    blind = registrar.prepare(without_depth(source.frame))
    found = registrar.register_colour(blind, target, ExpectedPose(motion, LONG))
    assert (found.status, found.reason) == (Status.TOO_FEW_MATCHES, 'no refinement')
    with pytest.raises(InputError, match='the pose expected: None, where'):
        Registrar().register_colour(blind, target, None)


def test_without_depth_a_registration_has_no_matches(play):
    """Nothing is learned of the camera."""
    found = play(**WITHOUT_DEPTH)
    assert play.back.given == [(*play.views, play.expected)]
    for name in ('T_target_source', 'covariance', 'systematic'):
        assert getattr(found, name) is getattr(play.back.refined, name)
    assert found.reason == 'by colour alone, 60 keypoints tracked from the keyframe'
    assert (found.support, len(found.matches)) == (60, 0)
    assert found.bias is found.measure is found.tracks is None and not play.back.believed


@pytest.mark.parametrize('changes, reason', [
    ({'tracked': 45}, '45 keypoints tracked from the keyframe, of 100'),
    ({'tracked': 11, 'known': 20}, '11 keypoints tracked from the keyframe, of 20'),
    ({'error': 0.0501 * np.eye(6)[0]}, '60 keypoints tracked from the keyframe show a sudden '
                                       'motion'),
    ({'on_objects': 0.71}, '60 keypoints tracked from the keyframe are on what has moved before')])
def test_without_depth_too_little_evidence_is_no_pose(play, changes, reason):
    found = play(**WITHOUT_DEPTH, **changes)
    assert (found.status, found.reason) == (
        Status.TOO_FEW_MATCHES, f'by colour alone, {reason}')
    assert not found.is_rough


@pytest.mark.parametrize('tracked, known, is_pose', [
    (25, 100, True), (24, 100, False), (12, 20, True), (11, 20, False)])
def test_without_depth_a_frame_after_a_tracked_one_needs_fewer_keypoints(
        play, tracked, known, is_pose):
    assert play(tracked, known, is_followed=True, **WITHOUT_DEPTH).status.ok == is_pose


def test_without_depth_a_pose_that_depth_contradicts_is_none(play, monkeypatch):
    monkeypatch.setattr(Back, 'refine_without_depth', lambda self, *given: dataclasses.replace(
        self.refined, is_contradicted=True))
    assert play(**WITHOUT_DEPTH).reason == CONTRADICTION


def test_without_depth_images_of_two_sizes_are_not_registered(made):
    source, target = made.prepared(2, size=(20, 24)), made.prepared(1)
    found = TrackedKeypoints(Settings(), None).register_without_depth(
        source, target, ExpectedPose(np.eye(4), LONG))
    assert (found.status, found.reason) == (
        Status.TOO_FEW_MATCHES, 'the images differ in size')
