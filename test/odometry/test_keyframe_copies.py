# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which keyframes show what others show already."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.keyframe_copies import KeyframeCopies
from aick_ros.odometry.keyframe_graph import KeyframeGraph
from aick_ros.settings import OdometrySettings

SETTINGS = OdometrySettings(reuse_distance=1.0, reuse_angle=1.0)  # a view per metre and radian
LIMIT = 0.15
NEAR = 0.05
DIRECTIONS = np.eye(6)


def graph_of(places, sigma=1e-4, axis=0):
    """Return the graph of keyframes along an axis of the tangent space [m, rad]."""
    graph = KeyframeGraph(0, PoseWithCovariance.identity())
    for key in range(1, len(places)):
        step = se3.exp((places[key] - places[key - 1]) * DIRECTIONS[axis])
        graph.add(key, PoseWithCovariance(step, sigma ** 2 * np.eye(6)), key - 1)
    return graph


def finished(key, found=(), missed=None):
    """Return a search for a keyframe that has ended."""
    return SimpleNamespace(key=key, found=found, missed=missed)


def kept(graph, copies, newest):
    """Return the keys that are left once no copy is."""
    while True:
        droppable = [key for key in graph.keys if key != newest]
        key = copies.copy_among(droppable, graph, SETTINGS)
        if key is None:
            return graph.keys
        graph.remove(key)
        copies.forget(key)


def test_of_one_view_the_two_oldest_and_the_newest_are_kept():
    assert kept(graph_of(np.zeros(9)), KeyframeCopies(), 8) == (0, 1, 8)


def test_of_each_view_two_are_kept():
    places = np.tile([0.0, 0.5, 1.0, 0.5], 5)
    assert kept(graph_of(places), KeyframeCopies(), 19) == (0, 1, 2, 3, 4, 6, 19)


def test_a_camera_that_explores_keeps_all():
    places = 2 * LIMIT * np.arange(12)
    assert kept(graph_of(places), KeyframeCopies(), 11) == tuple(range(12))


@pytest.mark.parametrize('axis', range(6))
@pytest.mark.parametrize('distance, is_copy', [(0.99 * LIMIT, True), (1.01 * LIMIT, False)])
def test_views_are_the_same_up_to_a_distance_or_an_angle(axis, distance, is_copy):
    graph = graph_of([0.0, 0.0, distance, 9.0], axis=axis)
    found = KeyframeCopies().copy_among([2], graph, SETTINGS)
    assert found == (2 if is_copy else None)


@pytest.mark.parametrize('square, is_copy', [(0.95, True), (1.05, False)])
def test_the_uncertainty_of_their_distance_counts_in_the_mean_square(square, is_copy):
    """Of the six variances of a step; the two before are the same frame twice."""
    graph = KeyframeGraph(0, PoseWithCovariance.identity())
    graph.add(1, PoseWithCovariance(np.eye(4), np.zeros((6, 6))), 0)
    variance = (square * LIMIT ** 2 - NEAR ** 2) / 6
    graph.add(2, PoseWithCovariance(se3.exp(NEAR * DIRECTIONS[1]), variance * np.eye(6)), 1)
    assert KeyframeCopies().copy_among([2], graph, SETTINGS) == (2 if is_copy else None)


def test_only_those_that_may_be_dropped_are_named():
    graph = graph_of(np.zeros(6))
    assert KeyframeCopies().copy_among([0, 1, 3], graph, SETTINGS) == 3
    assert KeyframeCopies().copy_among([0, 1], graph, SETTINGS) is None
    assert KeyframeCopies().copy_among([], graph, SETTINGS) is None


def test_one_that_two_searches_have_missed_goes_before_newer_ones():
    """What it shows has changed; with one alone a hand may have been before the camera."""
    graph, copies = graph_of(np.zeros(5)), KeyframeCopies()
    copies.learn(finished(3, missed=0), graph, SETTINGS)
    assert copies.copy_among(range(4), graph, SETTINGS) == 3
    copies.learn(finished(4, missed=0), graph, SETTINGS)
    assert copies.copy_among(range(4), graph, SETTINGS) == 0


def test_one_that_searches_have_missed_stands_for_no_other():
    graph, copies = graph_of(np.zeros(3)), KeyframeCopies()
    assert copies.copy_among([2], graph, SETTINGS) == 2
    for _ in range(2):
        copies.learn(finished(2, missed=0), graph, SETTINGS)
    assert copies.copy_among([2], graph, SETTINGS) is None


def test_one_that_is_found_between_has_not_changed():
    graph, copies = graph_of(np.zeros(4)), KeyframeCopies()
    for search in (finished(3, missed=0), finished(3, found=(0, 1)), finished(3, missed=0)):
        copies.learn(search, graph, SETTINGS)
    assert copies.copy_among(range(4), graph, SETTINGS) == 3


def test_one_that_is_missed_from_another_view_has_not_changed():
    graph, copies = graph_of([0.0, 0.0, 0.0, 2 * LIMIT]), KeyframeCopies()
    for _ in range(5):
        copies.learn(finished(3, missed=0), graph, SETTINGS)
    assert copies.copy_among(range(4), graph, SETTINGS) == 2


def test_one_that_is_dropped_is_forgotten():
    graph, copies = graph_of(np.zeros(3)), KeyframeCopies()
    for _ in range(2):
        copies.learn(finished(2, missed=0), graph, SETTINGS)
    copies.forget(0)
    assert copies.copy_among([2], graph, SETTINGS) == 2
