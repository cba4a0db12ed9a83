# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which settings and which parts an odometry gives its parts, at the start and after a change."""

import dataclasses
import itertools

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.features.detector import Detector
from aick_ros.geometry import se3
from aick_ros.odometry import Odometry
from aick_ros.registration import stage_times
from aick_ros.registration.learned import Learned
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

FIRST = with_values(Settings(), {'sensor.depth_scale_sigma': 0.0})  # of the steps
OTHER = with_values(Settings(), {'odometry.hold_time': 0.7, 'imu.gravity': False})
SIFT = with_values(Settings(), {'features.detector': 'sift'})
START = se3.exp([1.0, 2.0, 3.0, 0.3, -0.2, 0.5])
CONFIGURED = {
    'Gyroscope': ('imu', 'odometry'), 'Gravity': ('imu',), 'OtherOdometry': ('odometry',),
    'Plane': ('odometry',), 'PositionFilter': ('odometry',)}


class Own(Detector):
    """A detector of a caller's own; here nobody detects by it."""

    def detect(self, grey):
        raise NotImplementedError


@pytest.fixture
def changed(parts, steps):
    """Return an odometry with a first frame whose settings have changed."""
    one = steps(T_odom_camera=START)
    one.take(0.0)
    one.odometry.change_settings(OTHER)
    return one


def test_each_part_gets_the_settings_it_uses(parts, changed):
    for name, groups in CONFIGURED.items():
        at_the_start, changed_to = (tuple(getattr(settings, group) for group in groups)
                                    for settings in (Settings(), OTHER))
        assert [given[:len(groups)] for given in parts.arguments(name)] == [at_the_start]
        assert parts.asked(name, 'configure') == [at_the_start, changed_to]
    assert parts.arguments('MotionModel') == [(Settings().odometry,), (OTHER.odometry,)]


def test_gravity_asks_the_gyroscope_how_the_camera_turned(parts, changed):
    [(_, turn)] = parts.arguments('Gravity')
    turn(5, 9)
    assert parts.asked('Gyroscope', 'rotation') == [(5, 9)]


def test_parts_that_use_others_get_the_new_ones(parts, changed):
    odometry = changed.odometry
    registrars = parts.arguments('Registrar')
    assert len(registrars) == 2 and registrars[0][1:] == registrars[1][1:]
    for (settings, times, learned, detector), expected in zip(registrars, (FIRST, OTHER)):
        assert settings == expected
        assert isinstance(times, StageTimes) and isinstance(learned, Learned)
        assert detector is None
    registrar = odometry._registrar
    assert parts.arguments('ExpectedMotion')[-1] == (
        OTHER.odometry, odometry._gyroscope, odometry._other, odometry._accelerometer)
    assert parts.arguments('Attempts')[-1] == (OTHER, registrar, odometry._expected)
    assert parts.arguments('KeyframeChoice')[-1] == (OTHER, registrar)
    assert parts.asked('KeyframeMemory', 'configure') == [(OTHER, registrar)]
    assert len(parts.arguments('KeyframeMemory')) == 1


def test_what_is_shown_of_the_sensors_is_theirs(parts, steps):
    odometry = steps().odometry
    assert odometry.gyroscope is odometry._gyroscope and odometry.gravity is odometry._path.gravity
    learned = parts.arguments('Registrar')[0][2]
    learned.misalignment.assume(Misalignment(np.zeros(6), 0.03, 0.0, 0.0))
    assert odometry.misalignment is learned.misalignment.found
    assert odometry.misalignment.delay == 0.03


def test_with_other_settings_the_next_frame_is_tracked_on(parts, changed, attempt_to):
    parts.attempts = [attempt_to()]
    update = changed.take(0.1)
    assert update.status is Status.OK and not update.recovered
    assert len(parts.asked('Gravity', 'restart')) == 1
    assert len(parts.asked('KeyframeChoice', 'begin')) == 1


def test_what_was_prepared_before_a_change_is_prepared_again(parts, changed, attempt_to):
    parts.attempts = [attempt_to()]
    for seconds, is_kept in ((0.1, True), (0.2, False)):
        preparation = changed.odometry.prepare(changed.frame(seconds))
        if not is_kept:
            changed.odometry.change_settings(Settings())
        changed.odometry.register(preparation)
        (registered, _), = parts.asked('Registrar', 'prepared')[-1:]
        assert (registered is preparation) == is_kept
        assert registered.preparer is changed.odometry._registrar.preparer
        assert registered.frame.stamp == preparation.frame.stamp


@pytest.mark.parametrize('detector', [None, Own()])
def test_a_detector_of_the_caller_is_used_whatever_the_settings(
        parts, steps, attempt_to, detector):
    one, parts.attempts = steps(T_odom_camera=START, detector=detector), [attempt_to()]
    one.take(0.0)
    one.odometry.change_settings(SIFT)
    assert parts.arguments('Registrar')[-1][3] is detector
    assert one.take(0.1).status is Status.OK


def test_matches_are_with_the_keypoints_of_the_reference_as_it_is_prepared_by_now(
        parts, steps, attempt_to):
    one, parts.attempts = steps(), [attempt_to()]
    first = one.take(0.0)
    again = parts.prepared(first.prepared.frame)
    parts.answers['Registrar', 'prepared_like'] = again
    second = one.take(0.1)
    assert second.reference is again.keypoints
    (target, source), = parts.asked('Registrar', 'prepared_like')
    assert target.stamp == first.stamp and source.stamp == second.stamp


def test_settings_that_no_registrar_takes_change_nothing(parts, changed, monkeypatch):
    def reject(*_):
        raise InputError('no vocabulary')
    monkeypatch.setattr('aick_ros.odometry.odometry.Registrar', reject)
    parts.log.clear()
    before = dict(vars(changed.odometry))
    with pytest.raises(InputError):
        changed.odometry.change_settings(SIFT)
    assert parts.log == [] and vars(changed.odometry) == before


def test_a_reset_to_what_is_no_pose_changes_nothing(parts, changed):
    parts.log.clear()
    before = dict(vars(changed.odometry))
    with pytest.raises(InputError, match='T_odom_camera'):
        changed.odometry.reset(np.zeros((4, 4)))
    assert parts.log == [] and vars(changed.odometry) == before


def test_settings_of_another_kind_are_rejected():
    with pytest.raises(InputError, match='settings'):
        Odometry(dataclasses.asdict(Settings()))


def test_a_frame_has_the_time_of_its_stages_and_of_its_preparation(parts, steps, monkeypatch):
    """By a clock that goes on by one second each time it is read."""
    one = steps()
    times = parts.arguments('Registrar')[0][1]
    monkeypatch.setattr(stage_times, 'clock', map(float, itertools.count()).__next__)
    with times.stage('registration'):  # of a frame that nobody asked for
        pass
    preparation = one.odometry.prepare(one.frame(0.0))
    prepare = parts.answers['Registrar', 'prepared']

    def timed(*args):
        with times.stage('refinement'):
            return prepare(*args)
    parts.answers['Registrar', 'prepared'] = timed
    timing = one.odometry.register(preparation).timing
    assert timing == {'features': 1000.0, 'surface': 1000.0, 'registration': 0.0,
                      'refinement': 1000.0, 'total': 3000.0}
    assert not preparation.times.take()['total']
