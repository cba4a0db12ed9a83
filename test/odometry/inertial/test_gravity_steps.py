# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the level frame hands to its integral, its filter and its correction, frame by frame."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance, in_axes
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gravity_filter import GRAVITY, GravityFilter
from aick_ros.odometry.inertial.level import level_orientation
from aick_ros.settings import ImuSettings

START, OFFSET = 100 * NANOSECONDS, 0.007
FORCE = np.array([1.0, -9.0, -3.0])
CORRECTION = se3.exp([1.0, 0.2, 0.1, 0.1, 0.2, 0.3])
SETTINGS = ImuSettings()
RNG = np.random.default_rng(6)


def covariance(scale=1e-2):
    root = scale * RNG.standard_normal((6, 6))
    return root @ root.T


SEEN = [PoseWithCovariance(se3.exp(0.2 * RNG.standard_normal(6)), covariance()) for _ in range(3)]
REFERENCE = PoseWithCovariance(se3.exp(0.5 * RNG.standard_normal(6)), covariance(3e-3))
CORRECTED = PoseWithCovariance(se3.exp(0.3 * RNG.standard_normal(6)), covariance(2e-2))
NEXT_REFERENCE = REFERENCE @ PoseWithCovariance(
    se3.exp(0.1 * RNG.standard_normal(6)), covariance(1e-3))


class Filter:
    """A filter of gravity that agrees or not, as it is told."""

    velocity_sigma = 0.1

    def __init__(self, played, made_with):
        self._played, self.made_with = played, made_with
        self.up = SimpleNamespace(in_axes=lambda rotation: ('up', rotation),
                                  covariance=played.known ** 2 * np.eye(3))
        self.time_offset = played.late

    def copy(self):
        return self

    def __getattr__(self, method):
        def note(*args):
            self._played.log.append((method, *args))
            return self._played.agrees if method == 'measure' else None
        return note


class Played:
    """Gravity with an integral, a filter and a correction that note what they are given."""

    def __init__(self, monkeypatch, settings=SETTINGS):
        self.log, self.filters, self.began, self.agrees = [], [], [], True
        self.doubted, self.known = [], 0.001
        self.late, self.turned = 0.0, None
        self.force, self.duration = FORCE, 0.1
        monkeypatch.setattr('aick_ros.odometry.inertial.gravity.GravityFilter', self._filter)
        self.gravity = Gravity(settings)
        self.gravity._forces = SimpleNamespace(
            last=START, add=lambda *of: self.log.append(('add', *of)), mount=self._mount,
            recent=self._recent, between=self._between)
        self.gravity._offset = round(OFFSET * NANOSECONDS)
        self.watch()

    def watch(self):
        self.gravity._level = SimpleNamespace(
            begin=lambda *at: self.began.append(at),
            apply=lambda pose, doubt: self.doubted.append(doubt),
            approach=lambda *to: self.log.append(('approach', *to)))

    def _filter(self, *made_with):
        self.filters.append(Filter(self, made_with))
        return self.filters[-1]

    def _mount(self, mounting):
        self.log.append(('mount', mounting))
        return self.turned

    def _recent(self, *of):
        self.log.append(('recent', *of))
        return np.empty((0, 3)) if self.force is None else self.force + np.array(
            [[0.1, 0, 0.2], [-0.1, 0, -0.2]])

    def _between(self, *of):
        self.log.append(('between', *of))
        return None if self.duration is None else SimpleNamespace(duration=self.duration)

    def update(self, seconds, seen=SEEN[0], reference=REFERENCE):
        self.log.clear()
        stamp = START + round(seconds * NANOSECONDS)
        self.gravity.update(stamp, reference, reference.matrix @ seen, CORRECTION,
                            CORRECTED)
        return self.log

    def kinds(self):
        return [entry[0] for entry in self.log]


@pytest.fixture
def play(monkeypatch):
    """Return the function that makes such a one, begun with a frame."""
    def begin(frames=1, settings=SETTINGS):
        played = Played(monkeypatch, settings)
        played.first = played.gravity.begin(START)
        played.asked = list(played.log)
        for index in range(frames):
            played.update(0.1 * index, SEEN[index])
        return played
    return begin


def test_the_first_frame_is_level_by_the_force_of_a_tenth_of_a_second(play):
    played = play(0)
    assert played.asked == [('recent', START + 7_000_000, NANOSECONDS // 10)]
    expected = np.eye(4)
    expected[:3, :3] = level_orientation(FORCE / np.linalg.norm(FORCE))
    np.testing.assert_allclose(played.first.matrix, expected, atol=1e-12)
    assert not played.first.covariance.any()
    np.testing.assert_array_equal(played.gravity.start, played.first.matrix)
    played.first.matrix[0, 3] = 9.0
    assert played.gravity.start[0, 3] == 0.0


def test_the_first_tilt_is_as_uncertain_as_hand_and_bias(play):
    """And as the force differs from gravity."""
    played = play(settings=ImuSettings(accelerometer_bias_sigma=1.2))
    (position, variance), = played.began
    np.testing.assert_array_equal(position, np.zeros(3))
    assert variance == pytest.approx((
        0.5 ** 2 + 1.2 ** 2 + (np.linalg.norm(FORCE) - GRAVITY) ** 2) / GRAVITY ** 2)


@pytest.mark.parametrize('strength, is_level', [
    (0.499, False), (0.501, True), (1.499, True), (1.501, False)])
def test_what_is_far_from_gravity_is_none(play, strength, is_level):
    played = play(0)
    played.gravity.reset()
    played.force = strength * GRAVITY * FORCE / np.linalg.norm(FORCE)
    assert (played.gravity.begin(START) is not None) == is_level


def test_without_a_force_or_with_one_that_is_stuck_nothing_is_level(play):
    played = play(0)
    for force, doubt in ((None, 0.0), (FORCE, 1.0)):
        played.gravity.reset()
        played.force = force
        played.gravity._rest_check = SimpleNamespace(doubt=doubt, restart=lambda: None)
        assert played.gravity.begin(START) is None and played.gravity.start is None


def test_samples_are_added_and_their_clock_is_known(play):
    played = play(0)
    played.log.clear()
    stamps, forces = np.array([5, 6]) * NANOSECONDS, np.array([[1.0, 2, 3], [4, 5, 6]])
    played.gravity.add(ImuSamples(stamps, np.zeros((2, 3)), forces), -0.02)
    [(_, mounting), (_, added, with_them)] = played.log
    np.testing.assert_array_equal(mounting, np.eye(3))  # before a gyroscope shows another one
    np.testing.assert_array_equal(added, stamps)
    np.testing.assert_array_equal(with_them, forces)
    played.log.clear()
    played.gravity.begin(START)
    assert played.log[0][1] == START - 20_000_000


def test_where_the_axes_of_the_samples_are_known_better_the_filter_is_corrected(play):
    played = play()
    played.turned, mounting = se3.exp_rotation([0.02, 0.03, -0.01]), se3.exp_rotation([0.1, 0, 0])
    none = ImuSamples(np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3)))
    played.log.clear()
    played.gravity.add(none, OFFSET, mounting)
    assert played.kinds() == ['mount', 'turn', 'add'] and played.log[0][1] is mounting
    assert played.log[1][1] is played.turned
    played.gravity.restart()  # there is no filter then
    played.log.clear()
    played.gravity.add(none, OFFSET, mounting)
    assert played.kinds() == ['mount', 'add']


@pytest.mark.parametrize('agreeing, known, is_doubted', [
    (60, 0.001, True), (100, 0.001, False), (300, 0.1, True)])
def test_a_start_is_doubted_where_the_camera_contradicts_it_before_it_was_confirmed(
        play, agreeing, known, is_doubted):
    """By three seconds at 30 Hz of a motion that shows it: at rest all directions agree."""
    played = play(0)
    played.known = known
    played.update(0.0)
    for index in range(1, agreeing):
        played.update(0.1 * index)
        played.gravity.levelled(CORRECTED)
    assert not any(played.doubted)
    played.agrees = False
    for index in range(agreeing, agreeing + 20):
        played.update(0.1 * index)
    assert played.gravity.complaint
    played.gravity.levelled(CORRECTED)
    assert played.doubted[-1] == is_doubted


def test_the_filter_begins_with_the_force_in_the_axes_of_the_frame(play):
    """As uncertain as a hand accelerates, and as the force differs from gravity."""
    played = play()
    (settings, force, uncertainty, pose, *prior), = [one.made_with for one in played.filters]
    measured = REFERENCE.matrix @ SEEN[0]
    assert settings is SETTINGS
    np.testing.assert_allclose(force, FORCE)
    np.testing.assert_allclose(uncertainty, np.eye(3) * (
        0.5 ** 2 + (np.linalg.norm(FORCE) - GRAVITY) ** 2))
    np.testing.assert_allclose(pose.matrix, measured.matrix)
    np.testing.assert_allclose(pose.covariance, measured.covariance)
    # nobody has said where it is, or when it measures
    assert prior == [SETTINGS.position_sigma, 0.03]
    # and shows the frame what is up at once
    assert played.kinds() == ['recent', 'approach']


@pytest.mark.parametrize('rate, position, settings, prior', [
    (0.1, 0.0, SETTINGS, [SETTINGS.position_sigma, 0.0]), (np.nan, 0.2, SETTINGS, [0.0, 0.03]),
    (np.nan, 0.0, ImuSettings(position_sigma=0.3, time_offset_sigma=0.0), [0.3, 0.0])])
def test_what_a_gyroscope_or_a_transform_shows_is_not_estimated(
        play, rate, position, settings, prior):
    played = play(0, settings)
    played.gravity.add(ImuSamples(np.array([START]), np.full((1, 3), rate), FORCE[None],
                                  np.array([0.0, position, 0.0])), OFFSET)
    played.update(0.0)
    assert list(played.filters[0].made_with[4:]) == prior


def test_without_a_force_the_filter_begins_later(play):
    played = play(0)
    played.force = None
    assert played.update(0.0)[0][0] == 'recent' and played.filters == []
    assert 'approach' not in played.kinds()
    played.force = FORCE
    played.update(0.1)
    assert len(played.filters) == 1


def test_a_position_is_predicted_by_the_forces_since_the_frame_before(play):
    played = play()
    measured = [REFERENCE.matrix @ SEEN[0], NEXT_REFERENCE.matrix @ SEEN[1]]
    drift, between, predict, measure, _ = played.update(0.1, SEEN[1], NEXT_REFERENCE)
    axes = in_axes(REFERENCE.rotation)
    np.testing.assert_allclose(
        drift[1], axes @ NEXT_REFERENCE.since(REFERENCE).covariance @ axes.T, atol=1e-12)
    assert between[:3] == ('between', START + 7_000_000, START + 107_000_000)
    np.testing.assert_allclose(between[3], measured[0].rotation)
    np.testing.assert_allclose(between[4], measured[1].rotation)
    assert predict[0] == 'predict' and predict[1].duration == 0.1
    np.testing.assert_allclose(predict[2], measured[1].covariance[3:, 3:])
    assert measure[0] == 'measure'
    np.testing.assert_allclose(measure[1].matrix, measured[1].matrix)
    np.testing.assert_allclose(measure[1].covariance, measured[1].covariance)
    assert played.kinds()[-1] == 'approach'
    assert played.update(0.3)[1][1:3] == (START + 107_000_000, START + 307_000_000)
    played.filters[-1].time_offset = -0.02
    assert played.update(0.4)[0][1:3] == (START + 287_000_000, START + 387_000_000)


@pytest.mark.parametrize('start', [START, 0, -START])
def test_the_first_step_is_the_longest_wherever_stamps_begin(play, start):
    """As those of a simulation do at 0."""
    played = play(0)
    played.update(0.0 - (START - start) / NANOSECONDS)
    *_, elapsed = played.log[-1]
    assert played.kinds()[-1] == 'approach' and elapsed == 0.2


def test_what_is_up_is_told_to_the_frame_as_it_is_published(play):
    played = play()
    _, (up, rotation), pose, elapsed = played.update(0.1, SEEN[1])[-1]
    assert up == 'up' and elapsed == pytest.approx(0.1)
    np.testing.assert_array_equal(rotation, CORRECTION[:3, :3])
    assert pose is CORRECTED
    assert played.update(5.0)[-1][3] == 0.2  # no more than a fifth of a second


@pytest.mark.parametrize('duration, is_placed', [(0.2, False), (0.2001, True), (None, True)])
def test_over_a_gap_the_position_is_taken_as_measured(play, duration, is_placed):
    played = play()
    played.duration = duration
    played.update(0.1, SEEN[1])
    measured = REFERENCE.matrix @ SEEN[1]
    if is_placed:
        assert played.kinds() == ['between', 'place', 'approach']
        np.testing.assert_allclose(played.log[1][1].matrix, measured.matrix)
    else:
        assert played.kinds() == ['between', 'predict', 'measure', 'approach']


def test_a_position_that_disagrees_is_taken_as_measured(play):
    played = play()
    played.agrees = False
    played.update(0.1, SEEN[1])
    assert played.kinds() == ['between', 'predict', 'measure', 'place', 'approach']
    measured = REFERENCE.matrix @ SEEN[1]
    np.testing.assert_allclose(played.log[3][1].matrix, measured.matrix)
    np.testing.assert_allclose(played.log[3][1].covariance, measured.covariance)


def test_it_is_wrong_where_a_fifth_disagrees_and_right_again_below_a_twentieth(play):
    """By a mean of thirty frames: 1 - (29/30)^n of it disagrees after n that do."""
    played, count, frame = play(), 0, 0
    played.agrees = False
    while not played.gravity.complaint:
        count, frame = count + 1, frame + 1
        played.update(0.1 * frame)
    assert count == np.ceil(np.log(0.8) / np.log(29 / 30))
    share = 1 - (29 / 30) ** count
    assert 'approach' not in played.kinds()
    assert played.gravity.estimate is None
    assert 'not compared' in played.gravity.description
    played.agrees = True
    for first in (True, False):  # it begins anew, and is not believed at once
        played.update(0.1 * (frame := frame + 1))
        assert len(played.filters) == 2 and ('measure' in played.kinds()) != first
        assert 'approach' not in played.kinds()
    agreed = 1
    while played.gravity.complaint:
        agreed += 1
        played.update(0.1 * (frame := frame + 1))
    assert agreed == np.ceil(np.log(0.05 / share) / np.log(29 / 30))
    assert played.kinds()[-1] == 'approach'


def test_while_it_is_suspected_the_frame_stays_as_it_is(play):
    """From the second contradiction on, long before it is wrong."""
    played = play()
    played.agrees = False
    assert played.update(0.1)[-1][0] == 'approach'
    assert played.update(0.2)[-1][0] != 'approach' and not played.gravity.complaint


def test_while_it_is_wrong_it_begins_anew_every_three_seconds(play):
    played = play()
    played.agrees = False
    begun = []
    for frame in range(1, 200):
        played.update(0.1 * frame)
        begun.append(len(played.filters))
    # wrong from the seventh on; a frame that begins a filter is not compared
    assert (np.flatnonzero(np.diff(begun)) + 2).tolist() == [8, 99, 190]
    played.agrees = True
    for frame in range(200, 300):
        played.update(0.1 * frame)
    assert not played.gravity.complaint and 'approach' in played.kinds()


@pytest.mark.parametrize('first', ['accelerometer_bias_sigma', 'position_sigma',
                                   'time_offset_sigma'])
def test_other_settings_hold_at_once_and_another_start_begins_anew(play, first):
    played = play()
    noisier = dataclasses.replace(SETTINGS, accelerometer_noise=0.1)
    played.log.clear()
    played.gravity.configure(noisier)
    assert played.log == [('configure', noisier)]
    other = dataclasses.replace(noisier, **{first: 0.05})
    played.gravity.configure(other)
    played.update(0.1)
    assert len(played.filters) == 2 and played.filters[1].made_with[0] is other


def test_a_reset_forgets_the_level_and_who_was_wrong_but_no_samples(play):
    played = play()
    played.agrees = False
    for frame in range(1, 9):
        played.update(0.1 * frame)
    assert played.gravity.complaint
    played.gravity.reset()
    assert played.gravity.start is None and not played.gravity.complaint
    assert played.update(1.0) == []
    np.testing.assert_array_equal(played.gravity.levelled(SEEN[0]).matrix, SEEN[0].matrix)
    assert played.gravity.begin(START) is not None


def test_a_restart_keeps_the_level_frame_and_measures_anew(play):
    played = play()
    played.gravity.restart()
    played.watch()
    assert played.gravity.start is not None
    played.update(2.0, SEEN[1])
    assert played.kinds() == ['recent', 'approach'] and len(played.filters) == 2
    np.testing.assert_allclose(played.filters[1].made_with[3].matrix,
                               (REFERENCE.matrix @ SEEN[1]).matrix)


def test_switched_off_on_the_way_it_measures_no_more(play):
    played = play()
    played.gravity.configure(ImuSettings(gravity=False))
    assert played.update(0.1) == []


def test_what_is_known_is_described_with_its_numbers(play):
    played = play(0)
    assert played.gravity.description == 'not compared with the camera yet'
    played.update(0.0)
    played.gravity._filter = SimpleNamespace(
        bias=np.array([0.125, -0.5, 2.0]), lever_arm=np.array([-0.112, 0.03, 0.0]),
        lever_arm_sigma=0.0, up=SimpleNamespace(
            covariance=np.diag(np.radians([0.5, 2.0, 0.1]) ** 2)))
    assert played.gravity.description == (
        'bias (0.12, -0.50, 2.00) m/s^2; the direction of gravity is known to 2.00 deg')
    played.gravity._filter.lever_arm_sigma = 0.021
    assert played.gravity.description == (
        'bias (0.12, -0.50, 2.00) m/s^2; position (-0.11, 0.03, 0.00) m in the camera, to 0.02; '
        'the direction of gravity is known to 2.00 deg')


def test_what_is_estimated_is_handed_out_as_a_copy(play):
    gravity = play().gravity
    gravity._filter = GravityFilter(SETTINGS, FORCE, np.eye(3), SEEN[0])
    for of in ('values', 'covariance'):
        before = getattr(gravity._filter, of).copy()
        found, changed = gravity.estimate, gravity.estimate
        getattr(changed, of)[:] = 2.0
        np.testing.assert_array_equal(getattr(gravity._filter, of), before)
        getattr(gravity._filter, of)[:] = 3.0
        np.testing.assert_array_equal(getattr(found, of), before)


def test_what_is_up_is_in_the_axes_of_the_camera_at_the_last_frame(play):
    played = play()
    assert (played.gravity.stamp, played.update(0.1, SEEN[1])[0][0]) == (START, 'between')
    up = np.array([0.6, 0.0, 0.8])
    played.gravity._filter.up.vector = up
    assert played.gravity.stamp == START + NANOSECONDS // 10
    seen = (REFERENCE.matrix @ SEEN[1]).rotation
    np.testing.assert_allclose(seen @ played.gravity.up, up, atol=1e-12)


def test_before_a_filter_nothing_is_estimated(play):
    gravity = play(0).gravity
    assert gravity.up is gravity.stamp is gravity.estimate is None


def test_the_complaint_says_what_to_check(play):
    played = play()
    played.gravity._disagreement.wrong_for = 1
    assert played.gravity.complaint == (
        'the accelerometer contradicts the motion of the camera: check the pose of the IMU in the '
        'camera')


def test_a_displacement_begins_at_the_last_frame(play, monkeypatch):
    """By a copy of the filter, which goes on with the next frame that is measured."""
    monkeypatch.setattr('aick_ros.odometry.inertial.gravity.Displacement', lambda *made: made)
    monkeypatch.setattr(Filter, 'copy', lambda self: SimpleNamespace(time_offset=0.002, of=self))
    played, gyroscope = play(3), object()
    played.gravity.add(ImuSamples(np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3)),
                                  np.array([0.1, 0.2, 0.3])), OFFSET)
    last, forces, *used = played.gravity.displacement(gyroscope, 'limits', 4.0)
    assert last.stamp == START + NANOSECONDS // 5
    assert last.estimate.of is played.filters[-1]
    np.testing.assert_allclose(last.pose.matrix, REFERENCE.matrix @ SEEN[2].matrix)
    assert last.offset == 9_000_000
    np.testing.assert_array_equal(last.position, [0.1, 0.2, 0.3])
    assert forces is played.gravity._forces and used == [gyroscope, 'limits', 4.0]


@pytest.mark.parametrize('sigma, known', [(0.49, True), (0.51, False)])
def test_a_velocity_that_is_not_known_gives_no_displacement(play, monkeypatch, sigma, known):
    """As after a loss, or where frames are rare."""
    monkeypatch.setattr('aick_ros.odometry.inertial.gravity.Displacement', lambda *made: made)
    monkeypatch.setattr(Filter, 'velocity_sigma', sigma)
    assert (play(3).gravity.displacement(None, None, 1.0) is not None) is known


def test_after_a_loss_the_filter_is_followed_by_the_gyroscope(play):
    """In steps of 40 ms, the last to the pose that is measured; without a turn it is placed."""
    turns = []

    def turn(start, end):
        turns.append((start, end))
        return se3.exp_rotation([0, 0, (end - start) / NANOSECONDS])
    for known in (None, turn):
        played = play(2)
        played.duration = 0.3
        played.gravity._turn = known or (lambda start, end: None)
        log = played.update(0.4, SEEN[2])
        if known is None:
            assert played.kinds()[:2] == ['between', 'place']
            continue
        start, offset = START + NANOSECONDS // 10, played.gravity._offset
        assert {first for first, _ in turns} == {start}
        _, *steps = [entry for entry in log if entry[0] == 'between']
        ms = NANOSECONDS // 1000
        assert [(first - start - offset, last - first) for _, first, last, *_ in steps] == [
            (at * ms, min(40, 300 - at) * ms) for at in range(0, 300, 40)]
        rotations = [(REFERENCE.matrix @ SEEN[index]).rotation for index in (1, 2)]
        np.testing.assert_allclose(steps[0][3], rotations[0])
        np.testing.assert_allclose(steps[0][4], rotations[0] @ se3.exp_rotation([0, 0, 0.04]))
        np.testing.assert_allclose(steps[-1][4], rotations[1])
        assert played.kinds().count('predict') == len(steps) and 'measure' in played.kinds()


def test_without_a_frame_or_where_it_is_doubted_there_is_no_displacement(play):
    assert play(0).gravity.displacement(None, None, 1.0) is None
    played = play(3)
    played.gravity._disagreement = SimpleNamespace(is_suspected=True)
    assert played.gravity.displacement(None, None, 1.0) is None


@pytest.mark.parametrize('has_gyroscope, sigma, is_estimated', [
    (False, 0.3, False), (True, 0.3, True), (True, 0.0, False)])
def test_without_a_level_start_a_gyroscope_lets_gravity_be_estimated(
        monkeypatch, has_gyroscope, sigma, is_estimated):
    """For displacements, if they are used; the level frame stays as it is."""
    played = Played(monkeypatch, ImuSettings(dead_reckoning_sigma=sigma))
    rates = np.zeros((1, 3)) if has_gyroscope else np.full((1, 3), np.nan)
    played.gravity.add(ImuSamples(np.array([START]), rates, FORCE[None]), OFFSET)
    played.update(0.0)
    played.update(0.1, SEEN[1])
    assert len(played.filters) == is_estimated
    assert ('measure' in played.kinds()) is is_estimated
    assert 'approach' not in played.kinds()
