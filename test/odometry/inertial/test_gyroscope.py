# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A gyroscope beside a camera that sees the truth: what is learned, noticed and done without."""

import re
from dataclasses import replace

import numpy as np
import pytest

from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.inertial.rotation_integral import RotationIntegral
from aick_ros.settings import ImuSettings, OdometrySettings

MS = NANOSECONDS // 1000
BIAS = np.array([0.01, -0.02, 0.015])
RATE = np.array([0.2, 0.5, -0.3])  # rad/s, of a camera that turns evenly
ABOUT_X = se3.exp_rotation((np.pi / 2, 0, 0))
FRAMES = range(0, 2001, 40)  # ms
EXACT_AXES = ImuSettings(gyroscope_scale_sigma=0.0, mounting_sigma=0.0)


def seen(start, end):
    """Return what a camera with an error of 0.05 deg sees between two times [ms]."""
    pose = np.eye(4)
    pose[:3, :3] = se3.exp_rotation((end - start) / 1000 * RATE)
    return PoseWithCovariance(pose, np.radians(0.05) ** 2 * np.eye(6))


def samples(start, end, rate=lambda time: RATE + BIAS, period=5):
    times = np.arange(start, end, period)
    rates = np.array([rate(time) for time in times], np.float64).reshape(-1, 3)
    return ImuSamples(times.astype(np.int64) * MS, rates, np.full(rates.shape, np.nan))


def noisy(time):
    return RATE + BIAS + 1e-4 * np.random.default_rng(int(time) + 100).standard_normal(3)


def follow(change=lambda samples: samples, rate=noisy, settings=ImuSettings()):
    """Return a gyroscope that was compared with keyframes of 0.4 s for two seconds."""
    gyroscope = Gyroscope(settings, OdometrySettings())
    for time in FRAMES:
        gyroscope.add(change(samples(time - 35, time + 5, rate)))
        keyframe = 400 * ((time - 1) // 400)
        if time:
            gyroscope.learn(keyframe * MS, time * MS, seen(keyframe, time))
    return gyroscope


def turned(gyroscope, start=1000, end=2000):
    """Return the error of the rotation between two times [ms], in its standard deviations."""
    term = gyroscope.term(start * MS, end * MS)
    error = term.added_to(seen(start, end)).error
    return error, float(np.sqrt(error @ np.linalg.solve(term.covariance, error)))


def test_the_bias_is_learned_and_the_rotation_is_right():
    gyroscope = follow(settings=EXACT_AXES)
    assert np.abs(gyroscope.bias - BIAS).max() < 4 * gyroscope.bias_sigma.max() < 0.006
    assert gyroscope.complaint == ''
    error, sigmas = turned(gyroscope)
    assert np.linalg.norm(error) < np.radians(0.1)
    assert sigmas < 4.0


def test_a_mount_that_is_turned_and_a_scale_are_learned_and_named():
    """Of a camera that turns about all axes."""
    axes, settings = np.radians([30.0, 20.0, 25.0]), ImuSettings(gyroscope_bias_sigma=0.0)
    wrong = 1.008 * se3.exp_rotation(np.radians([0.0, 1.2, 0.0]))
    gyroscope, true = Gyroscope(settings, OdometrySettings()), RotationIntegral()
    times = np.arange(-40, 6001, 5)
    rates = axes * np.cos(times[:, None] / 1000 * [3.0, 2.2, 1.7] + [0.0, 1.0, 2.0]) * 3.0
    true.add(times * MS, rates)
    for time in range(0, 6000, 40):
        now = (time - 40 < times) & (times <= time)
        gyroscope.add(ImuSamples(times[now] * MS, rates[now] @ wrong.T, 0.0 * rates[now]))
        keyframe = 400 * ((time - 1) // 400)
        if time:
            pose = np.eye(4)
            pose[:3, :3] = true.between(keyframe * MS, time * MS, np.zeros(3)).rotation
            gyroscope.learn(keyframe * MS, time * MS,
                            PoseWithCovariance(pose, np.radians(0.05) ** 2 * np.eye(6)))
    assert gyroscope.complaint == ''
    angle, percent = map(float, re.fullmatch(
        r'bias .*; to fit the camera its axes are turned by (.*) deg and scaled by up to (.*) %',
        gyroscope.description).groups())
    assert angle == pytest.approx(1.2, abs=0.1) and percent == pytest.approx(0.8, abs=0.1)
    np.testing.assert_array_equal(Gyroscope(settings, OdometrySettings()).mounting, np.eye(3))
    term = gyroscope.term(4000 * MS, 5000 * MS)
    true_turn = true.between(4000 * MS, 5000 * MS, np.zeros(3)).rotation
    assert se3.angle(true_turn.T @ term.T_target_source[:3, :3]) < np.radians(0.03)


AXIS = np.array([0.6, 0.0, -0.8])


def found_turned(gyroscope, degrees, sigma):
    """Let the camera show that axes are turned, with a standard deviation in each [deg]."""
    calibration = gyroscope._calibration
    calibration.values[4:13] = 1.01 * se3.exp_rotation(np.radians(degrees) * AXIS).ravel()
    # a rotation is half of the difference of two numbers
    calibration.covariance[4:13, 4:13] = 2.0 * np.radians(sigma) ** 2 * np.eye(9)
    gyroscope._find_mounting()
    return np.degrees(se3.log_rotation(gyroscope.mounting))


@pytest.mark.parametrize('found, sigma, of_all', [
    (0.0, 0.0, 0.0), (0.5, 0.0, 0.05), (1.5, 0.0, 0.75), (6.0, 0.0, 5.647),
    (6.0, 0.2, 5.629), (1.5, 0.25, 0.72)])
def test_the_larger_and_the_more_certain_a_rotation_of_axes_the_more_is_of_the_whole_imu(
        found, sigma, of_all):
    """A small one may be the gyroscope's alone."""
    np.testing.assert_allclose(found_turned(ready(ImuSettings()), found, sigma), of_all * AXIS,
                               atol=1e-3)


def test_a_mounting_that_is_known_stays_until_another_is_known_as_well():
    """As while the gyroscope is learned anew; or where it is not used."""
    gyroscope = ready(ImuSettings())
    assert 4.0 < np.linalg.norm(found_turned(gyroscope, 5.0, 0.5)) < 4.5
    known = found_turned(gyroscope, 5.0, 0.1)
    assert np.linalg.norm(known) > 4.5
    np.testing.assert_array_equal(found_turned(gyroscope, 1.0, 0.3), known)  # 0.52 about all axes
    np.testing.assert_array_equal(found_turned(Gyroscope(ImuSettings(), OdometrySettings()),
                                               5.0, 0.1), np.zeros(3))
    assert np.linalg.norm(found_turned(gyroscope, 1.0, 0.2)) < 0.4


def test_of_a_short_turn_the_noise_of_the_gyroscope_limits_what_is_learned():
    noise = 0.01  # rad/s/sqrt(Hz)
    gyroscope = Gyroscope(replace(EXACT_AXES, gyroscope_noise=noise, gyroscope_bias_sigma=0.1),
                          OdometrySettings())
    gyroscope.add(samples(-20, 440))
    gyroscope.learn(0, 400 * MS, PoseWithCovariance(seen(0, 400).matrix, 1e-12 * np.eye(6)))
    assert gyroscope.bias_sigma == pytest.approx(3 * [noise / np.sqrt(0.4)], rel=0.1)


def test_another_noise_counts_from_then_on():
    """Of a short turn it limits what is learned, by the settings of that time."""
    settings = replace(EXACT_AXES, gyroscope_bias_sigma=0.1)
    gyroscope = Gyroscope(settings, OdometrySettings())
    gyroscope.configure(replace(settings, gyroscope_noise=0.01), OdometrySettings())
    gyroscope.add(samples(-20, 440))
    gyroscope.learn(0, 400 * MS, PoseWithCovariance(seen(0, 400).matrix, 1e-12 * np.eye(6)))
    assert gyroscope.bias_sigma == pytest.approx(3 * [0.01 / np.sqrt(0.4)], rel=0.1)


def test_at_rest_the_bias_is_followed_though_the_keyframe_stays():
    """A sensor that warms up for two minutes, by 0.2 deg/s; frames come at 2 Hz."""
    gyroscope = Gyroscope(ImuSettings(), OdometrySettings())
    final = np.radians([0.2, -0.1, 0.0])
    still = PoseWithCovariance(np.eye(4), np.radians(0.01) ** 2 * np.eye(6))
    for time in range(0, 120_000, 500):
        gyroscope.add(samples(time - 500, time + 20, lambda now: now / 120_000 * final, 20))
        if time:
            gyroscope.learn(0, time * MS, still)
    assert np.abs(gyroscope.bias - final).max() < np.radians(0.03)
    assert gyroscope.bias_sigma.max() < np.radians(0.02)


def test_a_recording_that_is_played_again_teaches_what_it_did():
    """At rest for 25 s: with the same stamps, what was known of frames before is of others."""
    rng, gyroscope = np.random.default_rng(0), Gyroscope(ImuSettings(), OdometrySettings())
    for _ in range(3):
        gyroscope.restart()
        for time in range(1000, 26_000, 40):
            gyroscope.add(samples(time - 40, time, lambda now: rng.normal(BIAS, 0.003)))
            pose = np.eye(4)
            pose[:3, :3] = se3.exp_rotation(rng.normal(0.0, 2e-4, 3))
            gyroscope.learn(1000 * MS, time * MS, PoseWithCovariance(pose, 4e-8 * np.eye(6)))
    assert np.isfinite(gyroscope.bias_sigma).all() and gyroscope.complaint == ''
    assert (np.abs(gyroscope.bias - BIAS) < 4 * gyroscope.bias_sigma).all()


def test_the_frames_since_a_keyframe_have_its_error_in_common():
    """Fifty of them know the bias less than twice as well as the last one."""
    gyroscope = Gyroscope(replace(EXACT_AXES, gyroscope_noise=1e-6, time_offset_sigma=0.0),
                          OdometrySettings())
    for time in FRAMES:
        gyroscope.add(samples(time - 35, time + 5))
        if time:
            gyroscope.learn(0, time * MS, seen(0, time))
    by_last = np.radians(0.05) / (FRAMES[-1] / 1000)
    assert 0.5 * by_last < gyroscope.bias_sigma.min() < by_last


def test_a_sum_of_motions_has_the_error_of_the_bias_in_common():
    gyroscope = follow()
    alone, summed = (gyroscope.term(1000 * MS, 1100 * MS, is_summed) for is_summed in (0, 1))
    assert np.trace(summed.covariance) > 3 * np.trace(alone.covariance)


@pytest.mark.parametrize('damage', [
    lambda s: s[::-1], lambda s: s[np.repeat(np.arange(len(s)), 2)],
    lambda s: ImuSamples(s.stamps, np.where((s.stamps // MS % 20 == 0)[:, None] & np.array(
        [True, False, False]), np.nan, s.turn_rates), s.accelerations),
    lambda s: ImuSamples(s.stamps, np.where((s.stamps // MS % 20 == 0)[:, None], 1e9,
                                            s.turn_rates), s.accelerations)],
    ids=['out of order', 'repeated', 'not a number', 'beyond any range'])
def test_single_samples_that_cannot_be_used_are_dropped(damage):
    gyroscope = follow(damage)
    assert gyroscope.dropped > 10
    assert gyroscope.complaint == ''
    assert gyroscope.term(1990 * MS, 2000 * MS) is None or turned(gyroscope, 1900)[1] < 4.0


def test_a_gap_is_not_bridged():
    gyroscope = follow(lambda s: s if not 1200 < s.stamps[0] / MS < 1400 else s[:0])
    assert gyroscope.term(1160 * MS, 1480 * MS) is None
    assert turned(gyroscope, 1480)[1] < 4.0


@pytest.mark.parametrize('rate, words', [
    (lambda time: np.zeros(3), r'\(0, 0, 0\) rad/s'),
    (lambda time: np.array([0.4, 0.0, 0.0]), r'\(0.4, 0, 0\) rad/s'),
    (lambda time: ABOUT_X @ noisy(time), 'another axis'),
    (lambda time: -noisy(time), 'another axis'),
    (lambda time: np.degrees(noisy(time)), 'rad/s')],
    ids=['zeros', 'stuck', 'turned axes', 'sign', 'degrees'])
def test_one_that_lies_is_named_and_not_used(rate, words):
    gyroscope = follow(rate=rate)
    assert gyroscope.term(1000 * MS, 2000 * MS) is None
    assert gyroscope.rate_at(2000 * MS) is None
    assert re.search(words, gyroscope.complaint)


@pytest.mark.parametrize('rotations', [0, 7, 8])
def test_one_is_used_once_the_camera_has_seen_eight_rotations_alike(rotations):
    """But for what was before the first image: that no camera has seen."""
    gyroscope = Gyroscope(ImuSettings(), OdometrySettings())
    gyroscope.add(samples(0, 2000, noisy))
    for time in range(400, 400 + 40 * rotations, 40):
        gyroscope.learn((time - 40) * MS, time * MS, seen(time - 40, time))
    assert gyroscope.complaint == ''
    assert (gyroscope.term(1000 * MS, 1900 * MS) is not None) == (rotations == 8)
    assert (gyroscope.rate_at(1000 * MS) is not None) == (rotations == 8)
    assert gyroscope.rotation(1000 * MS, 1900 * MS) is not None


def test_what_disagrees_confirms_nothing():
    gyroscope = Gyroscope(ImuSettings(), OdometrySettings())
    gyroscope.add(samples(0, 2000, lambda time: -noisy(time) if time < 1000 else noisy(time)))
    for start in range(400, 1640, 40):
        gyroscope.learn(start * MS, (start + 40) * MS, seen(start, start + 40))
        if start < 1000 + 7 * 40:
            assert gyroscope.term(1000 * MS, 1900 * MS) is None


def test_one_that_comes_right_is_used_again():
    gyroscope = follow(rate=lambda time: noisy(time) * (-1.0 if time < 500 else 1.0))
    assert gyroscope.complaint == ''
    assert turned(gyroscope, 1500)[1] < 4.0


@pytest.mark.parametrize('wrong', [
    lambda rate: rate[[1, 2, 0]], lambda rate: np.degrees(rate), lambda rate: rate + 0.2])
def test_one_that_was_wrong_for_seconds_is_used_once_it_is_right(wrong):
    """What was learned of it meanwhile, or of what it was before, is forgotten."""
    gyroscope = Gyroscope(ImuSettings(), OdometrySettings())
    for time in range(40, 7040, 40):
        gyroscope.add(samples(time - 40, time + 1, lambda at: (
            noisy(at) if not 1000 <= at < 4000 else wrong(noisy(at)))))
        keyframe = 400 * ((time - 1) // 400)
        gyroscope.learn(keyframe * MS, time * MS, seen(keyframe, time))
        if 2000 <= time < 4000:
            assert gyroscope.complaint and gyroscope.term((time - 40) * MS, time * MS) is None
    assert gyroscope.complaint == ''
    assert turned(gyroscope, 5500, 7000)[1] < 4.0


def test_a_bias_that_jumps_is_found():
    gyroscope = Gyroscope(ImuSettings(), OdometrySettings())
    for time in range(40, 6040, 40):
        gyroscope.add(samples(time - 40, time + 1, lambda at: (
            noisy(at) + 0.03 * (at >= 2000))))
        keyframe = 400 * ((time - 1) // 400)
        gyroscope.learn(keyframe * MS, time * MS, seen(keyframe, time))
    assert gyroscope.complaint == ''
    np.testing.assert_allclose(gyroscope.bias, BIAS + 0.03, atol=0.006)


def test_without_samples_nothing_is_known_and_nothing_is_wrong():
    gyroscope = follow(lambda s: s[:0])
    assert gyroscope.term(0, 100 * MS) is None
    assert gyroscope.complaint == ''


def test_samples_that_have_not_arrived_cost_certainty():
    gyroscope = follow()
    known, missed = (gyroscope.term(1900 * MS, end * MS).covariance for end in (2000, 2018))
    assert np.trace(missed) > 2 * np.trace(known)


def test_the_bias_walks_with_the_time_between_samples_and_not_back():
    """Its variance grows by the square of the walk a second; a clock set back adds nothing."""
    gyroscope = Gyroscope(ImuSettings(gyroscope_bias_walk=0.01), OdometrySettings())
    variances = []
    for start, end in ((10_000, 10_400), (10_400, 12_400), (1000, 1400), (1400, 2400)):
        gyroscope.add(samples(start, end))
        variances.append(gyroscope.bias_sigma ** 2)
    growth = np.diff(variances, axis=0) / 0.01 ** 2
    np.testing.assert_allclose(growth, np.repeat([[2.0], [0.0], [1.0]], 3, axis=1), atol=1e-9)


def ready(settings, acceleration=15.0, rate=lambda time: RATE):
    """
    Return a gyroscope with two seconds of samples, from 0 to 1995 ms, that a camera confirms.

    What that sees is so uncertain that nothing is learned.
    """
    gyroscope = Gyroscope(settings, OdometrySettings(angular_acceleration_sigma=acceleration))
    gyroscope.add(samples(0, 2000, lambda time: rate(time) + 1e-9 * (time % 2)))
    for end in range(1100, 1900, 100):
        gyroscope.learn(1000 * MS, end * MS, PoseWithCovariance(np.eye(4), 1e9 * np.eye(6)))
    return gyroscope


@pytest.mark.parametrize('extrapolated', [0, 5, 15])
def test_the_noise_of_a_rotation_grows_with_its_time_and_with_what_has_not_arrived(extrapolated):
    """Of a calibration that is exact: n^2 t, and (a e^2 / 2)^2 of an unknown acceleration."""
    gyroscope = ready(replace(EXACT_AXES, gyroscope_noise=0.002, gyroscope_bias_sigma=0.0,
                              gyroscope_bias_walk=0.0, time_offset_sigma=0.0), 20.0)
    end = 1995 + extrapolated
    term = gyroscope.term(1000 * MS, end * MS)
    variance = 0.002 ** 2 * (end - 1000) / 1000 + (0.5 * 20.0 * (extrapolated / 1000) ** 2) ** 2
    np.testing.assert_allclose(term.covariance, variance * np.eye(3), rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(term.T_target_source[:3, :3],
                               se3.exp_rotation((end - 1000) / 1000 * RATE), atol=1e-8)
    np.testing.assert_array_equal(term.rows, np.eye(3, 6, 3))


@pytest.mark.parametrize('duration, factor', [(0.125, 4.0), (0.25, 2.0), (0.75, 1.0)])
def test_in_a_sum_the_bias_counts_as_if_it_stayed_for_half_a_second(duration, factor):
    gyroscope = ready(ImuSettings(gyroscope_noise=1e-7, gyroscope_bias_sigma=0.01,
                                  time_offset_sigma=0.0), rate=lambda time: np.zeros(3))
    end = round((0.2 + duration) * 1000) * MS
    alone, summed = (gyroscope.term(200 * MS, end, is_summed).covariance
                     for is_summed in (False, True))
    np.testing.assert_allclose(alone, (0.01 * duration) ** 2 * np.eye(3), rtol=1e-3, atol=1e-12)
    np.testing.assert_allclose(summed, factor * alone, rtol=1e-3, atol=1e-12)


def test_stamps_of_images_are_moved_by_the_offset_to_those_of_samples():
    """Of a turn that begins at 1 s of the samples: of the images 40 ms earlier or later."""
    def late(time):
        return RATE * (time >= 1000)

    for offset in (0.04, -0.04):
        gyroscope = ready(ImuSettings(time_offset=offset), rate=late)
        assert gyroscope.time_offset == pytest.approx(offset)
        term = gyroscope.term(500 * MS, 1500 * MS)
        np.testing.assert_allclose(se3.log_rotation(term.T_target_source[:3, :3]),
                                   (0.5 + offset) * RATE, atol=2e-3)
        start = round(1000 - 1000 * offset)
        np.testing.assert_allclose(gyroscope.rate_at((start + 10) * MS), RATE, atol=1e-6)
        np.testing.assert_allclose(gyroscope.rate_at((start - 10) * MS), 0.0, atol=1e-6)


def test_it_is_described_with_its_numbers():
    gyroscope = Gyroscope(ImuSettings(gyroscope_bias_sigma=np.radians(0.5), time_offset=0.0123,
                                      gyroscope_bias_walk=0.0), OdometrySettings())
    assert gyroscope.description == 'none'
    gyroscope.add(samples(0, 500))
    known = 'bias (0.00, 0.00, 0.00) deg/s, known to 0.50; its clock is 12.3 ms ahead of that of '
    known += ('the images; to fit the camera its axes are turned by 0.0 deg and scaled by up to '
              '0.0 %')
    assert gyroscope.description == known
    gyroscope.add(samples(0, 10))
    assert gyroscope.dropped == 2
    assert gyroscope.description == known + '; 2 samples dropped'


def test_the_bias_drifts_while_samples_come():
    """Not by the time before the first one, and not twice for what repeats."""
    gyroscope = Gyroscope(ImuSettings(gyroscope_bias_sigma=0.001, gyroscope_bias_walk=0.01),
                          OdometrySettings())
    gyroscope.add(samples(5000, 5005))
    np.testing.assert_allclose(gyroscope.bias_sigma, 0.001)
    for start in (5005, 5005, 6000):
        gyroscope.add(samples(start, start + 1000, noisy))
    np.testing.assert_allclose(gyroscope.bias_sigma, np.hypot(0.001, 0.01 * np.sqrt(1.995)),
                               rtol=1e-6)


def test_its_bias_is_a_copy():
    gyroscope = ready(ImuSettings())
    before = gyroscope.bias
    gyroscope.bias[:] = 5.0
    assert gyroscope.bias.tolist() == before.tolist()
