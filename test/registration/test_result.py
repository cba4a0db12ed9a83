# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Parts of the covariance of a registration, and the bias between two sensors, by definition."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import chi2

from aick_ros.geometry import se3
from aick_ros.geometry.pose import at_point, in_axes
from aick_ros.registration.result import Evidence, Registration, SensorBias, failed
from aick_ros.registration.status import Status

ROOT = np.random.default_rng(5).standard_normal((6, 6))
COVARIANCE = ROOT @ ROOT.T


def test_a_bias_by_noise_has_a_normalised_square_of_one():
    """The sum of six squares follows chi squared."""
    rng = np.random.default_rng(1)
    squares = [6 * SensorBias(difference, COVARIANCE, np.eye(6), COVARIANCE).normalised
               for difference in rng.multivariate_normal(np.zeros(6), COVARIANCE, 4000)]
    assert np.mean(squares) == pytest.approx(6, rel=0.05)
    assert np.mean(np.array(squares) < chi2.ppf(0.95, 6)) == pytest.approx(0.95, abs=0.015)


def test_the_squares_of_a_bias_are_means_of_three_axes():
    bias = SensorBias(np.array([1.0, 2.0, -3.0, 0.1, 0.0, -0.2]), np.eye(6), np.eye(6), np.eye(6))
    np.testing.assert_allclose(bias.squares, [14 / 3, 0.05 / 3])


@pytest.mark.parametrize('along, about, is_shown', [
    (0.49, 0.49, True), (0.51, 0.01, False), (0.01, 0.51, False), (1.0, 1.0, False)])
def test_noise_of_half_the_prior_hides_a_bias(along, about, is_shown):
    covariance = np.diag(np.square([along, along, along, about, about, about]))
    bias = SensorBias(np.zeros(6), covariance, np.eye(6), np.eye(6))
    assert bias.is_shown == is_shown


@pytest.fixture
def registration():
    motion = np.eye(4)
    motion[:3, 3] = 1.0, 2.0, 3.0
    return Registration(Status.OK, '', motion, 6 * COVARIANCE, np.empty((0, 2), np.intp), 3,
                        systematic=2 * COVARIANCE, unusual=0.5 * COVARIANCE,
                        timing=np.diag(np.arange(6.0)))


def test_poses_have_the_covariance_less_what_does_not_apply(registration):
    timing = np.diag(np.arange(6.0))
    parts = {'pose': 0.0, 'image_pose': timing, 'varying_pose': timing + 2 * COVARIANCE,
             'unbiased_pose': timing + 2.5 * COVARIANCE}
    for name, part in parts.items():
        pose = getattr(registration, name)
        np.testing.assert_array_equal(pose.matrix, registration.T_target_source)
        np.testing.assert_allclose(pose.covariance, 6 * COVARIANCE - part, atol=1e-12)


def test_by_depth_means_by_depth_alone(registration):
    found = {kind: dataclasses.replace(registration, evidence=kind).is_by_depth
             for kind in Evidence}
    assert [kind for kind, is_by_depth in found.items() if is_by_depth] == [Evidence.DEPTH_ALONE]


def test_a_failure_knows_nothing_of_the_pose():
    nothing = failed(Status.TOO_FEW_MATCHES, '2 of 12', 7)
    assert (nothing.status, nothing.reason, nothing.iterations) == (
        Status.TOO_FEW_MATCHES, '2 of 12', 7)
    np.testing.assert_array_equal(nothing.T_target_source, np.eye(4))
    assert np.isinf(np.diag(nothing.covariance)).all()
    assert nothing.matches.shape == (0, 2) and nothing.support == 0
    assert failed(Status.BAD_FRAME, '').iterations == 0
    for part in (nothing.systematic, nothing.unusual, nothing.timing):
        np.testing.assert_array_equal(part, np.zeros((6, 6)))


def test_each_registration_has_arrays_of_its_own():
    one, other = failed(Status.BAD_FRAME, ''), failed(Status.BAD_FRAME, '')
    one.systematic[0, 0] = one.timing[0, 0] = one.covariance[1, 1] = 5.0
    assert other.systematic[0, 0] == other.timing[0, 0] == 0.0 and other.covariance[1, 1] > 5.0


def test_evidence_is_described_for_people():
    assert {evidence.name: evidence.value for evidence in Evidence} == {
        'KEYPOINTS': 'keypoints that agree with the pose',
        'DEPTH': 'depth and brightness of most of the view, whatever the number of keypoints',
        'DEPTH_ALONE': 'depth, and the motion expected where the scene has no shape',
        'COLOUR_ALONE': 'keypoints of the target that the source sees, whatever its depth'}


def test_the_bias_of_a_motion_is_that_of_its_end_without_that_of_its_start():
    """In the axes of the start; an error there moves the end by its lever arm."""
    rng = np.random.default_rng(9)
    roots, gains, differences = (rng.uniform(-1, 1, (2, *size)) for size in ((6, 6), (6, 6), (6,)))
    end, start = (SensorBias(difference, root @ root.T, gain, root @ root.T)
                  for difference, root, gain in zip(differences, roots, gains))
    arm, rotation = np.array([0.3, -0.2, 0.5]), se3.exp_rotation([0.4, -0.9, 0.3])
    transport, axes = at_point(arm), in_axes(rotation.T)
    found = end.since(start, arm, 0.4, rotation)
    np.testing.assert_allclose(
        found.difference, axes @ (end.difference - transport @ start.difference))
    np.testing.assert_allclose(found.covariance, 0.4 * axes @ (
        end.covariance + transport @ start.covariance @ transport.T) @ axes.T)
    np.testing.assert_allclose(found.gain, axes @ end.gain @ axes.T)
