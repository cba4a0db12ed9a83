# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Whether keypoints and depth tell of the same motion, by biases as told."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.registration.result import SensorBias
from aick_ros.registration.sensor_agreement import SensorAgreement


class Usual:
    """Noise of a camera with a usual bias, and the motions that it was asked for."""

    def __init__(self, bias):
        self.bias, self.motions = bias, []

    def usual_bias(self, motion):
        self.motions.append(motion)
        return self.bias


def bias(normalised):
    """Return a bias whose normalised square is as told."""
    return SensorBias(np.full(6, np.sqrt(normalised)), np.eye(6), np.zeros((6, 6)), np.eye(6))


def registration(made, normalised):
    return made.registration(bias=bias(normalised), tracks=made.tracks(30))


@pytest.mark.parametrize('usual, normalised, is_lost', [
    (4.0, 29.9, False), (4.0, 30.1, True), (100.0, 740.0, False), (100.0, 760.0, True),
    (0.5, 14.9, False), (0.5, 15.1, True)])
def test_they_disagree_where_a_bias_is_far_larger_than_usual(made, usual, normalised, is_lost):
    """By a factor of 7.5; up to twice what noise gives is usual anyway."""
    noise, target = Usual(usual), made.prepared(1)
    found = registration(made, normalised)
    assert SensorAgreement(noise).is_lost_by(found, target) == is_lost
    assert noise.motions == [found.tracks.displacement(target.frame.camera.fx)]


def test_without_depth_or_tracks_nothing_is_compared(made):
    noise, target = Usual(1.0), made.prepared(1)
    for found in (made.registration(bias=bias(1e9)), made.registration(tracks=made.tracks(30))):
        assert not SensorAgreement(noise).is_lost_by(found, target)


@pytest.mark.parametrize('normalised, tracked, contradicted, is_better', [
    (1.99, 12, False, True), (2.01, 12, False, False), (1.0, 11, False, False),
    (1.0, 30, True, False)])
def test_another_pose_is_better_where_the_bias_is_a_fifth(
        made, normalised, tracked, contradicted, is_better):
    """And where keypoints confirm it, and no depths of theirs contradict it."""
    other = made.refined(tracked, bias=bias(normalised), is_contradicted=contradicted)
    agreement = SensorAgreement(Usual(1.0))
    assert agreement.is_better_by(other, registration(made, 10.0)) == is_better


def test_a_pose_without_depth_is_not_better(made):
    other = SimpleNamespace(is_confirmed=True, bias=None)
    assert not SensorAgreement(Usual(1.0)).is_better_by(other, registration(made, 10.0))


@pytest.mark.parametrize('normalised, than, is_only', [
    (3.0, 15.1, True), (3.1, 15.1, False), (2.0, 14.9, False)])
def test_one_pose_alone_is_right_where_the_bias_of_the_other_is_unusual(
        made, normalised, than, is_only):
    """More than 7.5 times 2, and 5 times that of the one."""
    agreement, target = SensorAgreement(Usual(1.0)), made.prepared(1)
    found = registration(made, normalised)
    assert agreement.is_only_by(found, made.refined(30, bias=bias(than)), target) == is_only
    assert not agreement.is_only_by(found, made.refined(30, bias=None), target)
    assert not agreement.is_only_by(
        made.registration(tracks=made.tracks(30)), made.refined(30, bias=bias(than)), target)
