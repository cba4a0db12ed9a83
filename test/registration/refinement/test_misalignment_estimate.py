# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A misalignment learned from registrations: recovered, contradicted, absent and changed."""

import copy
import dataclasses

import numpy as np
import pytest

from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.registration.refinement.misalignment_estimate import (
    PRIOR_SIGMAS, MisalignmentEstimate)
from aick_ros.registration.samples import MisalignmentSample

# of one registration
SIGMAS = np.array([0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.01, 0.01, 0.01, 0.02, 0.02,
                   0.02])
TIMES = slice(6, 9)
TRUE = np.array([0.02, -0.01, 0.015, 0.02, -0.03, 0.01, -0.02, 0.02, 0.025, -0.1, 0.03,
                 0.06])


class Drawn:
    """Random numbers of each unknown; those of the lens are drawn beside the others."""

    def __init__(self, *seeds):
        self._rng, self._of_lens = np.random.default_rng(seeds), np.random.default_rng([*seeds, 1])

    def normal(self, *rows):
        return np.concatenate([self._rng.standard_normal((*rows, 11)),
                               self._of_lens.standard_normal((*rows, 1))], axis=-1)

    def noise(self, count):
        return self._rng.standard_normal(count)


def samples(true, count, seed=1, contradiction=0.0, sigmas=SIGMAS):
    """Yield registrations that observe three random combinations of the unknowns each."""
    drawn = Drawn(seed)
    for i in range(count):
        jacobian = 30 * drawn.normal(3) / sigmas
        # errors that some registrations in a row have in common
        common = Drawn(seed, i // 5).normal()
        values = true + sigmas * (0.3 * drawn.normal() + contradiction * common)
        information = jacobian.T @ jacobian
        yield MisalignmentSample(information, information @ values)


def estimate_of(*series):
    estimate = MisalignmentEstimate()
    for one in series:
        for sample in one:
            estimate.learn(sample)
    return estimate


def learned(*series):
    """Return what is found; delay and readouts are corrected before that."""
    return estimate_of(*series).found.values


def test_a_misalignment_is_recovered_from_tens_of_registrations():
    assert np.abs((learned(samples(TRUE, 60)) - TRUE) / SIGMAS).max() < 0.3


def test_few_registrations_show_nothing():
    assert not learned(samples(TRUE, 19)).any()


def test_what_is_found_is_corrected():
    estimate = estimate_of(samples(TRUE, 60))
    np.testing.assert_array_equal(estimate.found.values, estimate.misalignment.values)
    assert estimate.found.values.all()


def test_a_delay_and_readouts_that_are_likely_are_corrected_before_they_are_found():
    """Many cameras have them, and while they are not corrected each motion errs."""
    values = estimate_of(samples(TRUE, 15)).misalignment.values
    assert np.abs((values - TRUE) / TRUE)[TIMES].max() < 0.3
    assert not np.delete(values, TIMES).any()


@pytest.mark.parametrize('contradiction', [1.0, 3.0, 10.0])
def test_what_is_corrected_of_a_camera_without_misalignment_is_small(contradiction):
    """Among 40 cameras whose registrations err by 10 to 100 ms, five in a row alike."""
    def values_after(count):
        return np.array([
            estimate_of(samples(np.zeros(12), count, seed, contradiction)).misalignment.values
            for seed in range(40)])[:, TIMES]

    assert np.sqrt(np.mean(values_after(15) ** 2)) < 0.008
    assert np.sqrt(np.mean(values_after(80) ** 2)) < 0.006


@pytest.mark.parametrize('seed', range(20))
def test_a_camera_without_misalignment_is_left_alone(seed):
    assert not learned(samples(np.zeros(12), 80, seed, contradiction=1.0)).any()


@pytest.mark.parametrize('unknown', [4, 6])
def test_an_offset_is_found_where_a_delay_is_much_like_it(unknown):
    """As of a robot that turns at a nearly constant rate: what both do together is corrected."""
    rng, true, estimate = np.random.default_rng(1), np.zeros(12), MisalignmentEstimate()
    true[unknown] = 0.03 if unknown == 4 else 0.02
    for _ in range(80):
        jacobian = 30 * rng.standard_normal((3, 12)) / SIGMAS
        rate = 1.0 + 0.15 * rng.standard_normal()
        jacobian[:, 6] = rate * jacobian[:, 4]
        noise = 30 * 0.3 * rng.standard_normal(3)
        information, values = jacobian.T @ jacobian, jacobian @ true + noise
        estimate.learn(MisalignmentSample(information, jacobian.T @ values))
    error = estimate.misalignment.values - true
    assert abs(error[4] + error[6]) < 0.2 * true[unknown]


def test_what_registrations_contradict_is_not_applied():
    assert not learned(samples(0.1 * TRUE, 80, contradiction=3.0)).any()


@pytest.mark.parametrize('part', [slice(0, 6), slice(6, 9), slice(9, 11), slice(11, 12)])
def test_only_the_part_that_is_there_is_applied(part):
    true = np.zeros(12)
    true[part] = TRUE[part]
    found = learned(samples(true, 80))
    assert np.abs((found - true) / SIGMAS)[part].max() < 0.3
    assert not np.delete(found, part).any()


@pytest.mark.parametrize('image', [7, 8])
def test_only_the_readout_of_the_image_that_has_one_is_applied(image):
    """As of colour cameras with a rolling shutter beside depth cameras with a global one."""
    true = np.zeros(12)
    true[image] = TRUE[image]
    found = learned(samples(true, 80))
    assert found[image] == pytest.approx(TRUE[image], rel=0.2)
    assert found[15 - image] == 0.0


def test_of_a_significant_misalignment_of_no_size_only_times_are_corrected_and_none_reported():
    tiny = 0.05 * np.full(12, 0.02)
    estimate = MisalignmentEstimate()
    for sample in samples(tiny, 80, sigmas=0.01 * SIGMAS):
        estimate.learn(sample)
    assert not estimate.found.values.any()
    np.testing.assert_allclose(estimate.misalignment.values[TIMES], tiny[TIMES], rtol=0.1)
    assert estimate.delay_sigma < 0.1 * tiny[6]
    assert not np.delete(estimate.misalignment.values, TIMES).any()


@pytest.mark.parametrize('contradiction, is_applied', [(0.1, True), (0.3, False)])
def test_a_small_error_that_no_registration_contradicts_is_applied(contradiction, is_applied):
    """As of the lens of a camera whose depth is noisy: three standard deviations by its noise."""
    true = np.zeros(12)
    true[11] = 0.04
    estimate, rng = MisalignmentEstimate(), np.random.default_rng(1)
    for _ in range(80):
        jacobian = 0.7 * rng.standard_normal((3, 12)) / PRIOR_SIGMAS
        values = true + contradiction * rng.standard_normal(12) * PRIOR_SIGMAS
        estimate.learn(MisalignmentSample(jacobian.T @ jacobian, jacobian.T @ jacobian @ values))
    assert bool(estimate.misalignment.colour_radial) == is_applied
    assert not estimate.misalignment.values[:11].any()


def test_a_known_misalignment_holds_from_the_start_and_its_deviation_is_learned():
    known = Misalignment.of(0.5 * TRUE)
    estimate = MisalignmentEstimate(known)
    assert estimate.misalignment is known
    for sample in samples(TRUE, 80):
        estimate.learn(sample)
    assert np.abs((estimate.misalignment.values - TRUE) / SIGMAS).max() < 0.3


def test_a_misalignment_known_exactly_is_kept():
    estimate = MisalignmentEstimate(Misalignment.of(TRUE))
    for sample in samples(TRUE, 80, contradiction=1.0):
        estimate.learn(sample)
    np.testing.assert_array_equal(estimate.found.values, TRUE)


def test_what_was_learned_is_kept_when_another_misalignment_is_said_to_be_known():
    estimate = MisalignmentEstimate()
    estimate.assume(Misalignment.of(TRUE))
    np.testing.assert_array_equal(estimate.misalignment.values, TRUE)  # nothing is learned yet
    for sample in samples(TRUE, 80):
        estimate.learn(sample)
    estimate.assume(Misalignment.of(-TRUE))
    assert np.abs((estimate.misalignment.values - TRUE) / SIGMAS).max() < 0.3


def test_a_deviation_from_another_known_one_is_as_significant_however_it_was_before():
    """What was applied before is no reason to apply a deviation from what is known now."""
    estimate = MisalignmentEstimate()
    for sample in samples(TRUE, 80, contradiction=1.5):
        estimate.learn(sample)
    applied = []
    for share in np.linspace(0.0, 1.0, 51):
        known = Misalignment.of(share * TRUE)
        direct, by_the_true_one = copy.deepcopy(estimate), copy.deepcopy(estimate)
        by_the_true_one.assume(Misalignment.of(TRUE))  # from which nothing deviates
        np.testing.assert_array_equal(by_the_true_one.found.values, TRUE)
        for one in (direct, by_the_true_one):
            one.assume(known)
        np.testing.assert_array_equal(direct.misalignment.values,
                                      by_the_true_one.misalignment.values)
        np.testing.assert_array_equal(direct.found.values, by_the_true_one.found.values)
        applied.append((direct.found.values != known.values).any())
    assert 5 < sum(applied) < 46


def test_one_absurd_registration_changes_little():
    absurd = MisalignmentSample(1e9 * np.eye(12), 1e9 * np.ones(12))
    found = learned(samples(TRUE, 60), [absurd], samples(TRUE, 4, seed=2))
    assert np.abs((found - TRUE) / SIGMAS).max() < 1.0


def test_a_camera_that_is_mounted_anew_is_learned_anew():
    other = TRUE * [1, -1, 0.5, -1, 1, 2, 0.5, 0.5, -0.5, 0.5, -1, -0.5]
    found = learned(samples(TRUE, 80), samples(other, 600, seed=2))
    assert np.abs((found - other) / SIGMAS).max() < 0.3


CAMERA = Camera(640, 480, 520.0, 521.0, 320.0, 240.0)


@pytest.mark.parametrize('change', [
    {'fx': 530.0}, {'fy': 510.0}, {'distortion': (0.1, 0.0, 0.0, 0.0)}])
def test_another_calibration_of_the_camera_is_learned_anew(change):
    """The error of its focal length is another one; a known misalignment holds from the start."""
    known = Misalignment.of(0.5 * TRUE)
    estimate, new = MisalignmentEstimate(known), MisalignmentEstimate(known)
    estimate.follow(CAMERA)
    for sample in samples(TRUE, 40):
        estimate.learn(sample)
    assert (estimate.misalignment.values != known.values).any()
    estimate.follow(dataclasses.replace(CAMERA, **change))
    for sample in samples(-TRUE, 60, seed=2):
        for each in (estimate, new):
            np.testing.assert_array_equal(each.misalignment.values, new.misalignment.values)
            np.testing.assert_array_equal(each.optics_covariance, new.optics_covariance)
            np.testing.assert_array_equal(each.readout_covariance, new.readout_covariance)
            each.learn(sample)


@pytest.mark.parametrize('change', [
    {}, {'width': 320, 'height': 240, 'fx': 260.0, 'fy': 260.5, 'cx': 160.0, 'cy': 120.0},
    {'width': 600, 'cx': 300.0}, {'fx': 520.5}])
def test_another_resolution_of_the_camera_leaves_what_was_learned(change):
    estimate = MisalignmentEstimate()
    estimate.follow(CAMERA)
    for sample in samples(TRUE, 40):
        estimate.learn(sample)
    found = estimate.misalignment
    estimate.follow(dataclasses.replace(CAMERA, **change))
    assert estimate.misalignment is found


def test_the_error_of_the_delay_is_within_what_is_said_of_it():
    """At every moment, whether the delay is applied yet or not, of cameras drawn at random."""
    distances = []
    for seed in range(20):
        true = Drawn(seed).normal() * 0.5 * SIGMAS
        estimate = MisalignmentEstimate()
        for count, sample in enumerate(samples(true, 80, seed, contradiction=1.0)):
            estimate.learn(sample)
            if count % 20 == 19:
                error = estimate.misalignment.delay - true[6]
                distances.append((error / estimate.delay_sigma) ** 2)
    assert 0.1 < np.mean(distances) < 1.0
    assert np.max(distances) < 6.0


def test_a_delay_is_uncertain_until_registrations_show_it():
    estimate, sigmas = MisalignmentEstimate(), []
    for sample in samples(TRUE, 80):
        sigmas.append(estimate.delay_sigma)
        estimate.learn(sample)
    assert sigmas[0] == 0.01
    assert sigmas[-1] < 0.0015
    assert sigmas[9] > 0.5 * sigmas[0]  # 20 ms are seen, and not corrected yet


def noisy_samples(true, count, seed=1):
    """Yield registrations by residuals of which ten are as good as one without correlation."""
    drawn = Drawn(seed)
    for _ in range(count):
        jacobian = drawn.normal(3) / PRIOR_SIGMAS
        residuals = jacobian @ true + np.sqrt(10.0) * drawn.noise(3)
        yield MisalignmentSample(jacobian.T @ jacobian, jacobian.T @ residuals)


OFFSET, READOUT, OPTICS = slice(0, 6), slice(7, 8), slice(9, 12)
COVARIANCES = [('offset_covariance', OFFSET), ('readout_covariance', READOUT),
               ('optics_covariance', OPTICS)]


def errors(covariance, part, cameras):
    """Yield whether something is applied of a camera, its error and its covariance."""
    for seed, true in enumerate(cameras):
        estimate = MisalignmentEstimate()
        for count, sample in enumerate(noisy_samples(true, 80, seed)):
            estimate.learn(sample)
            if count % 20 == 19:
                found = estimate.misalignment.values[part]
                yield found.any(), found - true[part], getattr(estimate, covariance)


@pytest.mark.parametrize('covariance, part', COVARIANCES)
def test_an_error_that_is_applied_is_left_as_large_as_is_said_of_it(covariance, part):
    """
    At every moment, of cameras with errors of three standard deviations.

    Readouts are corrected by Bayes' rule, also before they are significant: of those cameras they
    are as large as its prior says.
    """
    size = 1.0 if part == READOUT else 3.0
    cameras = [size * Drawn(seed).normal() * PRIOR_SIGMAS for seed in range(40)]
    distances = [error @ np.linalg.solve(covariance, error) / len(error)
                 for is_applied, error, covariance in errors(covariance, part, cameras)
                 if is_applied]
    assert len(distances) > 40
    assert 0.7 < np.mean(distances) < 1.2


def drawn_by_the_prior(seed):
    """
    Return a camera in which every part is as likely right as not.

    One that has a delay or readouts has each of the three with a probability of 0.8.
    """
    rng, true = np.random.default_rng([seed, 7]), Drawn(seed).normal() * PRIOR_SIGMAS
    for part in (OFFSET, TIMES, OPTICS):
        true[part] *= rng.integers(2)
    true[TIMES] *= rng.random(3) < 0.8
    return true


@pytest.mark.parametrize('covariance, part', [COVARIANCES[0], COVARIANCES[2]])
def test_an_error_that_is_not_applied_is_as_large_as_is_said_of_it(covariance, part):
    """In the mean over cameras, at every moment; few of them have the one that is there."""
    found = [(np.square(error / PRIOR_SIGMAS[part]).sum(),
              np.sum(np.diag(covariance) / PRIOR_SIGMAS[part] ** 2))
             for is_applied, error, covariance in errors(
                 covariance, part, map(drawn_by_the_prior, range(60))) if not is_applied]
    assert len(found) > 150
    squares, variances = np.sum(found, axis=0)
    assert 0.7 < squares / variances < 1.2


def test_a_readout_is_left_as_large_as_is_said_of_it_or_rather_less():
    """In the mean over cameras drawn by the prior, at every moment, whether corrected or not."""
    squares, variances = np.sum([
        (error[0] ** 2, covariance[0, 0])
        for _, error, covariance in errors('readout_covariance', READOUT,
                                           map(drawn_by_the_prior, range(60)))], axis=0)
    assert 0.5 < squares / variances < 1.1


def sigmas_after(series, covariance, part):
    """Return standard deviations that an estimate gives, as ratios to those of the prior."""
    estimate = MisalignmentEstimate()
    for sample in series:
        estimate.learn(sample)
    return np.sqrt(np.diag(getattr(estimate, covariance))) / PRIOR_SIGMAS[part]


@pytest.mark.parametrize('covariance, part', COVARIANCES)
def test_an_error_of_the_camera_is_as_likely_as_none_until_registrations_tell(covariance, part):
    def sigmas(series):
        return sigmas_after(series, covariance, part)

    np.testing.assert_allclose(sigmas([]), np.sqrt(0.5))
    least = 0.2 if part == READOUT else 0.1  # a single number is rather large by chance
    assert (sigmas(noisy_samples(np.zeros(12), 80)) < least).all()
    seen = sigmas(samples(TRUE, 5 if part == READOUT else 15)) * PRIOR_SIGMAS[part]
    assert (seen > 0.6 * np.abs(TRUE[part])).all()  # it is not applied yet
    assert (sigmas(samples(TRUE, 35)) < 0.2).all()
