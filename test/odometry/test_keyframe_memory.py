# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keyframes that are found again, on simulated walks with drawn errors."""

import numpy as np
import pytest

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.keyframe_memory import KeyframeMemory
from aick_ros.odometry.reference import Reference
from aick_ros.registration.result import Registration
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

COVARIANCE = np.diag(np.square([0.004, 0.004, 0.004, 0.002, 0.002, 0.002]))
NO_DETOUR = np.zeros((6, 6))
PERIOD = 0.5  # between two keyframes [s]
FRAMES = 12  # tracked with each keyframe
KEYPOINTS = 100
CAMERA = Camera(32, 24, 26.0, 26.0, 15.5, 11.5)
LAP = 12  # keyframes


def prepared(index):
    """Return a frame that nothing is known of but its stamp."""
    stamp = round(index * PERIOD * NANOSECONDS)
    grey = np.zeros((24, 32), np.uint8)
    frame = RgbdFrame(stamp, np.zeros((24, 32, 3), np.uint8), np.ones((24, 32), np.float32),
                      CAMERA)
    none = np.zeros((KEYPOINTS, 3), np.float32)
    return PreparedFrame(frame, KeypointFrame(
        stamp, none, none, np.zeros((KEYPOINTS, 3, 3)), none[:, :2]), grey)


def laps(count, rng):
    """Return true poses on a circle of half a metre, walked several times, never quite alike."""
    poses = []
    for index in range(count * LAP):
        angle = 2 * np.pi * index / LAP
        place = np.array([0.5 * np.cos(angle), 0.5 * np.sin(angle), 0.0, 0.0, 0.0, 0.0])
        poses.append(se3.exp(place + rng.normal(0, 0.02, 6)))
    return poses


class NoisyRegistrar:
    """Registers frames by their true poses, with drawn errors."""

    def __init__(self, true_poses, rng):
        self._true_poses, self._rng = true_poses, rng
        self.count = 0

    def measure(self, source, target):
        """Return the measured pose of a frame in another one, both by their numbers."""
        error = self._rng.multivariate_normal(np.zeros(6), COVARIANCE)
        pose = se3.inverse(self._true_poses[target]) @ self._true_poses[source]
        return PoseWithCovariance(se3.perturbed(pose, error), COVARIANCE)

    def recognize(self, source, target):
        self.count += 1
        pose = self.measure(*(round(frame.stamp / NANOSECONDS / PERIOD)
                              for frame in (source, target)))
        return Registration(Status.OK, '', pose.matrix, pose.covariance,
                            np.empty((0, 2), int), 1, KEYPOINTS, tracks=())


class Walk:
    """A walk with a memory, and the same one by dead reckoning."""

    def __init__(self, seed, count=3, changes=None, start=np.eye(4)):
        rng = np.random.default_rng(seed)
        self.truth = [start @ pose for pose in laps(count, rng)]
        self.registrar = NoisyRegistrar(self.truth, rng)
        settings = with_values(Settings(), changes or {})
        keyframe = Reference(prepared(0), PoseWithCovariance(self.truth[0]))
        self.memory = KeyframeMemory(settings, self.registrar, keyframe)
        self.reckoned, self.published, self.sizes = [keyframe.pose], [keyframe.pose], []
        self.searched = []
        for index in range(1, len(self.truth)):
            pose = keyframe.pose @ self.registrar.measure(index, index - 1)
            keyframe = Reference(prepared(index), pose)
            for _ in range(FRAMES):
                before = self.registrar.count
                self.memory.track(keyframe, pose.matrix, NO_DETOUR)
                self.searched.append(self.registrar.count - before)
                self.reckoned.append(pose)
                self.published.append(self.memory.published(pose))
            self.sizes.append(len(self.memory.frames))

    def errors(self, poses):
        """Return the errors of the poses at the last frame of each keyframe, Nx6."""
        return np.array([se3.difference(pose.matrix, true)
                         for pose, true in zip(poses[::FRAMES], self.truth)])


def test_a_walk_that_returns_keeps_less_than_half_of_its_drift():
    walks = [Walk(seed) for seed in range(4)]
    last = slice(-LAP, None)
    drift, left = (np.sqrt(np.mean([np.square(walk.errors(poses)[last, :3]).sum(axis=1)
                                    for walk, poses in zip(walks, paths)]))
                   for paths in ([walk.reckoned for walk in walks],
                                 [walk.published for walk in walks]))
    assert left < 0.5 * drift
    assert all(walk.memory.reused > LAP for walk in walks)


def test_the_covariance_of_the_pose_shrinks_and_is_honest():
    nees = []
    for seed in range(5):
        walk = Walk(seed)
        pose = walk.published[-1]
        assert (np.trace(pose.covariance[:3, :3])
                < 0.6 * np.trace(walk.reckoned[-1].covariance[:3, :3]))
        for pose, error in list(zip(walk.published[::FRAMES], walk.errors(walk.published)))[5::7]:
            nees.append(error @ np.linalg.solve(pose.covariance, error))
    assert np.mean(np.array(nees) < 12.59) > 0.9
    assert np.mean(nees) < 7.0


def test_an_earlier_frame_that_becomes_the_keyframe_again_is_where_it_was():
    moved = PoseWithCovariance(se3.exp([0.3, -0.2, 0.1, 0.2, 0.1, -0.3]), COVARIANCE)
    memory = KeyframeMemory(Settings(), None, Reference(
        prepared(0), PoseWithCovariance.identity()))
    memory.track(Reference(prepared(1), moved), moved.matrix, NO_DETOUR)
    again = Reference(prepared(0), PoseWithCovariance.identity())
    memory.track(again, np.eye(4), NO_DETOUR)
    # the keypoints of each are where its camera was
    places = memory.keypoints_from(PoseWithCovariance.identity()).reshape(3, KEYPOINTS, 3)[:, 0]
    np.testing.assert_allclose(places, [np.zeros(3), moved.translation, np.zeros(3)], atol=1e-6)


def test_the_local_map_is_seen_from_where_the_camera_is():
    """The keypoints here are where their camera was; keyframes found again correct them."""
    by_graph, by_reckoning = [], []
    for seed in range(4):
        walk = Walk(seed)
        points = walk.memory.keypoints_from(walk.reckoned[-1]).reshape(-1, KEYPOINTS, 3)
        assert len(points) == len(walk.memory.frames) > LAP
        assert np.ptp(points, axis=1).max() < 1e-9
        for frame, point in zip(walk.memory.frames, points[:, 0]):
            index = round(frame.stamp / NANOSECONDS / PERIOD)
            true = se3.inverse(walk.truth[-1]) @ walk.truth[index]
            reckoned = (se3.inverse(walk.reckoned[-1].matrix)
                        @ walk.reckoned[1 + FRAMES * (index - 1) if index else 0].matrix)
            by_graph.append(np.linalg.norm(point - true[:3, 3]))
            by_reckoning.append(np.linalg.norm(reckoned[:3, 3] - true[:3, 3]))
    assert np.mean(by_graph) < 0.7 * np.mean(by_reckoning)


def test_nothing_jumps():
    walk = Walk(1)
    settings = Settings().odometry
    for i in range(len(walk.published) - 1):
        measured = se3.inverse(walk.reckoned[i].matrix) @ walk.reckoned[i + 1].matrix
        step = se3.difference(walk.published[i + 1].matrix, walk.published[i].matrix @ measured)
        assert np.linalg.norm(step[:3]) <= settings.correction_step * (1 + 1e-6)
        assert np.linalg.norm(step[3:]) <= settings.correction_turn * (1 + 1e-6)


def test_a_frame_costs_at_most_one_registration():
    walk = Walk(2)
    assert max(walk.searched) == 1


def test_a_search_waits_for_its_interval():
    often, seldom = (Walk(3, changes={'odometry.reuse_interval': interval})
                     for interval in (0.0, 4 * PERIOD))
    assert seldom.registrar.count < 0.4 * often.registrar.count


@pytest.mark.parametrize(('changes', 'most'), [
    ({'odometry.max_keyframes': 15}, 15),
    ({'odometry.max_keyframes': 0}, 1),
    ({'odometry.reference': 'previous'}, 1),
    ({'refinement.mode': 'none'}, 1),
])
def test_keyframes_are_kept_up_to_a_number(changes, most):
    walk = Walk(4, changes=changes)
    assert max(walk.sizes) == most
    if most == 1:
        assert walk.registrar.count == 0
        for published, reckoned in zip(walk.published, walk.reckoned):
            assert published is reckoned
    else:
        assert walk.memory.reused > 0


def test_keyframes_are_kept_up_to_their_bytes(monkeypatch):
    monkeypatch.setattr('aick_ros.odometry.keyframe_memory._size', lambda frame: 250_000)
    assert max(Walk(4, changes={'odometry.keyframe_megabytes': 2.0}).sizes) == 8


def test_of_two_keyframes_alike_the_older_one_goes():
    memory = Walk(5, changes={'odometry.max_keyframes': LAP + 2}).memory
    kept = sorted(round(frame.stamp / NANOSECONDS / PERIOD) for frame in memory.frames)
    assert len({index % LAP for index in kept}) == LAP
    assert np.mean(kept) > LAP


def test_a_detour_makes_the_next_keyframe_less_certain():
    traces = []
    for detour in (NO_DETOUR, COVARIANCE):
        walk = Walk(6, count=2)
        walk.truth.append(walk.truth[-1])
        end = walk.reckoned[-1]
        new = Reference(prepared(2 * LAP), PoseWithCovariance(end.matrix, end.covariance))
        walk.memory.track(new, end.matrix, detour)
        traces.append(np.trace(walk.memory.published(new.pose).covariance))
    # in the chain, and in what all registrations of the keyframe share
    assert traces[1] - traces[0] == pytest.approx(2 * np.trace(COVARIANCE), rel=1e-6)


def test_what_the_registrations_of_a_keyframe_share_is_in_the_axes_of_odom():
    """An error along the x axis of the keyframe before, which looks along the y axis of odom."""
    covariances, detour = [], np.diag([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    for added in (NO_DETOUR, detour):
        walk = Walk(6, count=2, start=se3.exp([0, 0, 0, 0, 0, np.pi / 2]))
        walk.truth.append(walk.truth[-1])
        end, before = walk.reckoned[-1], walk.published[-1].rotation
        walk.memory.track(Reference(prepared(2 * LAP), end), end.matrix, added)
        covariances.append(walk.memory.published(end).covariance)
    assert abs(before[1, 0]) > 0.98
    expected = np.zeros((6, 6))
    expected[:3, :3] = 2 * before @ detour[:3, :3] @ before.T
    np.testing.assert_allclose(covariances[1] - covariances[0], expected, atol=2e-5)
