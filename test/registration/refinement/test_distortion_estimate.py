# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A distortion of depth learned from registrations: recovered, contradicted, absent, gone."""

import itertools
import math

import numpy as np
import pytest

from aick_ros.frames.depth_distortion import COLUMNS, NO_DISTORTION, ROWS
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.distortion_estimate import DistortionEstimate
from aick_ros.registration.refinement.grouped_equations import GroupedEquations
from aick_ros.registration.samples import Equations

SIGMA = 1e-3  # 1/m, of a node by one registration
MISALIGNMENT = np.array([0.02, -0.01, 0.015, 0.02, -0.03, 0.01, -0.02, 0.02, 0.025, -0.1,
                         0.03, 0.04])
LENS = MISALIGNMENT[11]
TRUE = np.random.default_rng(0).normal(0, 0.002, (ROWS, COLUMNS))


def series(nodes, count, seed=1, common=0.0, noise=0.3):
    """
    Yield registrations that observe ten random combinations of the unknowns each.

    :param common: standard deviation of what some registrations in a row have in common.
    """
    rng = np.random.default_rng(seed)
    for i in range(count):
        scales = np.concatenate([np.full(12, 0.02), np.full(nodes.size, SIGMA)])
        jacobian = 30 * rng.standard_normal((10, len(scales))) / scales
        in_a_row = np.random.default_rng([seed, i // 5]).standard_normal(nodes.size)
        values = np.concatenate([MISALIGNMENT, nodes.ravel() + common * in_a_row])
        values = values + noise * scales * rng.standard_normal(len(scales))
        information = jacobian.T @ jacobian
        yield Equations(information, information @ values)


def teach(estimate, *of):
    """Let an estimate learn from series of registrations."""
    for equations in itertools.chain(*of):
        estimate.learn(equations, LENS)


def learned(*of):
    estimate = DistortionEstimate()
    teach(estimate, *of)
    return estimate.distortion


def test_a_distortion_is_recovered_whatever_the_misalignment():
    found = learned(series(TRUE, 100)).nodes
    assert np.corrcoef(found.ravel(), TRUE.ravel())[0, 1] > 0.98
    assert np.abs(found - TRUE).max() < 0.3 * np.abs(TRUE).max()


def test_a_few_registrations_show_nothing():
    assert learned(series(TRUE, 39)).is_none
    assert not learned(series(TRUE, 40)).is_none


@pytest.mark.parametrize('seed', range(20))
def test_a_camera_without_distortion_is_left_alone(seed):
    """However much some registrations in a row have in common."""
    assert learned(series(np.zeros((ROWS, COLUMNS)), 100, seed, common=0.002)).is_none


def test_what_registrations_contradict_is_not_applied():
    assert not learned(series(TRUE, 100, common=0.0005)).is_none
    assert learned(series(TRUE, 100, common=0.02)).is_none


def test_the_less_certain_it_is_the_less_is_applied():
    certain, uncertain = (learned(series(TRUE, 100, common=common)).rms
                          for common in (0.0, 0.0007))
    assert 0.0 < uncertain < certain


def test_it_stays_applied_while_it_is_still_likely_and_goes_when_it_is_gone():
    estimate = DistortionEstimate()
    teach(estimate, series(TRUE, 60))
    before = estimate.distortion
    assert not before.is_none
    teach(estimate, series(np.zeros((ROWS, COLUMNS)), 2500, seed=2, common=0.004))
    assert estimate.distortion.rms < 0.1 * before.rms


def test_it_changes_less_and_less_often():
    """As frames are prepared again with each change."""
    estimate, changes = DistortionEstimate(), []
    for count, equations in enumerate(series(TRUE, 600), 1):
        before = estimate.distortion
        estimate.learn(equations, LENS)
        if estimate.distortion is not before:
            changes.append(count)
    assert changes[0] == 40
    intervals = np.diff(changes)
    assert (np.diff(intervals) > 0).all()
    assert len(changes) < 15
    assert intervals.max() < 0.3 * 600


def test_it_is_the_shrunk_estimate_while_that_is_significant():
    """Less significance is required of one that is applied; twice as much to begin with."""
    prior = np.diag(np.concatenate([100 / np.array([0.02] * 3 + [0.035] * 3 + [0.02] * 3
                                                   + [0.05] * 3) ** 2,
                                    np.full(ROWS * COLUMNS, 100 / 0.002 ** 2)]))
    sums, estimate = GroupedEquations(prior, 0.95), DistortionEstimate()
    known = np.where(np.arange(12 + ROWS * COLUMNS) == 11, LENS, 0.0)
    nodes, applied, states, following = slice(12, 12 + ROWS * COLUMNS), False, set(), 40
    stages = (series(TRUE, 60, common=0.002), series(TRUE, 240, seed=2, common=0.0005),
              series(0.0 * TRUE, 900, seed=3, common=0.003))
    for count, equations in enumerate(itertools.chain(*stages), 1):
        sums.add(equations.information, equations.gradient)
        estimate.learn(equations, LENS)
        if count != following:
            continue
        following = math.ceil(1.25 * following)
        values, scatter = sums.solve(np.delete(np.arange(nodes.stop), 11), known)
        significance = sums.significance(nodes, values, scatter)
        states.add((applied, significance > 6.25, significance > 12.5))
        applied = significance > (6.25 if applied else 12.5)
        expected = applied * (1 - 1 / significance) * values[nodes]
        np.testing.assert_allclose(estimate.distortion.nodes.ravel(), expected, atol=1e-12)
    assert states >= {(False, False, False), (False, True, False), (False, True, True),
                      (True, True, False), (True, False, False)}


def test_estimates_come_at_least_every_400_registrations():
    estimate, changes = DistortionEstimate(), []
    for count, equations in enumerate(itertools.islice(itertools.cycle(series(TRUE, 50)), 3000)):
        before = estimate.distortion
        estimate.learn(equations, LENS)
        if estimate.distortion is not before:
            changes.append(count)
    assert np.diff(changes).max() == 400


def test_it_is_of_the_image_that_the_camera_sees():
    """Another resolution has the same nodes; another crop has nodes of which nothing is known."""
    camera = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
    binned = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    cropped = Camera(480, 360, 525.0, 525.0, 239.5, 179.5)
    estimate = DistortionEstimate()
    estimate.follow(camera)
    teach(estimate, series(TRUE, 60))
    known = estimate.distortion
    assert not known.is_none
    for same in (camera, binned, camera):
        estimate.follow(same)
        assert estimate.distortion is known
    estimate.follow(cropped)
    assert estimate.distortion is NO_DISTORTION
    teach(estimate, series(-TRUE, 39))
    estimate.follow(cropped)
    assert estimate.distortion is NO_DISTORTION
    teach(estimate, series(-TRUE, 1, seed=2))
    assert np.corrcoef(estimate.distortion.nodes.ravel(), -TRUE.ravel())[0, 1] > 0.95


def test_it_stays_while_a_camera_focuses_and_goes_once_that_has_moved_its_nodes():
    """Compared with the image that it was first of, not with the last one."""
    estimate, known = DistortionEstimate(), []
    for zoom in np.linspace(1.0, 1.1, 60):
        estimate.follow(Camera(640, 480, 525.0 * zoom, 525.0 * zoom, 319.5, 239.5))
        teach(estimate, series(TRUE, 60) if zoom == 1.0 else ())
        known.append(not estimate.distortion.is_none)
    assert 10 < known.index(False) < 40 and not any(known[known.index(False):])
