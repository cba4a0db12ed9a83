# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the registrar hands to its parts, and learns of a camera, by parts of known answers."""

import dataclasses
import functools

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.depth_distortion import COLUMNS, NO_DISTORTION, ROWS, DepthDistortion
from aick_ros.frames.repetition import Repeat
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration import stage_times
from aick_ros.registration.depth_pair import KnownView
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.learned import Learned
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import failed
from aick_ros.registration.samples import Equations, Measure, MisalignmentSample
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

POSE = se3.exp([0.1, 0.2, 0.3, 0.1, -0.2, 0.1])
EXPECTED = ExpectedPose(POSE, 0.2)
MISALIGNED = with_values(Settings(), {'misalignment.delay': 0.02, 'misalignment.x': 0.01})
UNREFINED = with_values(Settings(), {'refinement.mode': 'none'})
DELAY_SIGMA, LEARNED_DELAY, LEARNED_READOUT, LEARNED_RADIAL = 0.004, 0.013, 0.02, -0.05
LEARNED_DISTORTION = DepthDistortion(np.full((ROWS, COLUMNS), 0.001))
EQUATIONS = Equations(np.eye(40), np.zeros(40))
SAMPLE = MisalignmentSample(np.eye(12), np.zeros(12), EQUATIONS)
ALONE = MisalignmentSample(np.eye(12), np.zeros(12))


class Clock:
    """Has a jitter, and corrects its stamps by a known time."""

    def __init__(self, jitter, correction):
        self.jitter, self.correction, self.behind = jitter, correction, False

    def is_behind(self, stamp):
        return self.behind

    def correct(self, stamp):
        return self.correction


class Sensed:
    """What is learned of a camera: notes what it is given, and has what that teaches after it."""

    def __init__(self, log):
        self._log, self.delay_sigma = log, 0.0
        self.misalignment = Misalignment(np.zeros(6), 0, 0, 0)
        self.distortion = NO_DISTORTION

    def assume(self, misalignment):
        self._log.append(('assume', misalignment.settings))

    def follow(self, camera):
        self._log.append(('follow', camera))

    def learn(self, sample, radial=LEARNED_RADIAL):
        self._log.append(('learn', sample))
        if sample is EQUATIONS and radial == LEARNED_RADIAL:
            self.distortion = LEARNED_DISTORTION
        if sample is SAMPLE:
            self.misalignment = Misalignment(np.zeros(6), LEARNED_DELAY, LEARNED_READOUT, 0.0,
                                             colour_radial=LEARNED_RADIAL)
            self.delay_sigma = DELAY_SIGMA

    def add_to(self, *given):
        self._log.append(('add_to', *given))
        return 'with systematic errors'


def measured(sample):
    """Return what measures a noise and a sample of the misalignment."""
    return Measure(lambda: 'a noise', lambda: sample)


class Steps:
    """A registrar of such parts, and two frames."""

    def __init__(self, parts, made, settings=Settings()):
        parts.replace('registrar', 'Preparer', 'Aick', 'DepthAlone', 'Refinement', 'VerifiedAick',
                      'TrackedKeypoints')
        self.log, self.times, self.settings = [], StageTimes(), settings
        self.colour, self.depth = Clock(0.003, 0.001), Clock(0.005, 0.004)
        self.learned = Learned(self.colour, self.depth, *(Sensed(self.log) for _ in range(4)))
        self.detector = object()
        self.registrar = Registrar(settings, self.times, self.learned, self.detector)
        self.target = made.prepared(1_000_000_000, depth_lag=0.002, twist=np.zeros(6))
        self.source = made.prepared(1_100_000_000, depth_lag=0.004, twist=np.ones(6))
        self.found = made.registration(bias='a bias', measure=measured(SAMPLE))
        for method in ('register', 'recognize'):
            parts.answers['VerifiedAick', method] = lambda *_: self.found
        parts.answers['TrackedKeypoints', 'register'] = lambda source, *_: (
            dataclasses.replace(source, is_tracked=True), self.found)
        parts.answers['Aick', 'register'] = 'by AICK alone'

    def added(self):
        """Return the registration that systematic errors were added to, and the rest."""
        (_, found, *rest), = [entry for entry in self.log if entry[0] == 'add_to']
        return found, rest

    def samples(self):
        return [entry[1] for entry in self.log if entry[0] == 'learn']


@pytest.fixture
def make(parts, made):
    return lambda settings=Settings(): Steps(parts, made, settings)


@pytest.fixture
def steps(make):
    return make()


@pytest.fixture
def clock(monkeypatch):
    """Let each stage take a second."""
    now = [0.0]

    def read():
        now[0] += 1.0
        return now[0]
    monkeypatch.setattr(stage_times, 'clock', read)


def test_its_parts_share_what_is_learned_of_the_camera(make, parts):
    steps = make(MISALIGNED)
    (preparer,), (aick,), (depth_alone,), (refinement,), (verified,), (tracked,) = (
        parts.made[name] for name in ('Preparer', 'Aick', 'DepthAlone', 'Refinement',
                                      'VerifiedAick', 'TrackedKeypoints'))
    learned, settings = steps.learned, steps.settings
    assert steps.registrar.preparer is preparer
    assert preparer.made_with == (settings, steps.detector)
    assert aick.made_with == (settings.aick,)
    assert depth_alone.made_with == (settings, learned.noise, learned.misalignment)
    assert refinement.made_with == (settings.refinement, settings.sensor, learned.noise,
                                    learned.misalignment)
    assert verified.made_with == (settings, aick, refinement, learned.noise, steps.times,
                                  steps.detector)
    assert tracked.made_with == (settings, refinement)
    assert steps.log == [('assume', settings.misalignment)]


def test_on_its_own_it_learns_on_its_own(parts, made):
    Steps(parts, made)
    parts.made.clear()
    one, other = Registrar(), Registrar()
    assert one._learned is not other._learned and one._times is not other._times
    assert [part.made_with[1] for part in parts.made['DepthAlone']] == [
        one._learned.noise, other._learned.noise]


class Preparation:
    """Counts how often its parts are asked for, each of which takes a second."""

    def __init__(self, frame, keypoints):
        self.frame, self.times, self._keypoints = frame, StageTimes(), keypoints
        self.distortion, self.asked = LEARNED_DISTORTION, []

    def up_to_date(self):
        self.asked.append('up to date')
        return self

    @functools.cache
    def corrected(self):
        return dataclasses.replace(self.frame, depth=self.frame.depth + np.float32(1.0))

    def keypoints(self):
        self.asked.append('keypoints')
        with self.times.stage('features'):
            return self._keypoints

    def surface(self):
        self.asked.append('surface')
        with self.times.stage('surface'):
            return 'a surface'


@pytest.fixture
def preparation(made, monkeypatch):
    monkeypatch.setattr('aick_ros.registration.registrar.Preparation', Preparation)
    return Preparation(made.frame(1_000_000_000), made.keypoints(1_000_000_000, 30))


@pytest.mark.parametrize('repeat', Repeat)
def test_a_prepared_frame_has_what_its_preparation_has(steps, preparation, repeat):
    """But no surface of another moment; its lag is that of the acquisitions."""
    prepared = steps.registrar.prepared(preparation, repeat)
    frame = preparation.frame
    assert prepared.frame is preparation.corrected() and preparation.asked[0] == 'up to date'
    assert steps.log[1:] == 2 * [('follow', frame.camera)]
    np.testing.assert_array_equal(prepared.grey, frame.grey)
    assert prepared.distortion is LEARNED_DISTORTION
    assert prepared.keypoints is preparation._keypoints
    assert prepared.surface == (None if repeat is Repeat.DEPTH else 'a surface')
    assert ('surface' in preparation.asked) == (repeat is not Repeat.DEPTH)
    assert prepared.repeat is repeat and prepared.twist is None and not prepared.is_tracked
    assert prepared.depth_lag == pytest.approx(0.004 - 0.001)
    assert prepared.stamp_jitter == 0.003


def test_prepared_for_tracking_a_frame_has_no_keypoints(steps, preparation):
    prepared = steps.registrar.prepared_for_tracking(preparation)
    assert preparation.asked == ['up to date', 'surface'] and prepared.surface == 'a surface'
    assert steps.log[1:] == 2 * [('follow', preparation.frame.camera)]
    assert len(prepared.keypoints) == 0 and prepared.keypoints.stamp == preparation.frame.stamp
    assert prepared.frame is preparation.corrected() and prepared.repeat is Repeat.NONE
    assert prepared.depth_lag == pytest.approx(0.003) and prepared.stamp_jitter == 0.003


def test_a_frame_is_prepared_in_one_go(steps, parts, preparation, clock):
    parts.answers['Preparer', 'begin'] = preparation
    prepared = steps.registrar.prepare(preparation.frame, Repeat.COLOUR)
    assert parts.asked('Preparer', 'begin') == [(preparation.frame,)]
    assert prepared.repeat is Repeat.COLOUR and prepared.frame is preparation.corrected()
    assert steps.registrar.prepare(preparation.frame).repeat is Repeat.NONE
    assert steps.times.take()['features'] == 2000.0
    assert preparation.times.take()['total'] == 0.0


def test_keypoints_of_its_own_are_found_in_its_image(steps, parts, made, clock):
    own = made.keypoints(1, 20)
    parts.answers['Preparer', 'keypoints'] = own
    tracked = made.prepared(2, is_tracked=True, depth_lag=0.001, surface='a surface')
    prepared = steps.registrar.with_own_keypoints(tracked)
    assert parts.asked('Preparer', 'keypoints') == [(tracked.frame,)]
    assert prepared.keypoints is own and not prepared.is_tracked
    assert prepared.depth_lag == 0.001 and prepared.surface == 'a surface'
    assert steps.times.take() == {'features': 1000.0, 'surface': 0.0, 'registration': 0.0,
                                  'refinement': 0.0, 'total': 1000.0}


def test_a_frame_that_is_behind_has_the_lag_of_its_stamps(steps, preparation):
    steps.colour.behind = True
    assert steps.registrar.prepared(preparation).depth_lag == 0.0


def assert_given(given, steps):
    source, target, expected = given[:3]
    assert source is steps.source and target is steps.target
    np.testing.assert_array_equal(expected.T_target_source, POSE)
    assert expected.elapsed == EXPECTED.elapsed


@pytest.mark.parametrize('tracked', [None, np.eye(4)])
def test_the_pose_tracked_is_handed_on(steps, parts, tracked):
    steps.registrar.register(steps.source, steps.target, EXPECTED, tracked=tracked)
    (*_, given), = parts.asked('VerifiedAick', 'register')
    assert (given is None) == (tracked is None)
    np.testing.assert_array_equal(given, tracked)


def test_a_pose_tracked_that_is_not_rigid_is_rejected(steps):
    with pytest.raises(InputError, match='the pose tracked'):
        steps.registrar.register(steps.source, steps.target, tracked=2.0 * np.eye(4))


def test_a_registration_teaches_noise_and_misalignment_and_gets_systematic_errors(steps, parts):
    """Those by an error of the delay, with what the registration has taught of it just now."""
    found = steps.registrar.register(steps.source, steps.target, EXPECTED)
    assert found == 'with systematic errors'
    given, = parts.asked('VerifiedAick', 'register')
    assert_given(given, steps)
    assert steps.log[1:4] == [('learn', 'a noise'), ('learn', SAMPLE), ('learn', EQUATIONS)]
    assert steps.registrar.preparer.distortion is LEARNED_DISTORTION
    completed, (*given, sigma) = steps.added()
    assert completed.T_target_source is steps.found.T_target_source
    assert completed.bias == 'a bias' and completed.measure is None
    assert_given(given, steps)
    assert sigma == DELAY_SIGMA


@pytest.mark.parametrize('which', ['source', 'target'])
def test_of_frames_whose_velocity_is_not_known_noise_alone_is_learned(steps, which):
    """As of pairs of frames: what the delay of depth does would seem to be a misregistration."""
    setattr(steps, which, dataclasses.replace(getattr(steps, which), twist=None))
    steps.registrar.register(steps.source, steps.target, EXPECTED)
    assert steps.samples() == ['a noise']


def test_a_camera_at_rest_off_its_keyframe_teaches_its_noise_alone(steps, made):
    """Its errors are those of one pair of views, however often it is registered."""
    found = steps.found
    for _ in range(3):
        steps.registrar.register(steps.source, steps.target, EXPECTED)
        steps.found = dataclasses.replace(found, measure=Measure(lambda: 'a noise', pytest.fail))
    assert steps.samples() == ['a noise', SAMPLE, EQUATIONS, 'a noise', 'a noise']
    steps.found = found
    steps.target = made.prepared(1_050_000_000, twist=np.zeros(6))
    steps.registrar.register(steps.source, steps.target, EXPECTED)
    assert steps.samples()[5:] == ['a noise', SAMPLE, EQUATIONS]
    steps.found = dataclasses.replace(steps.found, T_target_source=POSE)
    steps.registrar.register(steps.source, steps.target, EXPECTED)
    assert steps.samples()[8:] == ['a noise', SAMPLE, EQUATIONS]


@pytest.mark.parametrize('size, taught', [
    ((10, 12), ['a noise', SAMPLE, EQUATIONS]), ((10, 24), ['a noise', SAMPLE])])
def test_frames_of_two_images_teach_no_distortion(steps, made, size, taught):
    """As before and after the camera has changed its crop."""
    steps.target = made.prepared(1_000_000_000, size=size, twist=np.zeros(6))
    steps.registrar.register(steps.source, steps.target, EXPECTED)
    assert steps.samples() == taught


def test_where_no_motion_is_expected_none_is_handed_on(steps, parts):
    steps.registrar.register(steps.source, steps.target)
    for given in (parts.asked('VerifiedAick', 'register')[0], steps.added()[1]):
        assert given[2] is None


def test_what_is_tracked_teaches_the_same(steps, parts, clock):
    tracked, found = steps.registrar.track(steps.source, steps.target, EXPECTED)
    given, = parts.asked('TrackedKeypoints', 'register')
    assert_given(given, steps)
    assert found == 'with systematic errors' and tracked.is_tracked
    timing = steps.times.take()
    assert timing['refinement'] == timing['total'] == 1000.0
    (source, target, expected, *_) = steps.added()[1]
    assert source is tracked and target is steps.target and expected is given[2]
    assert steps.samples() == ['a noise', SAMPLE, EQUATIONS]


@pytest.mark.parametrize('case', ['the same image', Repeat.COLOUR, Repeat.DEPTH])
def test_a_repeated_image_teaches_nothing(steps, made, case):
    values = {'depth_lag': 0.004}
    if isinstance(case, Repeat):
        values['repeat'] = case
    steps.source = made.prepared(1_100_000_000, **values)
    if case == 'the same image':
        steps.source = dataclasses.replace(steps.source, grey=steps.target.grey.copy())
    steps.registrar.register(steps.source, steps.target, EXPECTED)
    found, (*_, sigma) = steps.added()
    assert steps.samples() == []
    assert found.bias is found.measure is None
    assert found.T_target_source is steps.found.T_target_source
    assert sigma == 0.0


@pytest.mark.parametrize('measure, taught', [
    (None, []), (measured(None), ['a noise']), (measured(ALONE), ['a noise', ALONE])])
def test_what_was_not_measured_teaches_nothing(steps, made, measure, taught):
    steps.found = made.registration(measure=measure)
    steps.registrar.register(steps.source, steps.target)
    assert steps.samples() == taught
    assert steps.registrar.preparer.distortion is NO_DISTORTION


def test_from_places_that_look_alike_nothing_is_learned(steps, parts):
    """Nor is their bias compared with others; the errors of stamps are added."""
    assert steps.registrar.recognize(steps.source, steps.target) == 'with systematic errors'
    (source, target, *_), = parts.asked('VerifiedAick', 'recognize')
    assert source is steps.source and target is steps.target
    found, rest = steps.added()
    assert steps.samples() == []
    assert found.bias is found.measure is None
    assert len(rest) == 2 and rest[0] is steps.source and rest[1] is steps.target


def test_without_a_refinement_aick_is_all(make, parts, clock):
    steps = make(UNREFINED)
    assert not {'Refinement', 'VerifiedAick', 'TrackedKeypoints'} & set(parts.made)
    for register in (lambda *views: steps.registrar.register(*views, EXPECTED),
                     steps.registrar.recognize):
        assert register(steps.source, steps.target) == 'by AICK alone'
        timing = steps.times.take()
        assert timing['registration'] == timing['total'] == 1000.0
    assert parts.asked('Aick', 'register') == 2 * [
        (steps.source.keypoints, steps.target.keypoints)]
    source, found = steps.registrar.track(steps.source, steps.target, EXPECTED)
    assert source is steps.source
    assert (found.status, found.reason) == (Status.TOO_FEW_MATCHES, 'no refinement')
    assert steps.samples() == [] and len(steps.log) == 1


def test_depth_alone_gets_the_motion_expected_and_what_is_unobserved(steps, parts, clock):
    by_depth = failed(Status.TOO_FEW_KEYPOINTS, '')
    parts.answers['DepthAlone', 'register'] = by_depth
    expected, unobserved = PoseWithCovariance(POSE, np.eye(6)), np.diag(np.arange(1.0, 7.0))
    beside = KnownView(steps.target, POSE)
    assert steps.registrar.register_depth(
        steps.source, steps.target, expected, unobserved, [beside]) is by_depth
    (source, target, motion, covariance, (other,)), = parts.asked('DepthAlone', 'register')
    assert other.prepared is steps.target and other.T_view_target is POSE
    assert source is steps.source and target is steps.target and motion is expected
    np.testing.assert_array_equal(covariance, unobserved)
    timing = steps.times.take()
    assert timing['refinement'] == timing['total'] == 1000.0
    assert steps.samples() == []


def test_what_the_dark_needs_is_forgotten_some_time_after_it(steps, parts, made):
    """Not between frames in the dark, nor while the camera is lost; and once."""
    def register(count):
        for _ in range(count):
            steps.registrar.register(steps.source, steps.target, EXPECTED)
        return len(parts.asked('DepthAlone', 'forget'))
    in_the_dark = PoseWithCovariance(POSE, np.eye(6))
    parts.answers['DepthAlone', 'register'] = failed(Status.TOO_FEW_KEYPOINTS, '')
    parts.answers['DepthAlone', 'forget'] = None
    for _ in range(2):
        steps.registrar.register_depth(steps.source, steps.target, in_the_dark, np.eye(6))
        assert register(59) == 0
    found, steps.found = steps.found, failed(Status.TOO_FEW_MATCHES, '')
    assert register(5) == 0
    steps.found = found
    assert [register(1), register(200)] == [1, 1]


@pytest.mark.parametrize('bad', [
    lambda one, a, b: one.register(None, b), lambda one, a, b: one.register(a, None),
    lambda one, a, b: one.register(a, b, POSE),
    lambda one, a, b: one.register(a, b, ExpectedPose(np.zeros((4, 4)))),
    lambda one, a, b: one.register(a, b, ExpectedPose(POSE, np.nan)),
    lambda one, a, b: one.prepared_like(a, None),
    lambda one, a, b: one.prepared_like(None, b),
    lambda one, a, b: one.prepared_again(a.frame),
    lambda one, a, b: one.recognize(a, None), lambda one, a, b: one.recognize(None, b),
    lambda one, a, b: one.track(None, b, EXPECTED), lambda one, a, b: one.track(a, b, POSE),
    lambda one, a, b: one.track(a, b, ExpectedPose(np.zeros((4, 4)), 0.1)),
    lambda one, a, b: one.track(a, b, ExpectedPose(POSE, np.nan)),
    lambda one, a, b: one.register_depth(a, None, PoseWithCovariance.identity(), np.eye(6)),
    lambda one, a, b: one.register_depth(a, b, POSE, np.eye(6)),
    lambda one, a, b: one.register_depth(a, b, PoseWithCovariance.identity(), np.eye(5)),
    lambda one, a, b: one.prepared(a), lambda one, a, b: one.prepared_for_tracking(a),
    lambda one, a, b: one.with_own_keypoints(a.frame)])
def test_arguments_of_another_kind_are_rejected_before_anything_is_asked(steps, parts, bad):
    with pytest.raises(InputError):
        bad(steps.registrar, steps.source, steps.target)
    assert parts.log == [] and len(steps.log) == 1
