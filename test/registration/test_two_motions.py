# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The evidence for one of two motions, by registrations of which one thing differs."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration.result import Fit, SensorBias
from aick_ros.registration.two_motions import TwoMotions

EXPECTED, SIGMAS = se3.exp([0.1, 0.0, 0.0, 0.0, 0.0, 0.1]), np.full(6, 0.01)


class Poses:
    """Two registrations with the same error against what is expected: 1 has 40 keypoints each."""

    def __init__(self, made, counts=(40, 40)):
        self.both = []
        for count, first in zip(counts, (0, 1000)):
            tracks = made.tracks(count)
            self.both.append(dataclasses.replace(
                made.registration(), T_target_source=se3.perturbed(EXPECTED, np.full(6, 1e-3)),
                fit=Fit(np.full(count, 0.5), 0.6), tracks=dataclasses.replace(
                    tracks, keypoints=tracks.keypoints + first,
                    points=np.column_stack([tracks.points[:, :2], np.full(count, 2.0)]))))

    def change(self, which, **values):
        self.both[which] = dataclasses.replace(self.both[which], **values)
        return self

    def motions(self):
        return TwoMotions.of(*self.both, EXPECTED, SIGMAS)


@pytest.fixture
def poses(made):
    return lambda *counts: Poses(made, counts or (40, 40))


def bias(normalised):
    """Return a bias with a normalised square by both covariances."""
    return SensorBias(np.full(6, np.sqrt(2 * normalised)), np.eye(6), np.zeros((6, 6)), np.eye(6))


def test_where_nothing_differs_there_is_no_evidence(poses):
    motions = poses().motions()
    assert motions.first == motions.second == 40 and motions.are_confirmed
    assert motions.evidence == pytest.approx(0.0, abs=1e-9)


def test_more_keypoints_are_evidence(poses):
    assert poses(30, 90).motions().evidence == pytest.approx(0.8)
    assert poses(90, 30).motions().evidence == pytest.approx(-0.8)


def test_a_bias_between_keypoints_and_depth_is_evidence_against_a_pose(poses):
    """Below that of noise it is none."""
    assert poses().change(0, bias=bias(10.0)).change(1, bias=bias(2.0)).motions().evidence == (
        pytest.approx(1.0))
    assert poses().change(0, bias=bias(0.9)).change(1, bias=bias(0.1)).motions().evidence == (
        pytest.approx(0.0, abs=1e-9))


@pytest.mark.parametrize('deviations, evidence', [(1, 0.05), (5, 1.2), (100, 1.2)])
def test_a_sudden_motion_is_the_less_likely_one(poses, deviations, evidence):
    """Up to the weight of a difference of 24 squared standard deviations."""
    error = np.full(6, 1e-3)
    error[0] = deviations * SIGMAS[0]
    moved = poses().change(0, T_target_source=se3.perturbed(EXPECTED, error))
    assert moved.motions().evidence == pytest.approx(evidence, rel=0.02)


def test_the_larger_part_of_the_surfaces_is_evidence(poses):
    apart = poses().change(0, fit=Fit(np.full(40, 0.5), 0.3)).change(
        1, fit=Fit(np.full(40, 0.5), 0.9))
    assert apart.motions().evidence == pytest.approx(0.4)


def test_what_has_moved_before_is_no_scene(poses):
    moved = Fit(np.full(40, 0.5), 0.6, known_share=1.0)
    assert poses().change(0, fit=moved).motions().evidence == pytest.approx(1.5)
    assert poses().change(1, fit=moved).motions().evidence == pytest.approx(-1.5)


def test_the_scene_is_behind_an_object(poses):
    behind = poses()
    points = behind.both[1].tracks.points * 2.0
    behind.change(1, tracks=dataclasses.replace(behind.both[1].tracks, points=points))
    assert behind.motions().evidence == pytest.approx(1.0)


@pytest.mark.parametrize('errors, votes', [
    ((0.5, 0.5), (0, 0)), ((0.5, 2.1), (40, 0)), ((2.1, 0.5), (0, 40)), ((0.5, 1.9), (0, 0)),
    ((0.001, 0.2), (0, 0))])
def test_keypoints_of_both_are_for_the_pose_that_they_fit_far_better(poses, errors, votes):
    """By four times, if either is an error at all."""
    alike = poses()
    for which, error in enumerate(errors):
        tracks = dataclasses.replace(alike.both[which].tracks, keypoints=np.arange(40))
        alike.change(which, tracks=tracks, fit=Fit(np.full(40, error), 0.6))
    motions = alike.motions()
    assert (motions.first, motions.second) == votes and not motions.are_confirmed
    assert motions.alike == 40 - sum(votes)


def test_keypoints_of_one_pose_are_not_alike(poses):
    """Twenty of forty are of both poses, five of them far better of one."""
    some = poses()
    tracks = dataclasses.replace(some.both[1].tracks, keypoints=np.arange(40) + 20)
    some.change(1, tracks=tracks, fit=Fit(np.where(np.arange(40) < 5, 2.1, 0.5), 0.6))
    motions = some.motions()
    assert (motions.first, motions.second, motions.alike) == (25, 20, 15)


@pytest.mark.parametrize('counts, are_confirmed', [
    ((13, 40), True), ((12, 40), False), ((100, 17), False), ((100, 18), True)])
def test_each_motion_needs_enough_keypoints(poses, counts, are_confirmed):
    """More than twelve, and more than 15 %."""
    assert poses(*counts).motions().are_confirmed == are_confirmed


@pytest.mark.parametrize('lacks', ['tracks', 'fit'])
def test_without_the_tracks_of_one_of_them_nothing_is_known(poses, lacks):
    assert poses().change(1, **{lacks: None}).motions() is None
