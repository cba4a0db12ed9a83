# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Search for earlier keyframes, and which registrations are accepted."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import keyframe_search
from aick_ros.odometry.keyframe_graph import KeyframeGraph
from aick_ros.odometry.keyframe_search import KeyframeSearch, candidates, view_distances
from aick_ros.registration.result import Registration
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

KEYPOINTS = 100
SIGMA = 0.002  # m and rad, of each registration
SETTINGS = Settings()


def graph_of(positions, sigma=SIGMA):
    """Return the graph of keyframes at some positions along x [m], one after another."""
    graph = KeyframeGraph(0, PoseWithCovariance.identity())
    for key in range(1, len(positions)):
        step = se3.exp([positions[key] - positions[key - 1], 0, 0, 0, 0, 0])
        graph.add(key, PoseWithCovariance(step, sigma ** 2 * np.eye(6)), key - 1)
    return graph


def stamps(count, period=1.0):
    return {key: round(key * period * NANOSECONDS) for key in range(count)}


class Keypoints:
    """As many as there are."""

    def __len__(self):
        return KEYPOINTS


ALIGNED = Registration(Status.OK, '', np.eye(4), np.eye(6), np.empty((0, 2), int), 1, 5)


class FakeRegistrar:
    """Registers frames, which are their numbers, by true positions along x and given errors."""

    def __init__(self, positions, errors=(), supports=(), **values):
        self.positions, self.errors, self.supports = positions, dict(errors), dict(supports)
        self.values, self.aligned = {'tracks': (), **values}, {}

    def align(self, source, target):
        return dataclasses.replace(ALIGNED, reason=f'{source.key} in {target.key}',
                                   status=self.aligned.get(target.key, Status.OK))

    def recognize_partly(self, source, target, aligned):
        assert aligned.reason == f'{source.key} in {target.key}' and aligned.status.ok
        offset = self.positions[source.key] - self.positions[target.key]
        offset += self.errors.get(target.key, 0.0)
        return dataclasses.replace(Registration(
            Status.OK, '', se3.exp([offset, 0, 0, 0, 0, 0]), SIGMA ** 2 * np.eye(6),
            np.empty((0, 2), int), 1, self.supports.get(target.key, KEYPOINTS)), **self.values)


POSITIONS = [0.0, 0.1, 0.4, 0.8, 0.4, 0.12, 0.02]


def search(errors=(), supports=(), settings=SETTINGS, **values):
    """Return what is accepted of the last keyframe's search for the first two."""
    frames = {key: SimpleNamespace(key=key, keypoints=Keypoints())
              for key in range(len(POSITIONS))}
    registrar, graph = FakeRegistrar(POSITIONS, errors, supports, **values), graph_of(POSITIONS)
    last = len(POSITIONS) - 1
    seeking = KeyframeSearch(last, (0, 1))
    accepted = ()
    while not seeking.is_finished:
        assert accepted == ()
        accepted = seeking.step(graph, frames, registrar, settings)
    return accepted


def test_two_that_agree_are_accepted():
    accepted = search()
    assert [(m.first, m.second) for m in accepted] == [(0, 6), (1, 6)]
    np.testing.assert_allclose(accepted[0].pose.translation, [0.02, 0, 0], atol=1e-12)


@pytest.mark.parametrize('wrong', [{0: 0.1}, {1: 0.1}, {0: 0.1, 1: 0.1}, {0: -0.5, 1: -0.5}])
def test_what_the_graph_contradicts_is_not_accepted(wrong):
    assert search(wrong) == ()


@pytest.mark.parametrize('square, is_sought', [(22.0, True), (23.0, False)])
def test_after_one_beyond_its_own_gate_no_other_is_sought(square, is_sought):
    """Six steps of the graph and the registration have equal variances along x."""
    frames = {key: SimpleNamespace(key=key, keypoints=Keypoints())
              for key in range(len(POSITIONS))}
    seeking = KeyframeSearch(6, (0, 1))
    for _ in range(2):
        seeking.step(graph_of(POSITIONS), frames, FakeRegistrar(
            POSITIONS, {0: np.sqrt(square * 7) * SIGMA}), SETTINGS)
    assert seeking.is_finished != is_sought


@pytest.mark.parametrize('sigma, off, is_accepted', [
    (0.08, 0.239, True), (0.08, 0.241, False), (0.049, 0.149, True), (0.049, 0.151, False),
    (0.04, 0.149, True)])
def test_far_from_where_it_is_expected_a_place_must_be_within_three_sigma(
        sigma, off, is_accepted):
    """From 15 cm on, as furniture that is repeated stands at twice that distance and more."""
    frames = {key: SimpleNamespace(key=key, keypoints=Keypoints()) for key in range(2)}
    graph = KeyframeGraph(0, PoseWithCovariance.identity())
    graph.add(1, PoseWithCovariance(np.eye(4), sigma ** 2 * np.eye(6)), 0)
    seeking, registrar = KeyframeSearch(1, (0,)), FakeRegistrar([0.0, off])
    seeking.step(graph, frames, registrar, SETTINGS)
    assert bool(seeking.step(graph, frames, registrar, SETTINGS)) == is_accepted


def test_two_that_contradict_each_other_are_not_accepted():
    """Each is within the gate of the drift, three times its standard deviation; both are not."""
    drift = np.sqrt(7) * SIGMA
    assert len(search({0: 1.5 * drift, 1: 1.5 * drift})) == 2
    assert search({0: 2.2 * drift, 1: -2.2 * drift}) == ()


@pytest.mark.parametrize('key', [0, 1])
def test_one_that_the_image_does_not_confirm_is_not_accepted(key):
    assert search(supports={key: 0.3 * KEYPOINTS}) == ()


def test_the_nearest_two_old_ones_are_sought():
    graph = graph_of(POSITIONS)
    assert candidates(graph, 6, stamps(7), SETTINGS.odometry) == (0, 1)
    assert candidates(graph, 3, stamps(7), SETTINGS.odometry) == ()


def test_young_ones_are_not_sought():
    assert candidates(graph_of(POSITIONS), 6, stamps(7, 0.3), SETTINGS.odometry) == ()


@pytest.mark.parametrize('sigma, is_sought', [(0.149, True), (0.151, False)])
def test_a_keyframe_is_sought_up_to_a_sigma_of_15_cm(sigma, is_sought):
    """The first is six steps away, each with an equal variance along the three axes."""
    graph = KeyframeGraph(0, PoseWithCovariance.identity())
    step = np.diag([sigma ** 2 / 6 / 3] * 3 + [1e-12] * 3)
    for key in range(1, len(POSITIONS)):
        motion = se3.exp([POSITIONS[key] - POSITIONS[key - 1], 0, 0, 0, 0, 0])
        graph.add(key, PoseWithCovariance(motion, step), key - 1)
    assert (0 in candidates(graph, 6, stamps(7), SETTINGS.odometry)) == is_sought


def test_a_frame_that_became_a_keyframe_twice_is_one_witness_and_none_of_itself():
    graph, twice = graph_of(POSITIONS), stamps(7)
    twice[1] = twice[0]
    assert not {0, 1} <= set(candidates(graph, 6, twice, SETTINGS.odometry))
    any_age = dataclasses.replace(SETTINGS.odometry, reuse_age=0.0)
    assert 6 not in candidates(graph, 6, stamps(7), any_age)


def test_a_single_one_is_not_sought():
    positions = [0.0, 1.0, 2.0, 1.0, 0.02]
    assert candidates(graph_of(positions), 4, stamps(5), SETTINGS.odometry) == ()


def test_one_that_looks_elsewhere_is_not_sought():
    graph = graph_of(POSITIONS)
    turn = se3.exp([0, 0, 0, 0, 0.9, 0])
    graph.add(7, PoseWithCovariance(turn, SIGMA ** 2 * np.eye(6)), 6)
    assert candidates(graph, 7, stamps(8), SETTINGS.odometry) == ()


@pytest.mark.parametrize('position, angle, expected', [
    ((0.3, 0.0, 0.4), 0.0, 1.0), ((0.0, 0.0, 0.0), 0.2, 1.0), ((0.0, 0.5, 0.0), 0.2, 2 ** 0.5),
    ((0.0, 0.0, 0.0), 3.0, 15.0)])
def test_views_are_apart_by_distance_and_angle_each_by_its_own_limit(position, angle, expected):
    pose = se3.exp([1.0, -2.0, 3.0, 0.1, 0.2, 0.3])
    other = pose.copy()
    other[:3, :3] = pose[:3, :3] @ se3.exp_rotation([0.0, angle, 0.0])
    other[:3, 3] += position
    settings = dataclasses.replace(SETTINGS.odometry, reuse_distance=0.5, reuse_angle=0.2)
    assert view_distances(pose[None], other[None], settings)[0, 0] == pytest.approx(expected)


def test_where_the_pose_is_not_known_none_is_sought():
    """After a long loss a place that looks alike could not be distinguished from the right one."""
    graph = graph_of(POSITIONS, sigma=0.1)
    assert candidates(graph, 6, stamps(7), SETTINGS.odometry) == ()


@pytest.mark.parametrize('most, fewest', [(400, 35), (60, 21)])
def test_a_third_of_the_keypoints_that_can_be_tracked_confirms_a_place(most, fewest):
    settings = with_values(SETTINGS, {'refinement.max_tracks': most})
    for support, is_confirmed in ((fewest, True), (fewest - 1, False)):
        assert bool(search(supports={0: support}, settings=settings)) == is_confirmed


@pytest.mark.parametrize('values', [{'tracks': None}, {'status': Status.TOO_FEW_MATCHES}])
def test_what_failed_or_no_track_confirms_is_not_accepted(values):
    """However many matches it has; no other one is sought then."""
    assert search(**values) == ()


def test_a_search_knows_which_keyframes_it_compares():
    assert KeyframeSearch(6, (0, 1)).keys == {0, 1, 6}


def test_at_its_gate_a_measurement_is_accepted(monkeypatch):
    accepted = search()
    graph = graph_of(POSITIONS)
    limits = tuple(graph.squared_distance(accepted[:count]) for count in (1, 2))
    for gates, is_accepted in (
            (limits, True), ((np.nextafter(limits[0], -1.0), limits[1]), False),
            ((limits[0], np.nextafter(limits[1], -1.0)), False)):
        monkeypatch.setattr(keyframe_search, 'LARGEST_SQUARED_DISTANCES',
                            dict(zip((6, 12), gates)))
        assert bool(search()) == is_accepted


def test_a_keyframe_of_the_least_age_is_sought():
    """Just two of them are; a nanosecond younger one of them is not."""
    young = dataclasses.replace(SETTINGS.odometry, reuse_age=5.0)
    ages = stamps(7)
    assert candidates(graph_of(POSITIONS), 6, ages, young) == (0, 1)
    ages[1] += 1
    assert candidates(graph_of(POSITIONS), 6, ages, young) == ()


def uncertain(sigmas):
    """Return a graph of keyframes that are near each other, with errors along x of each alone."""
    graph = KeyframeGraph(0, PoseWithCovariance.identity())
    for key, sigma in enumerate(sigmas, 1):
        step = np.zeros((6, 6))
        step[0, 0] = sigma ** 2
        graph.add(key, PoseWithCovariance(se3.exp([0.01 * (len(sigmas) - key), 0, 0, 0, 0, 0]),
                                          step), 0)
    return graph


@pytest.mark.parametrize('certain, chosen', [
    ((5, 4), (5, 4)), ((5, 4, 3), (5, 4)), ((3, 2), (3, 2)), ((5, 2), (5, 2)), ((2, 1), ()),
    ((5, 1), ())])
def test_of_the_four_nearest_two_must_be_certain(certain, chosen):
    """The sixth keyframe is at the place of the first; the nearer, the larger the key."""
    graph = uncertain([0.01 if key in certain else 1.0 for key in range(1, 6)] + [0.0])
    graph.remove(0)
    assert candidates(graph, 6, {key: key * NANOSECONDS for key in range(7)},
                      dataclasses.replace(SETTINGS.odometry, reuse_age=1.0)) == chosen


def test_a_keyframe_is_not_sought_at_the_largest_sigma(monkeypatch):
    """Half a metre, exactly."""
    monkeypatch.setattr(keyframe_search, 'MAX_SIGMA', 0.5)
    now = dataclasses.replace(SETTINGS.odometry, reuse_age=1.0)
    for sigma, is_sought in ((0.5, False), (np.nextafter(0.5, 0.0), True)):
        graph = uncertain([sigma, sigma, 0.0])
        graph.remove(0)
        ages = {key: key * NANOSECONDS for key in range(4)}
        assert (candidates(graph, 3, ages, now) == (2, 1)) == is_sought


def test_the_error_that_counts_is_that_of_the_keyframe_seen_from_the_earlier_one():
    """Its own orientation, which is not known here, moves the earlier one that it sees, only."""
    graph = graph_of(POSITIONS[:6])
    turned = np.diag([SIGMA ** 2] * 3 + [1.0] * 3)
    graph.add(6, PoseWithCovariance(se3.exp([0.16, 0, 0, 0, 0, 0]), turned), 5)
    assert np.sqrt(np.trace(graph.relative(6, 2).covariance[:3, :3])) > 0.15
    assert candidates(graph, 6, stamps(7), SETTINGS.odometry) == (2, 4)


@pytest.mark.parametrize('supports, errors, found, missed', [
    ({}, {}, (0, 1), None),
    ({0: 0.3 * KEYPOINTS}, {}, (), 0),
    ({1: 0.3 * KEYPOINTS}, {}, (0,), 1),
    ({}, {0: 0.5}, (0,), None),  # the images show it, but not where the graph does
])
def test_a_search_knows_what_the_images_show(supports, errors, found, missed):
    frames = {key: SimpleNamespace(key=key, keypoints=Keypoints())
              for key in range(len(POSITIONS))}
    seeking, graph = KeyframeSearch(6, (0, 1)), graph_of(POSITIONS)
    assert seeking.key == 6 and seeking.found == () and seeking.missed is None
    while not seeking.is_finished:
        seeking.step(graph, frames, FakeRegistrar(POSITIONS, errors, supports), SETTINGS)
    assert seeking.found == found and seeking.missed == missed


@pytest.mark.parametrize('missed, steps', [(None, 4), (0, 1), (1, 3)])
def test_aick_alone_is_a_step_and_where_it_fails_nothing_is_refined(missed, steps):
    frames = {key: SimpleNamespace(key=key, keypoints=Keypoints())
              for key in range(len(POSITIONS))}
    registrar, seeking = FakeRegistrar(POSITIONS), KeyframeSearch(6, (0, 1))
    registrar.aligned = {missed: Status.TOO_FEW_MATCHES}
    for _ in range(steps):
        assert not seeking.is_finished
        accepted = seeking.step(graph_of(POSITIONS), frames, registrar, SETTINGS)
    assert seeking.is_finished and seeking.missed == missed
    assert len(accepted) == (2 if missed is None else 0)


def test_a_registration_that_is_rough_goes_on_in_the_next_step():
    frames = {key: SimpleNamespace(key=key, keypoints=Keypoints())
              for key in range(len(POSITIONS))}
    registrar, seeking = FakeRegistrar(POSITIONS), KeyframeSearch(6, (0, 1))
    recognize, rough = registrar.recognize_partly, []

    def partly(source, target, aligned):
        if len(rough) == target.key and target.key == 0:
            rough.append(dataclasses.replace(aligned, is_rough=True))
            return rough[0]
        assert (aligned is rough[0]) == (target.key == 0)
        return recognize(source, target, aligned)

    registrar.recognize_partly = partly
    begun = []
    for _ in range(5):
        assert not seeking.is_finished
        accepted = seeking.step(graph_of(POSITIONS), frames, registrar, SETTINGS)
        begun.append(seeking.has_begun)
    assert seeking.is_finished and len(accepted) == 2
    assert begun == [True, True, False, True, False]
