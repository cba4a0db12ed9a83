# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Samples of an IMU: choice, axes and what is rejected."""

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.imu import ImuSamples, joined
from aick_ros.geometry import se3

SAMPLES = ImuSamples(np.arange(5, dtype=np.int64) * 10, np.arange(15.0).reshape(5, 3),
                     -np.arange(15.0).reshape(5, 3))


def test_samples_between_two_stamps_are_shared_by_no_two_intervals():
    parts = [SAMPLES.until(10), SAMPLES.until(25, after=10), SAMPLES.until(99, after=25)]
    assert [part.stamps.tolist() for part in parts] == [[0, 10], [20], [30, 40]]
    whole = joined(parts)
    for name in ('stamps', 'turn_rates', 'accelerations'):
        assert np.array_equal(getattr(whole, name), getattr(SAMPLES, name))


def test_nothing_joined_is_no_samples():
    assert len(joined([])) == 0


def test_other_axes_keep_lengths_and_turn_vectors():
    about_z = np.eye(4)
    about_z[:3] = np.column_stack([se3.exp_rotation((0, 0, np.pi / 2)), [0.1, -0.2, 0.3]])
    turned = SAMPLES.in_camera(about_z)
    x, y, z = SAMPLES.turn_rates.T
    assert np.allclose(turned.turn_rates, np.column_stack([-y, x, z]))
    assert np.allclose(turned.accelerations, -turned.turn_rates)
    assert SAMPLES.position.tolist() == [0.0, 0.0, 0.0]
    about_z[:3, 3] = 0.0  # which the samples do not share
    for part in (turned, turned[1:3], turned.until(20), joined([SAMPLES, turned])):
        assert part.position.tolist() == [0.1, -0.2, 0.3]


@pytest.mark.parametrize('stamps, rates', [
    (np.arange(3.0), np.zeros((3, 3))), (np.arange(3), np.zeros((3, 2))),
    (np.arange(3), np.zeros((4, 3))), (np.arange(3), np.zeros((3, 3), np.float32))])
def test_arrays_that_do_not_fit_are_rejected(stamps, rates):
    with pytest.raises(InputError, match='of an IMU: an array of .* is required'):
        ImuSamples(stamps, rates, np.zeros((3, 3)))


@pytest.mark.parametrize('name', ['turn_rates', 'accelerations'])
@pytest.mark.parametrize('shape', [(4, 3), (5, 2), (5,)])
def test_each_sensor_has_three_values_per_sample(name, shape):
    arrays = {'turn_rates': np.zeros((5, 3)), 'accelerations': np.zeros((5, 3)),
              name: np.zeros(shape)}
    with pytest.raises(InputError, match=f'the {name.replace("_", " ")} of an IMU: .* 5x3 is'):
        ImuSamples(np.arange(5), **arrays)


@pytest.mark.parametrize('chosen', [slice(1, 3), np.array([4, 0]), np.arange(5) % 2 == 0])
def test_chosen_samples_are_rows_of_each_array(chosen):
    found = SAMPLES[chosen]
    for name in ('stamps', 'turn_rates', 'accelerations'):
        np.testing.assert_array_equal(getattr(found, name), getattr(SAMPLES, name)[chosen])


@pytest.mark.parametrize('pose', [np.eye(3), np.eye(4)[:3], 'turned'])
def test_the_pose_of_an_imu_is_a_4x4_matrix(pose):
    with pytest.raises(InputError, match='the pose of an IMU'):
        SAMPLES.in_camera(pose)


@pytest.mark.parametrize('position', [np.zeros(2), np.zeros((1, 3)), [0.0, 0.0, 0.0]])
def test_a_position_is_an_array_of_three(position):
    with pytest.raises(InputError, match='the position of an IMU'):
        ImuSamples(SAMPLES.stamps, SAMPLES.turn_rates, SAMPLES.accelerations, position)
