# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""An accelerometer on a camera whose odometry drifts: level, or named and not used."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.force_integral import ForceIntegral
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.settings import ImuSettings, OdometrySettings
from aick_ros.sources.synthetic.imu import IMU_MODELS, ImuModel, SensorNoise, imu_samples

START, RATE = 1000 * NANOSECONDS, 15
AHEAD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
GRAVITY_AHEAD = 0.0, -9.8, 0.5  # m/s^2, of a camera that looks ahead and a little down
ORIENTATION_SIGMA, POSITION_SIGMA = np.radians(0.1), 0.001
PERFECT = SensorNoise(0.0, 0.0, np.inf, 0.0)
CALIBRATED = ImuModel(PERFECT, SensorNoise(0.0015, 0.02, np.inf, 0.0), rate=100.0)


def moving(stamp):
    """Return the pose of a camera that is carried about, from rest."""
    time = max((stamp - START) / NANOSECONDS - 0.3, 0.0)
    pose = np.eye(4)
    pose[:3, :3] = se3.exp_rotation([0.4 * np.sin(0.8 * time), 0.3 * np.sin(1.1 * time),
                                     0.5 * np.sin(0.5 * time)]) @ AHEAD
    pose[:3, 3] = np.array([0.6, 0.5, 0.2]) * (1 - np.cos(np.array([0.9, 0.7, 1.3]) * time))
    return pose


def resting(stamp):
    pose = np.eye(4)
    pose[:3, :3] = se3.exp_rotation([0.1, 0.2, 0.3]) @ AHEAD
    return pose


@pytest.fixture(scope='module')
def recorded():
    """Return the samples of half a minute."""
    return imu_samples(moving, START - NANOSECONDS // 2, START + 30 * NANOSECONDS, CALIBRATED,
                       np.random.default_rng(0))


def tilt(rotation, truth):
    """Return the error of what is up [deg]."""
    return np.degrees(np.arccos(np.clip((rotation @ truth[:3, :3].T)[2, 2], -1, 1)))


def follow(samples, path=moving, seconds=15, drift=0.4, mounted=lambda second: np.eye(3)):
    """Return the tilt without and with gravity at each frame [deg], and the gravity."""
    rng, gravity, rows, before = np.random.default_rng(2), Gravity(ImuSettings()), [], None
    reference, keyframe = PoseWithCovariance.identity(), path(START)
    noise = np.diag(np.repeat([POSITION_SIGMA, ORIENTATION_SIGMA], 3) ** 2)
    for index in range(round(seconds * RATE)):
        stamp = START + index * NANOSECONDS // RATE
        gravity.add(samples.until(stamp, before), 0.0, mounted(index / RATE))
        before, truth = stamp, path(stamp)
        if index == 0:
            reference = gravity.begin(stamp) or reference
        error = np.concatenate([POSITION_SIGMA * rng.standard_normal(3),
                                ORIENTATION_SIGMA * rng.standard_normal(3)])
        seen = PoseWithCovariance(
            se3.perturbed(se3.inverse(keyframe) @ truth, error), noise)
        measured = reference @ seen
        gravity.update(stamp, reference, reference.matrix @ seen, np.eye(4), measured)
        rows.append([tilt(pose.rotation, truth)
                     for pose in (measured, gravity.levelled(measured))])
        if index % RATE == RATE - 1:  # the next keyframe, with an error that does not average out
            turned = np.radians([drift, 0.2 * drift, 0.0])
            added = np.diag(np.repeat([POSITION_SIGMA, np.radians(drift)], 3) ** 2)
            reference = reference @ PoseWithCovariance(
                se3.perturbed(se3.inverse(keyframe) @ truth,
                              np.append(np.zeros(3), keyframe[:3, :3].T @ turned)), added)
            keyframe = truth
    return np.array(rows), gravity


@pytest.mark.parametrize('known, most', [(None, 3.0), (1.0, 0.4), (4.0, 0.4), (8.0, 0.4)])
def test_a_mounting_that_is_found_on_the_way_turns_what_is_up(recorded, known, most):
    """Of an IMU that is mounted 4 deg off its transform; what is published follows slowly."""
    wrong = se3.exp_rotation(np.radians([2.4, 0.0, -3.2]))
    _, gravity = follow(changed(recorded, lambda forces: forces @ wrong), drift=0.0, seconds=9,
                        mounted=lambda second: wrong if known and second >= known else np.eye(3))
    truth = moving(START + (9 * RATE - 1) * NANOSECONDS // RATE)
    off = np.degrees(np.arccos(gravity.up @ truth[2, :3]))
    assert off < most and (known or off > 1.5)
    assert gravity.complaint == ''


def changed(samples, change):
    return dataclasses.replace(samples, accelerations=change(samples.accelerations))


@pytest.fixture
def fast(monkeypatch):
    """Let the level frame turn by a degree per second: it becomes level in half a minute then."""
    monkeypatch.setattr('aick_ros.odometry.inertial.level._FASTEST', 0.0175)


def test_it_begins_level_and_drifts_no_more(recorded, fast):
    rows, gravity = follow(recorded, seconds=30, drift=0.05)
    assert rows[0, 1] < 0.35
    drifted, level = rows[-RATE:].mean(axis=0)
    assert drifted > 0.9
    assert level < 0.7 * drifted  # as well as gravity is known then
    assert gravity.complaint == ''
    assert gravity.description.startswith('bias (')


def test_the_bias_that_tilts_the_start_is_found(fast):
    model = dataclasses.replace(CALIBRATED, accelerometer=SensorNoise(0.0015, 0.2, np.inf, 0.0))
    samples = imu_samples(moving, START - NANOSECONDS // 2, START + 30 * NANOSECONDS, model,
                          np.random.default_rng(4))
    bias = (samples.accelerations[:40] - moving(START)[:3, :3].T @ [0, 0, 9.80665]).mean(axis=0)
    rows, gravity = follow(samples, seconds=30, drift=0.0)
    assert rows[0, 1] > 1.0
    assert rows[-1, 1] < 0.7 * rows[0, 1]
    assert np.abs(gravity.estimate.bias - bias).max() < 0.06


def test_an_accelerometer_beside_the_camera_is_where_it_is_said_to_be():
    """As on a robot whose camera is on a mast: turns of the camera accelerate it."""
    place = np.array([0.1, 0.6, -0.6])
    beside = np.eye(4)
    beside[:3, 3] = place
    exact = ImuModel(PERFECT, dataclasses.replace(CALIBRATED.accelerometer, offset=0.0),
                     rate=100.0)
    samples = imu_samples(lambda stamp: moving(stamp) @ beside, START - NANOSECONDS // 2,
                          START + 30 * NANOSECONDS, exact, np.random.default_rng(0))
    found = [np.abs(follow(each, seconds=30, drift=0.0)[1].estimate.bias).max()
             for each in (samples, dataclasses.replace(samples, position=place))]
    assert found[1] < 0.03 < 0.06 < found[0]


def test_at_rest_noise_alone_tilts_the_start():
    samples = imu_samples(resting, START - NANOSECONDS // 2, START + NANOSECONDS, ImuModel(
        PERFECT, dataclasses.replace(IMU_MODELS['bmi055'].accelerometer, offset=0.0)),
        np.random.default_rng(3))
    _, gravity = follow(samples, resting, seconds=1, drift=0.0)
    # the resolution of this one is 0.11 deg
    assert tilt(gravity.start[:3, :3], resting(START)) < 0.15


@pytest.mark.parametrize('change', [
    lambda a: a @ se3.exp_rotation([np.pi / 2, 0, 0]).T, lambda a: -a],
    ids=['turned', 'sign'])
def test_wrong_axes_are_named_and_the_motion_stays_as_it_is(recorded, change):
    rows, gravity = follow(changed(recorded, change), drift=0.0)
    assert 'contradicts the motion of the camera' in gravity.complaint
    # wrong from the start, but at rest; suspected before it has turned the frame by far
    assert np.ptp(rows[:, 1]) < 1.5
    covariance = gravity.levelled(PoseWithCovariance.identity()).covariance
    np.testing.assert_allclose(np.sqrt(covariance.diagonal()[3:5]), 1.0)  # rad


def test_a_start_that_is_held_is_as_without_an_accelerometer_that_is_wrong(held):
    gravity, measured, _ = held(15, lambda forces: -forces)
    first, before = gravity.start, gravity.levelled(measured)
    assert gravity.complaint
    turn = gravity.begin_anew(np.eye(4), measured, np.radians(1.0))
    assert gravity.start is None and not gravity.is_held and not turn.is_level
    np.testing.assert_allclose(turn.T_level_odom @ first, np.eye(4), atol=1e-12)
    after = gravity.levelled(measured)
    np.testing.assert_allclose(after.matrix, se3.inverse(first) @ before.matrix, atol=1e-12)
    found = turn.apply(before)
    np.testing.assert_allclose(found.matrix, after.matrix, atol=1e-12)
    assert np.degrees(np.sqrt(found.covariance[3:5, 3:5].diagonal().max())) < 0.5
    np.testing.assert_allclose(found.covariance, after.covariance, atol=1e-9)


def suspected(change=lambda forces: -forces):
    """Return a gravity that was held with a sensor that is suspected, and how it goes on."""
    gravity, rng, reference, before = Gravity(ImuSettings()), np.random.default_rng(2), None, None
    samples = imu_samples(moving, START - NANOSECONDS // 2, START + 20 * NANOSECONDS, CALIBRATED,
                          np.random.default_rng(4))
    gravity.hold()
    sigmas = np.repeat([0.002, ORIENTATION_SIGMA], 3)
    noise = np.diag(sigmas ** 2)

    def goes_on(begin, end):
        nonlocal reference, before
        for stamp in range(START + begin * NANOSECONDS, START + end * NANOSECONDS,
                           NANOSECONDS // 30):
            gravity.add(changed(samples.until(stamp, before), change), 0.0)
            before, reference = stamp, reference or gravity.begin(stamp)
            seen = PoseWithCovariance(se3.perturbed(
                se3.inverse(moving(START)) @ moving(stamp), sigmas * rng.standard_normal(6)),
                noise)
            measured = reference @ seen
            gravity.update(stamp, reference, reference.matrix @ seen, np.eye(4), measured)
        return measured
    return gravity, goes_on(0, 5), goes_on


def test_a_start_that_is_suspected_at_the_end_of_the_wait_is_as_uncertain():
    """And unknown once it is contradicted, without a turn of what was published."""
    gravity, measured, goes_on = suspected()
    assert not gravity.complaint and gravity.tilt_sigma == np.inf
    before, start = gravity.levelled(measured), gravity.start.copy()
    assert np.degrees(np.sqrt(before.covariance[3, 3])) < 6.0  # while it is held
    turn = gravity.begin_anew(np.eye(4), measured, np.radians(1.0))
    after = gravity.levelled(measured)
    assert 25.0 < np.degrees(np.sqrt(after.covariance[3:5, 3:5].diagonal().min())) < 57.0
    held_back = turn.apply(before)
    np.testing.assert_array_equal(held_back.matrix, before.matrix)
    np.testing.assert_allclose(held_back.covariance, after.covariance, rtol=1e-9)
    np.testing.assert_array_equal(gravity.start, start)
    while not gravity.complaint:
        gravity._disagreement.note(False)
    measured = goes_on(5, 6)
    levelled = gravity.levelled(measured)
    np.testing.assert_allclose(levelled.matrix, measured.matrix, atol=1e-12)
    np.testing.assert_allclose(levelled.covariance[3:5, 3:5], np.eye(2), atol=0.01)
    assert gravity.begin_again(START + 6 * NANOSECONDS, levelled) is None


def test_a_sensor_that_is_suspected_for_a_moment_decides_no_more_until_it_is_confirmed():
    """Mounted 30 deg off: the share of contradictions goes up and down for good."""
    gravity, measured, goes_on = suspected(
        lambda forces: forces @ se3.exp_rotation([np.pi / 6, 0, 0]).T)
    gravity.begin_anew(np.eye(4), measured, np.radians(1.0))
    certain = [np.degrees(np.sqrt(gravity.levelled(goes_on(second, second + 1)).covariance[3, 3]))
               for second in range(5, 20)]
    assert min(certain) > 15.0


@pytest.mark.parametrize('is_confirmed', [False, True])
def test_a_start_of_another_recording_is_doubted_like_the_first(recorded, is_confirmed):
    """Even if the sensor was right before: it may have been mounted otherwise meanwhile."""
    _, gravity = follow(recorded, seconds=12 if is_confirmed else 1, drift=0.0)
    gravity.restart()
    lying = changed(recorded, lambda forces: -forces)
    begun, before = None, None
    noise = np.diag(np.repeat([POSITION_SIGMA, ORIENTATION_SIGMA], 3) ** 2)
    for stamp in range(START, START + 15 * NANOSECONDS, NANOSECONDS // RATE):
        gravity._forces = ForceIntegral() if begun is None else gravity._forces
        gravity.add(lying.until(stamp, before), 0.0)
        before = stamp
        if begun is None:
            begun = gravity.begin_again(stamp, PoseWithCovariance(moving(START)))
            assert tilt(begun.rotation, moving(START)) > 170.0
        seen = begun.matrix @ PoseWithCovariance(
            se3.inverse(moving(START)) @ moving(stamp), noise)
        measured = begun @ PoseWithCovariance(se3.inverse(begun.matrix) @ seen.matrix, noise)
        gravity.update(stamp, begun, seen, np.eye(4), measured)
    assert gravity.complaint
    sigmas = np.sqrt(gravity.levelled(measured).covariance.diagonal()[3:5])
    np.testing.assert_allclose(sigmas, 1.0, rtol=0.01)


@pytest.mark.parametrize('change', [np.zeros_like, lambda a: a / 9.81, lambda a: a * np.nan],
                         ids=['zeros', 'in g', 'none'])
def test_what_is_no_gravity_does_not_level(recorded, change):
    rows, gravity = follow(changed(recorded, change), seconds=2, drift=0.0)
    assert gravity.start is None
    assert np.array_equal(rows[:, 0], rows[:, 1])


def test_an_accelerometer_in_g_is_named(recorded):
    in_g = changed(recorded, lambda forces: forces / 9.81)
    assert follow(in_g, seconds=1, drift=0.0)[1].complaint == ''  # as of a jolt
    _, gravity = follow(in_g, seconds=3, drift=0.0)
    assert gravity.complaint.startswith('the accelerometer measures 1.0')
    assert gravity.complaint.endswith(
        'm/s^2, and gravity is 9.8: check that its samples are in m/s^2, not in g')


def test_a_camera_that_was_shaken_at_the_start_is_not_complained_of(recorded):
    begun = recorded.stamps < START + NANOSECONDS // 2
    shaken = dataclasses.replace(recorded, accelerations=np.where(
        begun[:, None], 2.0, 1.0) * recorded.accelerations)
    for seconds in (0.4, 2, 4):
        assert follow(shaken, seconds=seconds, drift=0.0)[1].complaint == ''


def test_a_value_that_never_changes_is_named(recorded):
    rows, gravity = follow(changed(recorded, lambda a: np.tile(a[0], (len(a), 1))), seconds=2,
                           drift=0.0)
    assert 'the accelerometer has reported' in gravity.complaint


def stuck(samples, since, until=100.0):
    """Return samples that repeat the value of a time after the start, up to another one [s]."""
    times = (samples.stamps - START) / NANOSECONDS
    frozen = (times >= since) & (times < until)
    return dataclasses.replace(samples, accelerations=np.where(
        frozen[:, None], samples.accelerations[frozen][0], samples.accelerations))


def tilt_sigmas(gravity):
    """Return the standard deviations of roll and pitch of a pose that is known exactly [rad]."""
    return np.sqrt(gravity.levelled(PoseWithCovariance.identity()).covariance.diagonal()[3:5])


def test_a_start_by_a_value_that_never_changes_is_as_uncertain_as_by_wrong_axes():
    """At rest no camera contradicts it; the sensor has been turned since it was stuck."""
    samples = imu_samples(resting, START - NANOSECONDS // 2, START + 4 * NANOSECONDS, CALIBRATED,
                          np.random.default_rng(0))
    wrong = changed(stuck(samples, -1.0), lambda forces: forces @ se3.exp_rotation([1.2, 0, 0]))
    rows, gravity = follow(wrong, resting, seconds=1, drift=0.0)
    assert gravity.start is not None and rows[-1, 1] > 50.0
    np.testing.assert_allclose(tilt_sigmas(gravity), 1.0)
    assert gravity.tilt_sigma == np.inf


@pytest.mark.parametrize('since, is_doubted', [(-0.1, True), (0.2, False)])
def test_a_start_from_before_the_sensor_was_stuck_is_as_certain_as_it_was(since, is_doubted):
    samples = imu_samples(resting, START - NANOSECONDS // 2, START + 4 * NANOSECONDS, CALIBRATED,
                          np.random.default_rng(0))
    _, gravity = follow(stuck(samples, since), resting, seconds=3, drift=0.0)
    assert gravity.complaint
    assert np.allclose(tilt_sigmas(gravity), 1.0) is is_doubted
    assert is_doubted or tilt_sigmas(gravity).max() < np.radians(6.0)


def test_a_sensor_that_measures_again_is_believed_once_a_motion_has_agreed(recorded):
    """With what is left of the tilt, that is corrected slowly, in the covariance."""
    samples = stuck(recorded, -1.0, until=1.0)
    early, late = (follow(samples, seconds=seconds, drift=0.0) for seconds in (2, 20))
    np.testing.assert_allclose(tilt_sigmas(early[1]), 1.0)
    assert early[1].complaint == ''
    assert late[0][-1, 1] < 3.0 * np.degrees(tilt_sigmas(late[1]).max()) < 20.0


def without_noise(path, seconds=4):
    """Return the samples of a simulated IMU without noise or bias, from a second before on."""
    return imu_samples(path, START - NANOSECONDS, START + seconds * NANOSECONDS,
                       ImuModel(PERFECT, PERFECT, rate=100.0), np.random.default_rng(0))


@pytest.mark.parametrize('path', [resting, moving])
def test_one_without_noise_at_rest_is_used_with_a_small_doubt(path):
    """Its value is the same until the camera moves."""
    rows, gravity = follow(without_noise(path), path, seconds=4, drift=0.0)
    assert gravity.start is not None and gravity.complaint == ''
    assert rows[0, 1] < 0.5
    assert np.radians(5.7) < tilt_sigmas(gravity).max() < np.radians(9.0)


def test_one_that_is_stuck_at_the_gravity_of_a_simulator_is_named_once_the_camera_moves():
    """It moves from 0.3 s on."""
    samples = stuck(without_noise(moving), -2.0)
    _, gravity = follow(samples, seconds=0.3, drift=0.0)
    assert gravity.start is not None and gravity.complaint == ''
    _, gravity = follow(samples, seconds=1.3, drift=0.0)
    assert gravity.complaint.startswith('the accelerometer has reported')
    np.testing.assert_allclose(tilt_sigmas(gravity), 1.0)


def test_a_start_that_is_held_is_as_without_an_accelerometer_that_is_stuck(held):
    gravity, measured, _ = held(1, lambda forces: np.full_like(forces, [0.0, -9.0, 3.0]))
    first = gravity.start.copy()
    turn = gravity.begin_anew(np.eye(4), measured, np.radians(1.0))
    assert gravity.start is None and not turn.is_level
    np.testing.assert_allclose(turn.T_level_odom @ first, np.eye(4), atol=1e-12)


def test_a_start_of_another_recording_by_a_value_that_never_changes_is_doubted(level):
    """Its clock is another one; what was stuck before the first start says nothing of it."""
    stamps = START - 100 * NANOSECONDS + np.arange(80) * NANOSECONDS // 100
    values = np.tile(GRAVITY_AHEAD, (80, 1))
    level.restart()
    level.add(ImuSamples(stamps[:40], np.full((40, 3), np.nan), values[:40]), 0.0)
    begun = level.begin_again(int(stamps[39]), PoseWithCovariance(resting(START)))
    assert begun is not None and np.degrees(np.sqrt(
        level.levelled(begun).covariance[3, 3])) < 6.0
    level.add(ImuSamples(stamps[40:], np.full((40, 3), np.nan), values[40:]), 0.0)
    np.testing.assert_allclose(tilt_sigmas(level), 1.0)


@pytest.mark.parametrize('has_gyroscope, sigma, is_estimated', [
    (False, 0.3, False), (True, 0.3, True), (True, 0.0, False)])
def test_switched_off_the_odometry_is_not_level(recorded, has_gyroscope, sigma, is_estimated):
    """Beside a gyroscope gravity is estimated all the same: a lost camera is followed by it."""
    gravity = Gravity(ImuSettings(gravity=False, dead_reckoning_sigma=sigma))
    samples = recorded.until(START)
    if not has_gyroscope:
        samples = dataclasses.replace(samples, turn_rates=np.full_like(samples.turn_rates, np.nan))
    gravity.add(samples, 0.0)
    assert gravity.begin(START) is None
    assert gravity.description == (
        'odom did not begin level; not compared with the camera yet' if is_estimated
        else 'not used, as odom did not begin level')
    pose = PoseWithCovariance(np.eye(4), 1e-6 * np.eye(6))
    gravity.update(START, pose, pose, np.eye(4), pose)
    assert (gravity.estimate is not None) is is_estimated
    assert ('odom did not begin level; bias' in gravity.description) is is_estimated
    np.testing.assert_array_equal(gravity.levelled(pose).matrix, pose.matrix)


def test_without_samples_there_is_nothing_to_say():
    gravity = Gravity(ImuSettings())
    assert gravity.begin(START) is None
    gravity.add(ImuSamples(np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3))), 0.0)
    assert (gravity.description, gravity.complaint) == ('none', '')
    assert gravity.begin(START) is None


def test_after_a_pause_the_frame_turns_by_no_more_than_in_a_fifth_of_a_second(recorded):
    """Nor at the first frame, before which there is none."""
    steps, gravity = [], Gravity(ImuSettings())
    gravity.add(recorded.until(START, None), 0.0)
    begun, before = gravity.begin(START), START
    noise = np.diag(np.repeat([POSITION_SIGMA, ORIENTATION_SIGMA], 3) ** 2)
    gravity._level = SimpleNamespace(approach=lambda up, pose, elapsed: steps.append(elapsed))
    for second in (0.0, 0.05, 0.15, 4.0, 4.1):
        stamp = START + round(second * NANOSECONDS)
        gravity.add(recorded.until(stamp, before), 0.0)
        before = stamp
        seen = begun.matrix @ PoseWithCovariance(
            se3.inverse(moving(START)) @ moving(stamp), noise)
        gravity.update(stamp, begun, seen, np.eye(4), seen)
    assert steps == pytest.approx([0.2, 0.05, 0.1, 0.2, 0.1])


def tilted(*about):
    """Return a pose and its covariance, with what is up in the world turned away."""
    root = 0.01 * np.random.default_rng(5).standard_normal((6, 6))
    pose = np.eye(4)
    pose[:3, :3] = se3.exp_rotation(about) @ resting(START)[:3, :3]
    pose[:3, 3] = 4, 5, 6
    return PoseWithCovariance(pose, root @ root.T)


@pytest.fixture
def level():
    """Return gravity with the forces of a camera at rest, that has begun level."""
    gravity = Gravity(ImuSettings())
    gravity.add(imu_samples(resting, START - NANOSECONDS // 2, START + NANOSECONDS, ImuModel(
        PERFECT, SensorNoise(1e-5, 0.0, np.inf, 0.0)), np.random.default_rng(3)), 0.0)
    gravity.begin(START)
    return gravity


def test_a_camera_that_was_turned_begins_again_level_where_it_was_and_as_it_headed(level):
    """The least turn that makes it level is about a horizontal axis."""
    before = tilted(0.3, -0.4, 0.0)
    begun = level.begin_again(START, before)
    assert tilt(begun.rotation, resting(START)) < 0.01
    np.testing.assert_array_equal(begun.translation, before.translation)
    np.testing.assert_allclose(se3.log_rotation(begun.rotation @ before.rotation.T),
                               [-0.3, 0.4, 0.0], atol=1e-4)


def test_begun_again_roll_and_pitch_are_as_certain_as_what_is_up_in_a_hand(level):
    """A hand accelerates by 0.5 m/s^2, beside the bias; the rest is as certain as before."""
    level.configure(ImuSettings(accelerometer_bias_sigma=1.2))
    before = tilted(0.3, -0.4, 0.0)
    covariance = level.levelled(level.begin_again(START, before)).covariance
    np.testing.assert_allclose(covariance[3:5, 3:5], (1.3 / 9.80665) ** 2 * np.eye(2),
                               rtol=1e-3, atol=1e-9)
    assert not covariance[3:5][:, [0, 1, 2, 5]].any()
    others = np.ix_([0, 1, 2, 5], [0, 1, 2, 5])
    np.testing.assert_array_equal(covariance[others], before.covariance[others])


def test_it_does_not_begin_again_level_where_that_is_not_known_or_not_wanted(level):
    before = tilted(0.3, -0.4, 0.0)
    assert level.begin_again(START - 10 * NANOSECONDS, before) is None  # before all samples
    level.configure(ImuSettings(gravity=False))
    assert level.begin_again(START, before) is None
    level.configure(ImuSettings())
    for _ in range(100):
        level._disagreement.note(False)
    assert level.complaint and level.begin_again(START, before) is None
    level.reset()  # odom begins elsewhere, and not level
    assert level.begin_again(START, before) is None


def turning(stamp):
    """Return the pose of a camera in a hand that shakes and turns it."""
    time = (stamp - START) / NANOSECONDS
    pose = np.eye(4)
    pose[:3, :3] = se3.exp_rotation([0.5 * np.sin(1.7 * time), 0.6 * np.sin(1.1 * time),
                                     0.4 * time]) @ AHEAD
    pose[:3, 3] = 0.02 * np.sin(np.array([6.0, 7.5, 5.0]) * time + [0, 1, 2])
    return pose


@pytest.mark.parametrize('change, is_used', [
    (lambda rates: rates, True), (lambda rates: -rates, False), (np.degrees, False),
    (np.zeros_like, False), (lambda rates: np.full_like(rates, np.nan), False)])
def test_a_gyroscope_turns_the_forces_of_a_longer_time_unless_they_contradict_it(change, is_used):
    samples = imu_samples(turning, START, START + 6 * NANOSECONDS, IMU_MODELS['icm42688'],
                          np.random.default_rng(1))
    changed = ImuSamples(samples.stamps, change(samples.turn_rates), samples.accelerations)
    tilts = []
    for stamp in range(START + 5 * NANOSECONDS // 2, START + 6 * NANOSECONDS, NANOSECONDS // 2):
        gyroscope = Gyroscope(ImuSettings(), OdometrySettings())
        gravities = Gravity(ImuSettings()), Gravity(ImuSettings(), gyroscope.rotation)
        gyroscope.add(changed.until(stamp))
        for gravity in gravities:
            gravity.add(changed.until(stamp), 0.0)
        tilts.append([tilt(gravity.begin(stamp).rotation, turning(stamp))
                      for gravity in gravities])
    without, with_it = np.sqrt(np.mean(np.square(tilts), axis=0))
    assert with_it < 0.6 * without if is_used else with_it == without


def spinning(stamp):
    """Return the pose of a camera that turns evenly, by 2 rad/s, where it is."""
    pose = np.eye(4)
    pose[:3, :3] = se3.exp_rotation(
        np.array([1.6, -1.2, 0.0]) * (stamp - START) / NANOSECONDS) @ AHEAD
    return pose


@pytest.mark.parametrize('offset', [0.0, 0.03])
def test_exact_forces_that_are_turned_exactly_are_level_however_fast_it_turns(offset):
    """Each is the mean of a fiftieth of a second, so it is that of the middle of it."""
    samples = imu_samples(spinning, START, START + 4 * NANOSECONDS, IMU_MODELS['perfect'],
                          np.random.default_rng(1))
    stamps = samples.stamps + round(offset * NANOSECONDS)
    stamp = START + 3 * NANOSECONDS
    gravity = Gravity(ImuSettings(), lambda start, end: (
        spinning(start)[:3, :3].T @ spinning(end)[:3, :3]))
    gravity.add(ImuSamples(stamps, samples.turn_rates, samples.accelerations), offset)
    assert tilt(gravity.begin(stamp).rotation, spinning(stamp)) < 0.01


@pytest.fixture(scope='module')
def held():
    """Return a gravity that was held since a start that a bias tilts, and its last pose."""
    model = dataclasses.replace(CALIBRATED, accelerometer=SensorNoise(0.0015, 0.3, np.inf, 0.0))
    samples = imu_samples(moving, START - NANOSECONDS // 2, START + 15 * NANOSECONDS, model,
                          np.random.default_rng(4))

    def begun(seconds, change=lambda forces: forces):
        gravity, before, reference = Gravity(ImuSettings()), None, None
        noise = np.diag(np.repeat([POSITION_SIGMA, ORIENTATION_SIGMA], 3) ** 2)
        gravity.hold()
        for stamp in range(START, START + seconds * NANOSECONDS, NANOSECONDS // RATE):
            gravity.add(changed(samples.until(stamp, before), change), 0.0)
            before, reference = stamp, reference or gravity.begin(stamp)
            seen = PoseWithCovariance(se3.inverse(moving(START)) @ moving(stamp), noise)
            measured = reference @ seen
            gravity.update(stamp, reference, reference.matrix @ seen, np.eye(4), measured)
        return gravity, measured, moving(stamp)
    return begun


def test_a_start_that_is_held_is_level_by_all_that_was_measured_since(held):
    gravity, measured, truth = held(10)
    first = gravity.start.copy()
    assert gravity.is_held
    np.testing.assert_array_equal(gravity.levelled(measured).matrix, measured.matrix)
    before = tilt(first[:3, :3], moving(START))
    turn = gravity.begin_anew(np.eye(4), measured, np.radians(1.0))
    assert not gravity.is_held
    assert before > 0.8
    assert tilt(gravity.start[:3, :3], moving(START)) < 0.25 * before
    assert tilt(gravity.levelled(measured).rotation, truth) < 0.25 * before
    np.testing.assert_allclose(turn.T_level_odom @ first, gravity.start, atol=1e-12)
    assert gravity.begin_anew(np.eye(4), measured, np.radians(1.0)) is None  # once


def test_corrections_of_the_dead_reckoning_turn_what_is_up(held):
    gravity, measured, _ = held(10)
    correction = np.eye(4)
    correction[:3, :3] = se3.exp_rotation([0.0, 0.0, 1.0])
    up = correction[:3, :3] @ gravity._filter.up.vector
    turn = gravity.begin_anew(correction, measured, np.radians(1.0))
    np.testing.assert_allclose(turn.T_level_odom[:3, :3] @ up, [0, 0, 1], atol=1e-9)


def test_a_start_of_which_too_little_is_known_stays(held):
    gravity, measured, _ = held(1)
    assert 1.0 < np.degrees(gravity.tilt_sigma) < 10.0
    first = gravity.start.copy()
    assert gravity.begin_anew(np.eye(4), measured, np.radians(1.0)) is None
    np.testing.assert_array_equal(gravity.start, first)
    assert not gravity.is_held


def test_without_a_level_start_nothing_is_held_yet():
    gravity = Gravity(ImuSettings())
    gravity.hold()
    assert not gravity.is_held and gravity.tilt_sigma == np.inf
    pose = PoseWithCovariance.identity()
    assert gravity.begin_anew(np.eye(4), pose, 1.0) is None
    samples = imu_samples(resting, START - NANOSECONDS // 2, START, CALIBRATED,
                          np.random.default_rng(3))
    gravity.add(samples, 0.0)
    gravity.begin(START)
    assert gravity.is_held  # from here on
    gravity.reset()
    gravity.begin(START)
    assert not gravity.is_held


def test_it_is_held_through_a_restart_before_the_first_level_start():
    """A bag loops while the camera is still covered: nothing has begun yet."""
    gravity = Gravity(ImuSettings())
    gravity.hold()
    gravity.restart()
    gravity.add(imu_samples(resting, START - NANOSECONDS // 2, START, CALIBRATED,
                            np.random.default_rng(3)), 0.0)
    gravity.begin(START)
    assert gravity.is_held
    gravity.restart()
    assert not gravity.is_held
