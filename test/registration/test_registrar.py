# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Registrations of rendered views: what is done without refinement, and what guesses may do."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import RESTART_AFTER, seconds
from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.learned import Learned
from aick_ros.registration.refinement.shutters import Shutters
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset
from aick_ros.sources.synthetic import DepthSensor, SyntheticOptions, SyntheticSource

COUNT = 10
RATE = 30
CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
BLIND = {'aick.lambda_e': 1e-4, 'aick.lambda_f': 1e-3}  # thresholds that nothing passes
TURNED = se3.exp([0, 0, 0, 0, np.radians(30), 0])


@pytest.fixture(scope='module')
def source():
    return SyntheticSource(SyntheticOptions(seed=5, frames=COUNT, camera=CAMERA))


@pytest.fixture(scope='module')
def frames(source):
    return [source.frame(i) for i in range(COUNT)]


def motion(source, target, index):
    """Return the true pose of one frame seen from another."""
    poses = source.ground_truth.poses
    return se3.inverse(poses[target]) @ poses[index]


def register(frames, changes=None, expected=None, blank=False):
    """Return the registration of the last of some frames to the first, and the prepared frames."""
    registrar = Registrar(with_values(Settings(), changes or {}))
    views = [registrar.prepare(frame) for frame in frames]
    if blank:
        views[0] = dataclasses.replace(views[0], grey=np.zeros_like(views[0].grey))
    return registrar.register(
        views[-1], views[0], None if expected is None else ExpectedPose(expected)), views


def error(pose, truth):
    """Return translation [m] and rotation [rad] between two poses."""
    difference = se3.inverse(truth) @ pose
    return np.linalg.norm(difference[:3, 3]), se3.angle(difference[:3, :3])


@pytest.mark.parametrize('name', ['paper-fast', 'paper-full'])
def test_without_refinement_it_is_aick_bit_for_bit(frames, name):
    paper = preset(name)
    registrar = Registrar(paper)
    views = [registrar.prepare(frame) for frame in frames[:4]]
    extractor = KeypointExtractor(paper.features, paper.sensor)
    alone = Aick(paper.aick).register(extractor.extract(frames[3]), extractor.extract(frames[0]))
    found = registrar.register(views[3], views[0], ExpectedPose(TURNED))
    for field in dataclasses.fields(alone):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(alone, field.name))
    assert views[0].surface is None


@pytest.mark.parametrize('mode', ['keypoints', 'joint'])
def test_refinement_improves_the_accuracy(source, frames, mode):
    refined, unrefined = ([], [])
    for errors, name in ((refined, mode), (unrefined, 'none')):
        for i in range(3, COUNT):
            found, _ = register(frames[i - 3:i + 1], {'refinement.mode': name})
            errors.append(error(found.T_target_source, motion(source, i - 3, i)))
    assert (np.median(refined, axis=0) < 0.7 * np.median(unrefined, axis=0)).all()


def test_a_wrong_guess_changes_nothing_where_aick_finds_the_pose(frames):
    plain, _ = register(frames[:4])
    guessed, _ = register(frames[:4], expected=TURNED)
    for name in ('status', 'reason', 'T_target_source', 'matches', 'support'):
        np.testing.assert_array_equal(getattr(guessed, name), getattr(plain, name))
    # a delay of depth that is not known yet, 10 ms, times the change of the speed by the guess
    interval = seconds(frames[0].stamp, frames[3].stamp)
    change = 0.01 * se3.difference(plain.T_target_source, TURNED) / interval
    np.testing.assert_allclose(guessed.covariance, plain.covariance + np.outer(change, change),
                               rtol=1e-6)


@pytest.mark.parametrize('axis', range(3))
@pytest.mark.parametrize('degrees', [30, -30, 60])
def test_a_wrong_guess_is_corrected_or_rejected(source, frames, axis, degrees):
    turned = se3.exp(np.radians(degrees) * np.eye(6)[3 + axis])
    found, _ = register(frames[:4], BLIND, expected=turned @ motion(source, 0, 3))
    if found.status is Status.OK:
        translation, rotation = error(found.T_target_source, motion(source, 0, 3))
        assert translation < 0.003
        assert rotation < np.radians(0.15)
    else:
        assert found.status is Status.TOO_FEW_MATCHES
        np.testing.assert_array_equal(found.T_target_source, np.eye(4))
        assert np.isinf(np.diag(found.covariance)).all()


def test_a_guess_without_overlap_is_rejected(source, frames):
    behind = se3.exp([0, 0, 0, 0, np.radians(60), 0]) @ motion(source, 0, 3)
    assert register(frames[:4], BLIND, expected=behind)[0].status is Status.TOO_FEW_MATCHES


def test_a_guess_with_a_small_error_is_refined(source, frames):
    truth = motion(source, 0, 3)
    about = truth @ se3.exp([0.01, -0.01, 0.01, 0.005, 0.005, -0.005])
    assert register(frames[:4], BLIND)[0].status is Status.TOO_FEW_MATCHES
    found, _ = register(frames[:4], BLIND, expected=about)
    assert found.status is Status.OK
    assert 'by the pose expected' in found.reason
    translation, rotation = error(found.T_target_source, truth)
    assert translation < 0.003
    assert rotation < np.radians(0.15)


def test_noise_is_learned_from_registrations_but_not_from_places_that_may_look_alike(frames):
    learned = Learned()
    registrar = Registrar(learned=learned)
    views = [registrar.prepare(frame) for frame in frames[:3]]
    before = learned.noise.expected(20.0).keypoints
    assert registrar.recognize(views[2], views[0]).measure is None
    assert learned.noise.expected(20.0).keypoints == before
    assert registrar.register(views[2], views[0]).status.ok
    assert learned.noise.expected(20.0).keypoints != before


def test_a_repeated_image_has_the_noise_of_the_sensor_and_teaches_nothing(frames):
    """Its residuals vanish; the standard deviations are at least tenths of the usual ones."""
    learned = Learned()
    registrar = Registrar(learned=learned)
    repeated = dataclasses.replace(frames[0], stamp=frames[1].stamp)
    views = [registrar.prepare(frame) for frame in (frames[0], repeated)]
    before = learned.noise.expected(0.0)
    found = registrar.register(views[1], views[0])
    after = learned.noise.expected(0.0)
    assert found.status.ok
    assert found.bias is found.measure is None
    assert after.keypoints == before.keypoints
    np.testing.assert_array_equal(after.bias, before.bias)
    noise = np.sqrt(np.linalg.eigvalsh(found.varying_pose.covariance))
    assert noise.min() > 3e-6
    usual = registrar.register(registrar.prepare(frames[2]), views[0])
    assert noise.min() > 0.01 * np.sqrt(np.linalg.eigvalsh(usual.varying_pose.covariance)).min()


def test_a_slower_schedule_is_tried_where_a_short_one_fails(source, frames, monkeypatch):
    class Short(Aick):
        """Finds nothing with few iterations."""

        def __init__(self, given):
            super().__init__(given)
            tried.append((given.alpha, given.iterations, given.lambda_f))
            self._blind = given.iterations < 20

        def align(self, source, target):
            found = super().align(source, target)
            return dataclasses.replace(found, status=Status.TOO_FEW_MATCHES) if (
                self._blind) else found

    tried = []
    for module in ('registrar', 'verified_aick'):
        monkeypatch.setattr(f'aick_ros.registration.{module}.Aick', Short)
    found, _ = register(frames[:4], {'aick.lambda_f': 0.21})
    assert tried == [(0.6, 10, 0.21), (0.93, 60, 0.21)]
    assert found.status is Status.OK
    assert found.iterations == 60
    assert error(found.T_target_source, motion(source, 0, 3))[0] < 0.003


def test_with_too_few_tracks_the_covariance_of_aick_is_enlarged(frames):
    """One image goes blank after its detection: nothing can be tracked into it."""
    found, views = register(frames[:4], blank=True)
    alone = Aick(Settings().aick).register(views[-1].keypoints, views[0].keypoints)
    np.testing.assert_array_equal(found.T_target_source, alone.T_target_source)
    np.testing.assert_array_equal(found.matches, alone.matches)
    np.testing.assert_allclose(found.covariance, 100 * alone.covariance)
    assert found.reason == f'{alone.reason}, 0 keypoints tracked'


def test_few_matches_and_too_few_tracks_are_rejected(frames):
    found, views = register(frames[:4], {'features.orb.nfeatures': 29}, blank=True)
    alone = Aick(Settings().aick).register(views[-1].keypoints, views[0].keypoints)
    assert alone.status is Status.OK
    assert found.status is Status.TOO_FEW_MATCHES
    assert found.reason.endswith('0 keypoints tracked')


@pytest.mark.parametrize('elapsed', [0.0, -1.0, -1e300, 1e-200, 0.9e-9, -np.inf])
@pytest.mark.parametrize('method', ['register', 'track'])
def test_no_velocity_is_measured_now_or_later(frames, method, elapsed):
    registrar = Registrar(Settings())
    views = [registrar.prepare(frame) for frame in frames[:2]]
    with pytest.raises(InputError) as raised:
        getattr(registrar, method)(*views[::-1], ExpectedPose(np.eye(4), elapsed))
    assert str(raised.value) == f'elapsed is {elapsed:g} s: it must be 1 ns at least'


def test_a_velocity_of_a_time_beyond_all_stamps_is_not_known(frames):
    poses = []
    for elapsed in (1e300, np.inf):
        registrar = Registrar(Settings())
        views = [registrar.prepare(frame) for frame in frames[:2]]
        poses.append(registrar.register(*views[::-1], ExpectedPose(np.eye(4), elapsed)))
    np.testing.assert_array_equal(poses[0].T_target_source, poses[1].T_target_source)
    np.testing.assert_array_equal(poses[0].covariance, poses[1].covariance)
    assert poses[0].status is Status.OK


def test_stages_are_timed(frames):
    times = StageTimes()
    registrar = Registrar(Settings(), times)
    views = [registrar.prepare(frame) for frame in frames[:2]]
    seen = times.take()
    assert seen['features'] > 0
    assert seen['surface'] > 0
    assert seen['registration'] == seen['refinement'] == 0.0
    registrar.register(*views[::-1])
    registered = times.take()
    assert registered['features'] == registered['surface'] == 0.0
    assert registered['registration'] > 0
    assert registered['refinement'] > 0


@pytest.fixture(scope='module')
def two_clocks():
    """
    Return frames whose depth camera is twice as fast, and of which every other image is missing.

    So each second depth image is late by half a period, and between two of them passes half or
    one and a half times what passes between the colour images.
    """
    options = SyntheticOptions(seed=5, frames=12, camera=CAMERA, depth=DepthSensor.perfect())
    prompt = SyntheticSource(options)
    late = SyntheticSource(dataclasses.replace(options, depth_delay=0.5 / RATE))
    return prompt, [(late if i % 2 else prompt).frame(i) for i in range(12)]


def test_the_lag_of_the_depth_is_known(two_clocks):
    registrar = Registrar()
    lags = [registrar.prepare(frame).depth_lag for frame in two_clocks[1]]
    np.testing.assert_allclose(lags, 6 * [0.0, 0.5 / RATE], atol=1e-7)


def stamped_on_arrival(jitters):
    """Return frames whose images are taken 10 ms apart; their stamps have jitter [s]."""
    rng, camera = np.random.default_rng(1), Camera(32, 24, 30.0, 30.0, 15.5, 11.5)
    taken = np.arange(1, 200)[:, None] / RATE + (0.0, 0.010)
    stamps = np.rint(1e9 * (taken + jitters * rng.normal(size=taken.shape))).astype(int)
    grey, depth = np.zeros((24, 32), np.uint8), np.ones((24, 32), np.float32)
    return [RgbdFrame(at, grey, depth, camera, depth_at) for at, depth_at in stamps.tolist()]


def test_a_frame_that_is_prepared_again_has_the_lag_of_its_stamps():
    """The clocks are beyond it: they neither correct it nor learn from it."""
    frames = stamped_on_arrival((0.002, 0.002))
    again, once = Registrar(), Registrar()
    for number, frame in enumerate(frames):
        assert again.prepare(frame).depth_lag == once.prepare(frame).depth_lag
        earlier = frames[number // 2]
        if frame.stamp - earlier.stamp < RESTART_AFTER:
            assert again.prepare(earlier).depth_lag == pytest.approx(
                1e-9 * (earlier.depth_stamp - earlier.stamp), abs=1e-12)


@pytest.mark.parametrize('jitters', [(0.002, 0.0), (0.0, 0.002)])
def test_the_lag_of_the_depth_is_that_of_the_acquisitions(jitters):
    """Either stream is stamped on arrival, with jitter."""
    registrar = Registrar()
    lags = [registrar.prepare(frame).depth_lag for frame in stamped_on_arrival(jitters)]
    assert np.sqrt(np.mean(np.square(np.array(lags[100:]) - 0.010))) < 0.5 * max(jitters)


@pytest.mark.parametrize('lag, delay', [(0.008, 0.0), (0.0, 0.02), (0.008, 0.02), (-0.01, 0.02)])
def test_errors_by_delays_are_those_of_all_that_is_corrected(monkeypatch, frames, lag, delay):
    """Of the lag that the stamps show, and of the delay that they do not."""
    delays, errors = set(), np.diag([1e-4, 0, 0, 0, 0, 0])

    def errors_of(shutters, misalignment, lag):
        delays.add(misalignment.delay + lag)
        return errors

    registrar = Registrar(with_values(Settings(), {'misalignment.delay': delay}))
    target, source = (registrar.prepare(dataclasses.replace(
        frame, depth_stamp=frame.stamp + round(1e9 * lag))).moving(np.full(6, 1e-9))
        for frame in frames[:2])
    without = Registrar(with_values(Settings(), {'misalignment.delay': delay})).register(
        source, target)
    monkeypatch.setattr(Shutters, 'errors', errors_of)
    found = registrar.register(source, target)
    assert list(delays) == [pytest.approx(lag + delay, abs=2e-3)]
    np.testing.assert_allclose(found.covariance - without.covariance, errors, atol=1e-12)


@pytest.mark.parametrize('steady', [None, se3.exp([0.01, 0, 0, 0, 0.02, 0])])
def test_errors_by_a_change_of_velocity_are_by_that_of_the_images(frames, steady):
    """Where another sensor expects another pose, what it says makes no image less certain."""
    given = []
    known = SimpleNamespace(add_to=lambda found, source, target, expected, *_:
                            given.append(expected) or found)
    registrar = Registrar(learned=Learned(systematic_error=known))
    target, source = (registrar.prepare(frame) for frame in frames[:2])
    expected = ExpectedPose(np.eye(4), 0.03, steady)
    registrar.register(source, target, expected)
    registrar.track(source, target, expected)
    for each in given:
        np.testing.assert_array_equal(each.at_constant_velocity,
                                      np.eye(4) if steady is None else steady)
    assert len(given) == 2


def test_each_sensor_is_taken_at_its_own_time(two_clocks):
    source, frames = two_clocks
    medians = []
    for seen in (frames, [dataclasses.replace(frame, depth_stamp=None) for frame in frames]):
        registrar = Registrar()
        views = [registrar.prepare(frame) for frame in seen]
        errors = [error(registrar.register(views[i], views[i - 1]).T_target_source,
                        motion(source, i - 1, i)) for i in range(1, len(views))]
        medians.append(np.median(errors, axis=0))
    known, ignored = medians
    assert (known < 0.5 * ignored).all(), medians


@pytest.mark.parametrize('few, parts', [(0.0, 1), (1.1, 2)])
def test_recognizing_in_parts_is_recognizing_at_once(frames, monkeypatch, few, parts):
    """The first part has found the place already; those after it refine it, once or twice."""
    monkeypatch.setattr('aick_ros.registration.refinement.refinement._FEW_TRACKED', few)
    monkeypatch.setattr('aick_ros.registration.refinement.refinement._SMALL_ERROR', 0.0)
    registrar = Registrar()
    views = [registrar.prepare(frame) for frame in frames[:3]]
    aligned = registrar.align(views[2], views[0])
    assert aligned.status.ok and aligned.tracks is None
    apart, at_once = aligned, registrar.recognize(views[2], views[0])
    for part in range(1, parts + 1):
        before = registrar.refinements
        apart = registrar.recognize_partly(views[2], views[0], apart)
        assert registrar.refinements == before + 1
        assert apart.is_rough == (part < parts)
    np.testing.assert_array_equal(apart.T_target_source, at_once.T_target_source)
    np.testing.assert_array_equal(apart.covariance, at_once.covariance)
    np.testing.assert_array_equal(apart.tracks.keypoints, at_once.tracks.keypoints)
    elsewhere = dataclasses.replace(aligned, status=Status.TOO_FEW_MATCHES)
    assert not registrar.recognize_partly(views[2], views[0], elsewhere).status.ok


def test_without_a_refinement_there_is_no_other_part(frames):
    registrar = Registrar(with_values(Settings(), {'refinement.mode': 'none'}))
    views = [registrar.prepare(frame) for frame in frames[:2]]
    aligned = registrar.align(*views)
    assert registrar.recognize_partly(*views, aligned) is aligned
    assert registrar.refinements == 0
