# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Integrals of a specific force, against closed forms."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation, Slerp

from aick_ros import kernels
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.force_integral import ForceIntegral

MS = NANOSECONDS // 1000
FORCE = np.array([1.0, -2.0, 9.0])
FIRST = se3.exp_rotation([0.3, -0.2, 0.8])


def integral(times, force=lambda time: FORCE):
    """Return the integral of samples at some times [ms]."""
    result = ForceIntegral()
    result.add(np.array([round(time * MS) for time in times], np.int64),
               np.array([force(time) for time in times], np.float64).reshape(-1, 3))
    return result


def test_an_even_turn_gives_the_closed_form():
    rate, duration = 2.0, 0.08  # rad/s about z of the body, and s
    angle = rate * duration
    # samples are neither even nor at the ends
    found = integral([-3, 1, 4, 12.5, 19, 27, 33, 41, 46, 58, 66, 71, 79, 83]).between(
        0, 80 * MS, FIRST, FIRST @ se3.exp_rotation([0, 0, angle]))
    sine, versine = np.sin(angle), 1.0 - np.cos(angle)
    once = np.array([[sine, -versine, 0], [versine, sine, 0], [0, 0, angle]]) / rate
    twice = np.array([[versine, sine - angle, 0], [angle - sine, versine, 0],
                      [0, 0, 0.5 * angle ** 2]]) / rate ** 2
    assert found.duration == pytest.approx(duration)
    assert np.allclose(found.velocity_by_bias, FIRST @ once, atol=1e-5)
    assert np.allclose(found.position_by_bias, FIRST @ twice, atol=2e-6)
    assert np.allclose(found.velocity, FIRST @ once @ FORCE, atol=1e-4)
    assert np.allclose(found.position, FIRST @ twice @ FORCE, atol=2e-5)


def test_samples_before_and_after_are_in_the_axes_of_the_mounting():
    """One that differs by less than a hundredth of a degree is the same."""
    mounted, once, twice = integral([-5, 10, 20]), *(
        se3.exp_rotation(turn) for turn in ([0.1, 0.0, 0.2], [0.1, -0.3, 0.2]))
    np.testing.assert_allclose(mounted.mount(once), once)
    np.testing.assert_allclose(mounted.mount(twice), twice @ once.T)
    mounted.add(np.array([30, 45]) * MS, np.array([FORCE, FORCE]))
    expected = integral([-5, 10, 20, 30, 45], lambda time: twice @ FORCE)
    found = [each.between(0, 40 * MS, FIRST, FIRST) for each in (mounted, expected)]
    np.testing.assert_allclose(found[0].velocity, found[1].velocity)
    assert mounted.mount(se3.exp_rotation([0.9e-4, 0, 0]) @ twice) is None
    assert mounted.mount(se3.exp_rotation([1.1e-4, 0, 0]) @ twice) is not None


def test_a_force_that_grows_is_interpolated_to_both_ends():
    found = integral([-6, 6, 18, 27, 38], lambda time: [time, 0.0, 0.0]).between(
        0, 33 * MS, np.eye(3), np.eye(3))
    assert found.velocity[0] == pytest.approx(0.5 * 33 ** 2 * 1e-3)
    assert found.position[0] == pytest.approx(33 ** 3 / 6 * 1e-6, rel=0.1)


def test_forces_are_turned_along_the_way_and_summed_by_trapezoids():
    rng = np.random.default_rng(0)
    times, forces = np.sort(rng.uniform(-9, 90, 12)).round(6), rng.normal(size=(12, 3))
    rotations = Rotation.random(2, random_state=0)
    found = integral(times, dict(zip(times, forces)).__getitem__).between(
        0, 80 * MS, *rotations.as_matrix())
    inside = np.array([0, *times[(times > 0) & (times < 80)], 80])
    turned = Slerp([0, 80], rotations)(inside).apply(
        np.stack([np.interp(inside, times, axis) for axis in forces.T], axis=1))
    velocity = cumulative_trapezoid(turned, 1e-3 * inside, axis=0, initial=0)
    np.testing.assert_allclose(found.velocity, velocity[-1], atol=1e-12)
    remaining = 1e-3 * (80 - inside[:, None]) * turned
    np.testing.assert_allclose(
        found.position, cumulative_trapezoid(remaining, 1e-3 * inside, axis=0)[-1], atol=1e-12)


def test_its_derivative_by_the_stamps_is_that_of_forces_that_change():
    """Of forces c t^2 the integral over T at an offset grows by (T^2 + 2 T t) c."""
    found = integral(range(-50, 90, 2), lambda time: [time ** 2, -time, 7.0]).between(
        0, 80 * MS, FIRST, FIRST)
    # by the ten milliseconds before: at an offset of five less
    by_velocity = FIRST @ [80 ** 2 - 10 * 80, -80, 0]
    by_position = FIRST @ [80 ** 3 / 3 - 5 * 80 ** 2, -80 ** 2 / 2, 0]
    np.testing.assert_allclose(found.velocity_by_offset, by_velocity, atol=3)
    np.testing.assert_allclose(found.position_by_offset, 1e-3 * by_position, atol=0.1)


def test_no_forces_have_no_integral():
    with pytest.raises(ValueError, match='there are no forces'):
        kernels.integrate_forces(np.empty(0, np.int64), np.empty((0, 3)), 0, MS, np.eye(3),
                                 np.eye(3), np.empty((2, 12)))


@pytest.mark.parametrize('times', [
    [], [60, 70, 80], [0, 5, 70, 80], [0, 5, 10, 20]],
    ids=['no samples', 'late', 'a gap', 'an end'])
def test_what_was_not_measured_is_not_invented(times):
    assert integral(times).between(0, 80 * MS, np.eye(3), np.eye(3)) is None


def test_recent_forces_are_those_before_a_stamp():
    found = integral(range(0, 100, 10), lambda time: [time, 0.0, 0.0]).recent(55 * MS, 20 * MS)
    assert found[:, 0].tolist() == [40.0, 50.0]


def test_memory_is_bounded_and_time_that_goes_back_begins_anew():
    samples = integral(range(0, 9000, 10))
    assert len(samples.recent(10_000 * MS, 10_000 * MS)) <= 401
    samples.add(np.array([5 * MS]), FORCE[None])
    assert len(samples.recent(10_000 * MS, 10_000 * MS)) == 1


def test_recent_forces_include_both_ends():
    forces = integral(range(0, 100, 10), lambda time: [time, 0.0, 0.0])
    assert forces.recent(60 * MS, 20 * MS)[:, 0].tolist() == [40.0, 50.0, 60.0]
    assert forces.recent(60 * MS - 1, 20 * MS - 2)[:, 0].tolist() == [50.0]
    assert forces.recent(-1, 5).shape == (0, 3)
    assert forces.last == 90 * MS and ForceIntegral().last is None


@pytest.mark.parametrize('times, is_known', [
    ([50, 60, 70], True), ([50.000001, 60, 70], False),  # the first one is late
    ([0, 10, 60, 80], True), ([0, 10, 60.000001, 80], False),  # a gap
    ([-10, 0, 30], True), ([-10, 0, 29.999999], False),  # the last one is early
    ([-20, 30, 80], True), ([-20.000001, 30, 80], False)])  # from before the start
def test_nothing_is_known_beyond_50_ms_of_a_sample(times, is_known):
    found = integral(times).between(0, 80 * MS, np.eye(3), np.eye(3))
    assert (found is not None) == is_known
    if is_known:
        assert np.allclose(found.velocity, 0.08 * FORCE)
        assert np.allclose(found.position, 0.5 * 0.08 ** 2 * FORCE, rtol=0.3)


def test_two_seconds_are_remembered_at_least():
    samples, smallest = ForceIntegral(), 999
    for time in range(0, 9000, 10):
        samples.add(np.array([time * MS]), FORCE[None])
        if time >= 2000:
            smallest = min(smallest, len(samples.recent(time * MS, 10_000 * MS)))
    assert smallest == 201


def test_a_stamp_that_repeats_begins_anew():
    samples = integral([0, 10, 20])
    samples.add(np.array([20 * MS]), FORCE[None])
    assert len(samples.recent(20 * MS, 20 * MS)) == 1
