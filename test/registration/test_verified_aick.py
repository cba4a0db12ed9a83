# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The order of AICK, refinements and checks, by parts whose answers are known."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration import stage_times
from aick_ros.registration.aick.fit_covariance import fit_covariance
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.result import failed
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM
from aick_ros.registration.verified_aick import VerifiedAick
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

EXPECTED = ExpectedPose(se3.exp([0.1, 0.2, 0.3, 0.1, -0.2, 0.1]), 0.2)
FAILURE = failed(Status.TOO_FEW_MATCHES, 'by AICK', 3)
SLOW_FAILURE = failed(Status.DEGENERATE_GEOMETRY, 'by slow AICK', 30)


class Clock:
    """Goes on by a second each time it is read: each stage takes one second."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        self.now += 1.0
        return self.now


class Steps:
    """A registrar of such parts, and two frames."""

    def __init__(self, parts, made):
        parts.replace('verified_aick', 'RepeatingSceneCheck', 'DynamicObjectCheck',
                      'ApparentAcceleration', 'Aick', 'KeypointExtractor')
        self.parts, self.made = parts, made
        self.settings = with_values(Settings(), {
            'refinement.max_tracks': 100, 'sensor.roi_ratios': (0.1, 0.0, 0.0, 0.0)})
        self.noise, self.refinement = MeasuredNoise(), parts.make('Refinement')
        self.times, self.detector, self.fast = StageTimes(), object(), SimpleNamespace()
        self.fast.align = lambda *args: parts.log.append(('fast', 'align', args)) or self.aligned
        self.registrar = VerifiedAick(self.settings, self.fast, self.refinement, self.noise,
                                      self.times, self.detector)
        self.target, self.source = made.prepared(1), made.prepared(
            2, twist=np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]))
        self.aligned = made.registration()
        self.refined = [made.refined(40)]
        parts.answers.update({
            ('Refinement', 'refine'): lambda *_: self.refined.pop(0),
            ('Refinement', 'refine_near'): lambda *_: self.refined.pop(0),
            ('Refinement', 'remember_objects'): None, ('ApparentAcceleration', 'note'): None,
            ('RepeatingSceneCheck', 'check'): lambda found, *_: found,
            ('DynamicObjectCheck', 'check'): lambda found, *_: found,
            ('Aick', 'register'): SLOW_FAILURE,
            ('KeypointExtractor', 'extract'): lambda frame: ('all of', frame)})

    def register(self, expected=EXPECTED, tracked=None):
        return self.registrar.register(self.source, self.target, expected, tracked)


@pytest.fixture
def steps(parts, made):
    return Steps(parts, made)


def assert_is_refined(found, aligned, refined):
    """Assert that a registration is that by AICK with what the refinement found."""
    for name in ('T_target_source', 'covariance', 'systematic', 'bias', 'measure'):
        assert getattr(found, name) is getattr(refined, name)
    assert found.tracks is refined.tracked and found.support == len(refined.tracked)
    assert found.matches is aligned.matches and found.iterations == aligned.iterations
    assert found.status is Status.OK
    assert found.reason == f'{aligned.reason}, {len(refined.tracked)} keypoints tracked'


def assert_predicted(predicted, steps):
    np.testing.assert_array_equal(predicted.T_target_source, EXPECTED.T_target_source)
    np.testing.assert_array_equal(predicted.twist, steps.source.twist)
    assert predicted.elapsed == EXPECTED.elapsed


def test_its_parts_share_one_refinement_of_the_camera(steps, parts):
    for name, settings in (('RepeatingSceneCheck', steps.settings.odometry),
                           ('DynamicObjectCheck', steps.settings)):
        (part,) = parts.made[name]
        assert part.made_with[:2] == (steps.refinement, settings)
        agreement, acceleration = part.made_with[2:]
        assert agreement._noise is steps.noise
        assert [acceleration] == parts.made['ApparentAcceleration']
    (slow,), (extractor,) = parts.made['Aick'], parts.made['KeypointExtractor']
    assert slow.made_with == (
        dataclasses.replace(steps.settings.aick, alpha=0.93, iterations=60),)
    assert extractor.made_with == (dataclasses.replace(
        steps.settings.features, max_keypoints=0), Settings().sensor, steps.detector)


def test_what_aick_finds_is_refined_and_then_checked(steps, parts):
    steps.refined = [steps.made.refined(40, bias='bias', measure='measure')]
    aligned, refined = steps.aligned, steps.refined[0]
    found = steps.register()
    assert_is_refined(found, aligned, refined)
    assert parts.order() == [
        ('fast', 'align'), ('Refinement', 'refine'), ('RepeatingSceneCheck', 'check'),
        ('DynamicObjectCheck', 'check'), ('ApparentAcceleration', 'note'),
        ('Refinement', 'remember_objects')]
    assert parts.asked('fast', 'align') == [(steps.source.keypoints, steps.target.keypoints)]
    (source, target, pose, predicted), = parts.asked('Refinement', 'refine')
    assert source is steps.source and target is steps.target
    assert pose is aligned.T_target_source
    assert_predicted(predicted, steps)
    for check in ('RepeatingSceneCheck', 'DynamicObjectCheck'):
        (checked, *others), = parts.asked(check, 'check')
        assert checked is found
        assert others == [steps.source, steps.target, EXPECTED]


def test_the_refinement_begins_at_a_pose_tracked_that_aick_confirms(steps, parts):
    aligned, refined = steps.aligned, steps.refined[0]
    tracked = aligned.T_target_source @ se3.exp([0.049, 0, 0, 0, 0, 0])
    found = steps.register(tracked=tracked)
    assert_is_refined(found, aligned, refined)
    assert parts.order() == [
        ('fast', 'align'), ('Refinement', 'refine_near'), ('RepeatingSceneCheck', 'check'),
        ('DynamicObjectCheck', 'check'), ('ApparentAcceleration', 'note'),
        ('Refinement', 'remember_objects')]
    (source, target, pose, predicted), = parts.asked('Refinement', 'refine_near')
    assert source is steps.source and target is steps.target and pose is tracked
    assert_predicted(predicted, steps)


@pytest.mark.parametrize('tracked, is_contradicted', [(FEWEST_TO_CONFIRM - 1, False), (60, True)])
def test_where_nothing_confirms_the_pose_tracked_that_of_aick_is_refined(
        steps, parts, tracked, is_contradicted):
    again = steps.made.refined(40)
    steps.refined = [steps.made.refined(tracked, is_contradicted=is_contradicted), again]
    found = steps.register(tracked=steps.aligned.T_target_source @ se3.exp(
        [0.03, 0, 0, 0, 0, 0]))
    assert_is_refined(found, steps.aligned, again)
    (_, _, pose, predicted), = parts.asked('Refinement', 'refine')
    assert pose is steps.aligned.T_target_source
    assert_predicted(predicted, steps)


@pytest.mark.parametrize('error', [[0.051, 0, 0, 0, 0, 0], [0, 0, 0, 0, np.radians(3.1), 0]])
def test_where_aick_finds_another_pose_than_the_one_tracked_that_counts(steps, parts, error):
    steps.register(tracked=steps.aligned.T_target_source @ se3.exp(error))
    (_, _, pose, _), = parts.asked('Refinement', 'refine')
    assert pose is steps.aligned.T_target_source and not parts.asked('Refinement', 'refine_near')


@pytest.mark.parametrize('count, is_enough', [(46, True), (45, False)])
def test_where_aick_finds_no_pose_the_one_tracked_needs_a_share_of_the_keypoints(
        steps, parts, count, is_enough):
    steps.source = steps.made.prepared(2, 120)  # a hundred are tracked at most
    steps.aligned, steps.refined = FAILURE, [steps.made.refined(count)]
    refined = steps.refined[0]
    found = steps.register(expected=None, tracked=EXPECTED.T_target_source)
    assert (('Aick', 'register') in parts.order()) != is_enough
    if is_enough:
        assert found.T_target_source is refined.T_target_source and found.status is Status.OK
        assert found.reason == 'by tracking, 46 keypoints tracked'
        assert found.support == 46 and not len(found.matches)
    else:
        assert found.reason == SLOW_FAILURE.reason


def test_of_two_resolutions_the_pose_tracked_counts_for_nothing(steps, parts):
    steps.source = steps.made.prepared(2, size=(20, 24))
    steps.register(expected=None, tracked=steps.aligned.T_target_source)
    assert not parts.asked('Refinement', 'refine_near')


def test_each_stage_is_timed(steps, parts, monkeypatch):
    monkeypatch.setattr(stage_times, 'clock', Clock())
    steps.register()
    timing = steps.times.take()
    assert timing['registration'] == 1000.0
    assert timing['refinement'] == 2000.0  # the refinement, and the checks
    steps.aligned = FAILURE
    steps.register(expected=None)
    timing = steps.times.take()
    assert timing['registration'] == 2000.0 and timing['features'] == 0.0


def test_without_a_motion_expected_what_is_noted_is_against_rest(steps, parts):
    steps.refined = [steps.made.refined(40)]
    found = steps.register(expected=None)
    (stamp, noted, expected), = parts.asked('ApparentAcceleration', 'note')
    assert found.status.ok and noted is found and stamp == steps.source.stamp
    np.testing.assert_array_equal(expected.T_target_source, np.eye(4))
    assert expected.elapsed == pytest.approx(1e-9 * (steps.source.stamp - steps.target.stamp))
    assert parts.asked('Refinement', 'refine')[0][3] is None
    assert len(parts.order()) == 3


def test_a_likelier_pose_of_a_repeating_scene_is_not_checked_for_objects(steps, parts):
    likelier = steps.made.registration()
    parts.answers['RepeatingSceneCheck', 'check'] = likelier
    assert steps.register() is likelier
    assert parts.asked('DynamicObjectCheck', 'check') == []


def test_what_is_noted_is_the_pose_after_all_checks(steps, parts):
    of_the_scene = steps.made.registration(fit='a fit')
    parts.answers['DynamicObjectCheck', 'check'] = of_the_scene
    assert steps.register() is of_the_scene
    (_, noted, expected), = parts.asked('ApparentAcceleration', 'note')
    assert noted is of_the_scene and expected is EXPECTED
    assert parts.asked('Refinement', 'remember_objects') == [(
        steps.source, steps.target, of_the_scene.T_target_source, of_the_scene.tracks, 'a fit')]


def test_what_the_check_for_objects_finds_is_returned(steps, parts):
    other = steps.made.registration()
    parts.answers['DynamicObjectCheck', 'check'] = other
    assert steps.register() is other


@pytest.mark.parametrize('failure', ['AICK', 'tracks'])
def test_where_nothing_is_found_or_confirmed_the_slow_schedule_has_all_keypoints(
        steps, parts, failure):
    """Its matches are rows of other keypoints: they are not returned."""
    slow = steps.made.registration(reason='slow')
    confirmed = steps.made.refined(FEWEST_TO_CONFIRM)
    steps.refined = [confirmed]
    if failure == 'AICK':
        steps.aligned = FAILURE
    else:
        steps.aligned = steps.made.registration(count=59)
        steps.refined = [steps.made.refined(FEWEST_TO_CONFIRM - 1), confirmed]
    parts.answers['Aick', 'register'] = slow
    found = steps.register()
    assert_is_refined(found, dataclasses.replace(slow, matches=found.matches), confirmed)
    assert found.matches.shape == (0, 2)
    assert parts.asked('Aick', 'register') == [
        (('all of', steps.source.frame), ('all of', steps.target.frame))]
    *_, (source, target, pose, predicted) = parts.asked('Refinement', 'refine')
    assert source is steps.source and target is steps.target and pose is slow.T_target_source
    assert_predicted(predicted, steps)
    assert ('DynamicObjectCheck', 'check') in parts.order()


def test_a_pose_that_depth_contradicts_is_rejected_however_it_is_found(steps, parts):
    """By AICK, by slow AICK, or as it is expected."""
    parts.answers['Aick', 'register'] = steps.made.registration(reason='slow')
    steps.refined = [dataclasses.replace(steps.made.refined(100), is_contradicted=True)
                     for _ in range(3)]
    found = steps.register()
    assert not steps.refined
    assert found.status is Status.TOO_FEW_MATCHES
    assert 'contradict each other' in found.reason


def test_all_keypoints_of_a_frame_are_found_once(steps, parts):
    steps.aligned = FAILURE
    for _ in range(2):
        steps.register(expected=None)
    assert parts.asked('KeypointExtractor', 'extract') == [
        (steps.source.frame,), (steps.target.frame,)]


def test_without_a_motion_expected_the_failure_of_the_slow_schedule_is_returned(steps, parts):
    steps.aligned = FAILURE
    found = steps.register(expected=None)
    assert (found.status, found.reason) == (SLOW_FAILURE.status, 'by slow AICK')
    assert parts.asked('Refinement', 'refine') == []
    (_, noted, _), = parts.asked('ApparentAcceleration', 'note')
    assert noted is found


@pytest.mark.parametrize('keypoints, fewest', [
    (400, 50), (100, 50), (60, 30), (10, FEWEST_TO_CONFIRM)])
def test_half_of_the_keypoints_that_can_be_tracked_confirm_the_motion_expected(
        steps, parts, keypoints, fewest):
    """From there it is refined, without the expectation as a velocity; nothing else is checked."""
    steps.aligned = FAILURE
    steps.source = steps.made.prepared(2, keypoints, twist=steps.source.twist)
    for tracked, is_confirmed in ((fewest, True), (fewest - 1, False)):
        parts.log.clear()
        steps.refined = [steps.made.refined(tracked)]
        refined, = steps.refined
        found = steps.register()
        (source, target, pose, predicted), = parts.asked('Refinement', 'refine')
        assert source is steps.source and target is steps.target
        assert pose is EXPECTED.T_target_source and predicted is None
        assert not any(name.endswith('Check') for name, _ in parts.order())
        if is_confirmed:
            assert found.status is Status.OK and found.support == tracked
            assert found.T_target_source is refined.T_target_source
            assert found.reason == f'by the pose expected, {tracked} keypoints tracked'
            assert found.iterations == SLOW_FAILURE.iterations
        else:
            assert (found.status, found.reason) == (SLOW_FAILURE.status, 'by slow AICK')


def of_other_size(steps):
    """Make the source one of another resolution: nothing can be tracked."""
    steps.source = steps.made.prepared(2, size=(20, 24))
    return 0


def of_few_tracks(steps):
    steps.refined = [steps.made.refined(FEWEST_TO_CONFIRM - 1)]
    return FEWEST_TO_CONFIRM - 1


@pytest.mark.parametrize('unconfirmed', [of_other_size, of_few_tracks])
def test_many_matches_without_tracks_have_a_hundred_times_their_covariance(
        steps, parts, unconfirmed):
    steps.aligned = steps.made.registration(count=60)
    tracked = unconfirmed(steps)
    found = steps.register()
    assert found.status is Status.OK and found.tracks is None and found.support == 60
    assert found.reason == f'as told, {tracked} keypoints tracked'
    assert found.T_target_source is steps.aligned.T_target_source
    np.testing.assert_allclose(found.covariance, 100 * fit_covariance(
        found.T_target_source, steps.source.keypoints, steps.target.keypoints,
        steps.aligned.matches))


def test_without_matches_the_covariance_is_that_of_the_slow_schedule(steps, parts):
    """Whose matches are those of other keypoints."""
    steps.aligned, slow = FAILURE, steps.made.registration(count=60)
    parts.answers['Aick', 'register'] = slow
    of_few_tracks(steps)
    found = steps.register()
    assert found.status is Status.OK
    np.testing.assert_allclose(found.covariance, 100 * slow.covariance)


@pytest.mark.parametrize('unconfirmed', [of_other_size, of_few_tracks])
def test_few_matches_without_tracks_fail(steps, parts, unconfirmed):
    steps.aligned = steps.made.registration(count=59)
    tracked = unconfirmed(steps)
    found = steps.registrar.recognize(steps.source, steps.target)
    assert (found.status, found.iterations) == (Status.TOO_FEW_MATCHES, 7)
    assert found.reason == f'as told, {tracked} keypoints tracked'


def test_recognized_is_what_one_attempt_finds(steps, parts):
    refined = steps.refined[0]
    assert_is_refined(steps.registrar.recognize(steps.source, steps.target), steps.aligned,
                      refined)
    assert parts.asked('Refinement', 'refine')[0][3] is None
    steps.aligned, steps.refined = FAILURE, []
    assert steps.registrar.recognize(steps.source, steps.target) is FAILURE
    assert ('Aick', 'register') not in parts.order()
    steps.aligned, steps.refined = steps.made.registration(), [refined]
    predicted = EXPECTED.prediction(steps.source.twist)
    steps.registrar.recognize(steps.source, steps.target, predicted)
    assert parts.asked('Refinement', 'refine')[-1][3] is predicted
