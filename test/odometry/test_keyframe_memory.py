# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keyframes that are found again, on simulated walks with drawn errors."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.depth_distortion import COLUMNS, ROWS, DepthDistortion
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import Grid, Surface
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import kept_frame
from aick_ros.odometry.effort import Effort
from aick_ros.odometry.keyframe_graph import RelativePose
from aick_ros.odometry.keyframe_memory import KeyframeMemory
from aick_ros.odometry.reference import Reference
from aick_ros.registration.result import Registration, failed
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

COVARIANCE = np.diag(np.square([0.004, 0.004, 0.004, 0.002, 0.002, 0.002]))
INTERVAL = 1 / 30  # s
NO_DETOUR = np.zeros((6, 6))
PERIOD = 0.5  # between two keyframes [s]
FRAMES = 12  # tracked with each keyframe
KEYPOINTS = 100
CAMERA = Camera(32, 24, 26.0, 26.0, 15.5, 11.5)
GRID = Grid(8, 6, 6.5, 6.5, 3.5, 2.5)
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

    def prepared_like(self, target, source):
        return target

    def prepared_again(self, prepared):
        return prepared

    def measure(self, source, target):
        """Return the measured pose of a frame in another one, both by their numbers."""
        error = self._rng.multivariate_normal(np.zeros(6), COVARIANCE)
        pose = se3.inverse(self._true_poses[target]) @ self._true_poses[source]
        return PoseWithCovariance(se3.perturbed(pose, error), COVARIANCE)

    def align(self, source, target):
        return failed(Status.OK, '')

    def recognize_partly(self, source, target, aligned):
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
                self.memory.track(keyframe, pose.matrix, NO_DETOUR, INTERVAL)
                self.searched.append(self.registrar.count - before)
                self.reckoned.append(pose)
                self.published.append(self.memory.published(pose))
                np.testing.assert_array_equal(self.memory.T_odom_reckoned @ pose.matrix,
                                              self.published[-1].matrix)
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
    memory = KeyframeMemory(Settings(), Bringing(), Reference(
        prepared(0), PoseWithCovariance.identity()))
    memory.track(Reference(prepared(1), moved), moved.matrix, NO_DETOUR, INTERVAL)
    again = Reference(prepared(0), PoseWithCovariance.identity())
    memory.track(again, np.eye(4), NO_DETOUR, INTERVAL)
    # the keypoints of each are where its camera was
    places = memory.keypoints_from(PoseWithCovariance.identity()).reshape(3, KEYPOINTS, 3)[:, 0]
    np.testing.assert_allclose(places, [np.zeros(3), moved.translation, np.zeros(3)], atol=1e-6)


def test_a_first_keyframe_is_kept_with_the_velocity_that_the_next_frame_shows():
    first, twist = Reference(prepared(0), PoseWithCovariance.identity()), np.arange(6.0)
    memory = KeyframeMemory(Settings(), NoisyRegistrar([], np.random.default_rng(0)), first)
    moving = dataclasses.replace(first, prepared=first.prepared.moving(twist, twist ** 2))
    for keyframe in (first, moving, moving):
        memory.track(keyframe, np.eye(4), NO_DETOUR, INTERVAL)
    assert np.array_equal(memory.frames[0].twist, twist)
    assert np.array_equal(memory.frames[0].twist_variances, twist ** 2)


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
    monkeypatch.setattr('aick_ros.odometry.keyframe_memory.size', lambda frame: 250_000)
    assert max(Walk(4, changes={'odometry.keyframe_megabytes': 2.0}).sizes) == 7


@pytest.mark.parametrize('most', [1, 15])
def test_the_memory_of_all_keyframes_is_taken_with_the_first_one(monkeypatch, most):
    taken, mapping = [], kept_frame._mapping
    monkeypatch.setattr(kept_frame, '_mapping', lambda size: taken.append(size) or mapping(size))
    settings = with_values(Settings(), {'odometry.max_keyframes': most})
    KeyframeMemory(settings, None, Reference(prepared(0), PoseWithCovariance.identity()))
    assert len(taken) == most + 1  # a new one comes before an old one goes
    Walk(4, changes={'odometry.max_keyframes': most})
    assert len(taken) == 2 * (most + 1)


def test_of_two_keyframes_alike_the_older_one_goes():
    memory = Walk(5, changes={'odometry.max_keyframes': LAP + 2}).memory
    kept = sorted(round(frame.stamp / NANOSECONDS / PERIOD) for frame in memory.frames)
    assert len({index % LAP for index in kept}) == LAP
    assert np.mean(kept) > LAP


def test_a_walk_that_repeats_keeps_its_views_and_no_more_however_long_it_is():
    """Reuse works as before: the error of the tenth lap is that of the third."""
    walks = [Walk(seed, count=10, changes={'odometry.max_keyframes': 1000}) for seed in (7, 8)]
    for walk in walks:
        assert LAP < walk.sizes[3 * LAP] and max(walk.sizes[3 * LAP:]) <= 3 * LAP
        assert abs(np.mean(walk.sizes[-LAP:]) - np.mean(walk.sizes[4 * LAP:5 * LAP])) < 3
        last, third = (walk.errors(walk.published)[lap * LAP:(lap + 1) * LAP, :3]
                       for lap in (9, 2))
        assert np.linalg.norm(last, axis=1).mean() < 2 * np.linalg.norm(third, axis=1).mean()
        assert walk.memory.reused > 8 * LAP


def test_a_search_that_misses_what_is_there_is_learned_from(scripted, monkeypatch):
    learned = []
    monkeypatch.setattr('aick_ros.odometry.keyframe_copies.KeyframeCopies.learn',
                        lambda self, *args: learned.append(args))
    script = scripted(steps=2)
    memory, settings = memory_at(START, {'odometry.reuse_interval': 0.0})
    for _ in range(2):
        memory.track(metres_apart(1), START.matrix, NO_DETOUR, INTERVAL)
    assert learned == [] and script.made == 1
    memory.track(metres_apart(1), START.matrix, NO_DETOUR, INTERVAL)
    (search, graph, used), = learned
    assert search.keys == {0, 1} and graph.keys == (0, 1) and used == settings.odometry


class Forgetful(set):
    """Keys that are compared each time: none is known to be no copy."""

    def update(self, keys):
        pass


@pytest.mark.parametrize('forgets', [True, False])
def test_newer_views_replace_one_that_searches_have_missed(forgets):
    """The first of five equal views, though it was no copy while it was alone."""
    memory, _ = memory_at(START)
    if forgets:
        memory._no_copies = Forgetful()
    memory._copies._misses[0] = 2
    for index in range(1, 6):
        memory.track(Reference(prepared(index), START), START.matrix, NO_DETOUR, INTERVAL)
    stamps = [frame.stamp for frame in memory.frames]
    assert stamps == [prepared(index).stamp for index in (1, 2, 5)]


@pytest.mark.parametrize('seed', [3, 4])
def test_what_is_kept_does_not_depend_on_what_was_compared_before(seed, monkeypatch):
    known = Walk(seed, count=5, changes={'odometry.max_keyframes': 1000})
    monkeypatch.setattr('aick_ros.odometry.keyframe_memory.set', Forgetful, raising=False)
    compared = Walk(seed, count=5, changes={'odometry.max_keyframes': 1000})
    assert isinstance(compared.memory._no_copies, Forgetful)
    assert [frame.stamp for frame in known.memory.frames] == [
        frame.stamp for frame in compared.memory.frames]
    assert known.sizes == compared.sizes and max(known.sizes) > LAP


def test_a_detour_makes_the_next_keyframe_less_certain():
    traces = []
    for detour in (NO_DETOUR, COVARIANCE):
        walk = Walk(6, count=2)
        walk.truth.append(walk.truth[-1])
        end = walk.reckoned[-1]
        new = Reference(prepared(2 * LAP), PoseWithCovariance(end.matrix, end.covariance))
        walk.memory.track(new, end.matrix, detour, INTERVAL)
        traces.append(np.trace(walk.memory.published(new.pose).covariance))
    assert traces[1] - traces[0] == pytest.approx(np.trace(COVARIANCE), rel=1e-6)


def test_a_detour_is_in_the_axes_of_the_keyframe_before():
    """An error along the x axis of the keyframe before, which looks along the y axis of odom."""
    covariances, detour = [], np.diag([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    for added in (NO_DETOUR, detour):
        walk = Walk(6, count=2, start=se3.exp([0, 0, 0, 0, 0, np.pi / 2]))
        walk.truth.append(walk.truth[-1])
        end, before = walk.reckoned[-1], walk.published[-1].rotation
        walk.memory.track(Reference(prepared(2 * LAP), end), end.matrix, added, INTERVAL)
        covariances.append(walk.memory.published(end).covariance)
    assert abs(before[1, 0]) > 0.98
    expected = np.zeros((6, 6))
    expected[:3, :3] = before @ detour[:3, :3] @ before.T
    np.testing.assert_allclose(covariances[1] - covariances[0], expected, atol=2e-5)


KNOWING_NOTHING = 1e12 * np.eye(6)


class Script:
    """
    A search that goes on for some steps, and then accepts some measurements.

    :ivar asked: what each search was made for, and what each step was given.
    """

    def __init__(self, steps=1, accepted=(), chosen=(0,)):
        self.steps, self.accepted, self.chosen = steps, accepted, chosen
        self.asked, self.made = [], 0

    def candidates(self, graph, key, stamps, settings):
        self.asked.append(('candidates', key, dict(stamps), settings))
        return self.chosen

    def search(self, key, chosen):
        self.asked.append(('search', key, chosen))
        self.made += 1
        return ScriptedSearch(self, key, chosen)


class ScriptedSearch:
    found, missed = (), None

    def __init__(self, script, key, chosen):
        self.left, self.script = script.steps, script
        self.key, self.keys = key, frozenset((key, *chosen))
        self.candidate = chosen[0]

    @property
    def is_finished(self):
        return self.left == 0

    @property
    def has_begun(self):
        return self.left % 2 == 0 and not self.is_finished

    def step(self, graph, frames, registrar, settings):
        self.left -= 1
        self.script.asked.append(('step', tuple(frames), registrar, settings))
        return () if self.left else self.script.accepted


@pytest.fixture
def scripted(monkeypatch):
    """Return the function that lets searches follow a script."""
    def follow(*args, **values):
        script = Script(*args, **values)
        monkeypatch.setattr('aick_ros.odometry.keyframe_memory.candidates', script.candidates)
        monkeypatch.setattr('aick_ros.odometry.keyframe_memory.KeyframeSearch', script.search)
        return script
    return follow


class Bringing:
    """A registrar that is only asked to prepare frames as others are, or by its settings."""

    def __init__(self):
        self.brought_to, self.settings = {}, None

    def prepared_like(self, target, source):
        if (target.distortion, target.settings) == (source.distortion, source.settings):
            return target
        self.brought_to[target.stamp] = source.stamp
        return dataclasses.replace(target, distortion=source.distortion, settings=source.settings)

    def prepared_again(self, prepared):
        if prepared.settings == self.settings:
            return prepared
        return dataclasses.replace(prepared, settings=self.settings)


def memory_at(pose, changes=None, registrar=None, **options):
    settings = with_values(Settings(), changes or {})
    return KeyframeMemory(
        settings, registrar or Bringing(), Reference(prepared(0), pose), **options), settings


def metres_apart(index):
    """Return the keyframe of a view that no other shows."""
    return Reference(prepared(index), START @ PoseWithCovariance(
        se3.exp([float(index), 0.0, 0.0, 0.0, 0.0, 0.0]), COVARIANCE))


def kinds(script):
    return [asked[0] for asked in script.asked]


STEPS = [PoseWithCovariance(se3.exp([0.3, -0.2, 0.1, 0.2, 0.1, -0.3]), COVARIANCE),
         PoseWithCovariance(se3.exp([-0.1, 0.2, 0.4, 0.3, -0.2, 0.1]), 2 * COVARIANCE),
         PoseWithCovariance(se3.exp([0.02, 0.01, 0.03, 0.02, 0.05, 0.01]), 3 * COVARIANCE)]
START = PoseWithCovariance(se3.exp([1.0, 2.0, 0.5, 0.4, 0.2, -0.9]))


def test_a_search_is_for_the_newest_keyframe_and_takes_a_step_a_frame(scripted):
    """Not with the keyframe; no other is begun meanwhile, the next one with the next keyframe."""
    script = scripted(steps=2)
    registrar = Bringing()
    memory, settings = memory_at(START, {'odometry.reuse_interval': 1.0}, registrar)
    keyframes = [Reference(prepared(index), START) for index in range(8)]
    tenths = [round(keyframe.stamp / NANOSECONDS * 10) for keyframe in keyframes]
    assert tenths[:4] == [0, 5, 10, 15]
    memory.track(keyframes[0], START.matrix, NO_DETOUR, INTERVAL)  # the first one is there already
    memory.track(keyframes[1], START.matrix, NO_DETOUR, INTERVAL)
    assert script.asked == [] and len(memory.frames) == 2
    memory.track(keyframes[2], START.matrix, NO_DETOUR, INTERVAL)  # a second after the first
    stamps = {key: keyframe.stamp for key, keyframe in enumerate(keyframes[:3])}
    step = ('step', (0, 1, 2), registrar, settings)
    assert script.asked == [('candidates', 2, stamps, settings.odometry), ('search', 2, (0,))]
    memory.track(keyframes[2], START.matrix, NO_DETOUR, INTERVAL)
    assert script.asked[2:] == [step]
    memory.track(keyframes[2], START.matrix, NO_DETOUR, INTERVAL)
    assert script.asked[3:] == [step] and registrar.brought_to == {}
    memory.track(keyframes[3], START.matrix, NO_DETOUR, INTERVAL)
    assert len(script.asked) == 4  # half a second after the search before
    memory.track(keyframes[4], START.matrix, NO_DETOUR, INTERVAL)
    assert kinds(script)[4:] == ['candidates', 'search']
    memory.track(keyframes[7], START.matrix, NO_DETOUR, INTERVAL)  # while it is searched
    assert kinds(script)[6:] == ['step']


def test_a_keyframe_is_brought_to_what_is_known_where_it_is_sought_and_stays_so(scripted):
    """Once, at the begin of its registration, and kept as compact as it was."""
    script, registrar = scripted(steps=3), Bringing()
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0}, registrar)
    known = DepthDistortion(np.full((ROWS, COLUMNS), 0.01))
    new = Reference(dataclasses.replace(prepared(1), distortion=known), START)
    before = memory.frames[0]
    memory.track(new, START.matrix, NO_DETOUR, INTERVAL)
    assert memory.frames[0] is before and registrar.brought_to == {}
    for _ in range(3):
        memory.track(new, START.matrix, NO_DETOUR, INTERVAL)
        assert memory.frames[0].distortion == known
    assert kinds(script).count('step') == 3
    assert registrar.brought_to == {before.stamp: new.stamp}
    assert memory.frames[0].frame.colour is memory.frames[0].grey
    assert memory.frames[0].grey.base is not None  # in a mapping


def test_the_keyframes_of_a_search_are_those_of_the_settings_of_now(scripted):
    _, registrar = scripted(steps=3), Bringing()
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0}, registrar)
    new = Reference(prepared(1), START)
    memory.track(new, START.matrix, NO_DETOUR, INTERVAL)
    registrar.settings = Settings().preparation
    memory.track(new, START.matrix, NO_DETOUR, INTERVAL)
    assert [kept.settings for kept in memory.frames] == 2 * [registrar.settings]
    assert all(kept.grey.base is not None for kept in memory.frames)  # in a mapping


def test_a_step_waits_for_a_frame_that_is_easy_but_not_for_ever(scripted):
    script = scripted(steps=3)
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0})
    new = Reference(prepared(1), START)
    memory.track(new, START.matrix, NO_DETOUR, INTERVAL)
    assert 'step' not in kinds(script)
    memory.track(new, START.matrix, NO_DETOUR, INTERVAL, Effort.LEAST)
    assert kinds(script).count('step') == 1
    frames = 0
    while kinds(script).count('step') == 1:
        memory.track(new, START.matrix, NO_DETOUR, INTERVAL, Effort.MORE)
        frames += 1
    assert frames == 2
    memory.track(new, START.matrix, NO_DETOUR, INTERVAL, Effort.MORE)
    assert kinds(script).count('step') == 2


@pytest.mark.parametrize('interval, steps', [(0.05, [0, 1, 0, 1, 0]), (0.067, [2, 2, 2, 2, 2])])
def test_where_frames_come_slowly_each_has_a_whole_registration(scripted, interval, steps):
    """With the keyframe too, and whatever it took to register the frame."""
    script, counts = scripted(steps=99), []
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0})
    for count in steps:
        before = kinds(script).count('step')
        memory.track(Reference(prepared(1), START), START.matrix, NO_DETOUR, interval, Effort.MORE)
        counts.append(kinds(script).count('step') - before)
    assert counts == steps


@pytest.mark.parametrize('efforts, steps', [
    (8 * [Effort.MUCH], [0, 0, 1, 0, 0, 0, 1, 0]),
    ([Effort.MUCH, Effort.LEAST, Effort.MUCH, Effort.MUCH, Effort.MORE], [0, 1, 0, 0, 1])])
def test_a_step_waits_for_longer_where_a_frame_took_the_longest(scripted, efforts, steps):
    """Counted from the frame with which the search began, or with which it took a step."""
    script, counts = scripted(steps=99), []
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0})
    memory.track(Reference(prepared(1), START), START.matrix, NO_DETOUR, INTERVAL)
    script.asked.clear()
    for effort in efforts:
        before = kinds(script).count('step')
        memory.track(Reference(prepared(1), START), START.matrix, NO_DETOUR, INTERVAL, effort)
        counts.append(kinds(script).count('step') - before)
    assert counts == steps


@pytest.mark.parametrize('later, frames', [
    ([Effort.LEAST], 1), ([Effort.MUCH, Effort.MORE], 2), (5 * [Effort.MUCH], 3)])
def test_what_is_due_for_a_keyframe_waits_where_that_took_the_longest(scripted, later, frames):
    """For three frames at most; its pose counts at once, and a search takes no step with it."""
    script = scripted(steps=1)
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0, 'odometry.max_keyframes': 1})
    keyframe = metres_apart(1)
    memory.track(keyframe, START.matrix, NO_DETOUR, INTERVAL, Effort.MUCH)
    waited = 0
    while len(memory.frames) == 2:
        assert script.asked == [] and memory.frames[1] is keyframe.prepared
        np.testing.assert_allclose(memory.keypoints_from(keyframe.pose)[-1], np.zeros(3))
        memory.track(keyframe, START.matrix, NO_DETOUR, INTERVAL, later[waited])
        waited += 1
    assert waited == frames and kinds(script) == ['candidates', 'search']
    kept, = memory.frames
    assert kept.stamp == keyframe.stamp and kept.frame.colour is kept.grey


def test_where_frames_come_slowly_what_is_due_for_a_keyframe_does_not_wait(scripted):
    script = scripted(steps=9)
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0})
    memory.track(metres_apart(1), START.matrix, NO_DETOUR, 0.067, Effort.MUCH)
    assert kinds(script) == ['candidates', 'search', 'step', 'step']


def test_several_keyframes_that_wait_are_compacted_together(scripted):
    scripted(chosen=())
    memory, _ = memory_at(START)
    for index in (1, 2):
        memory.track(metres_apart(index), START.matrix, NO_DETOUR, INTERVAL, Effort.MUCH)
    assert [kept.frame.colour is kept.grey for kept in memory.frames] == [True, False, False]
    memory.track(metres_apart(3), START.matrix, NO_DETOUR, INTERVAL)
    assert all(kept.frame.colour is kept.grey for kept in memory.frames)
    assert len(memory.frames) == 4


def test_where_each_frame_is_a_keyframe_a_search_ends_all_the_same(scripted):
    script = scripted(steps=2)
    memory, _ = memory_at(START, {'odometry.reuse_interval': 100.0})
    memory.configure(with_values(Settings(), {'odometry.reuse_interval': 0.0}), Bringing())
    for index in range(1, 5):
        memory.track(metres_apart(index), START.matrix, NO_DETOUR, INTERVAL)
    assert kinds(script).count('step') == 2


def test_where_nothing_is_near_the_next_keyframe_is_searched(scripted):
    script = scripted(chosen=())
    memory, _ = memory_at(START, {'odometry.reuse_interval': 1.0})
    for index in (2, 3, 4):
        memory.track(Reference(prepared(index), START), START.matrix, NO_DETOUR, INTERVAL)
    assert kinds(script) == 3 * ['candidates']


def test_other_settings_are_those_of_the_next_step(scripted):
    script = scripted(steps=3)
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0})
    memory.track(Reference(prepared(1), START), START.matrix, NO_DETOUR, INTERVAL)
    memory.track(Reference(prepared(1), START), START.matrix, NO_DETOUR, INTERVAL)
    other = with_values(Settings(), {'odometry.reuse_age': 3.0})
    another = Bringing()
    memory.configure(other, another)
    memory.track(Reference(prepared(1), START), START.matrix, NO_DETOUR, INTERVAL)
    assert script.asked[-1] == ('step', (0, 1), another, other)


def test_without_a_refinement_a_search_ends(scripted):
    """It could not be completed, and a frame after a long interval would try for ever."""
    script = scripted(steps=3)
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0})
    for _ in range(2):
        memory.track(Reference(prepared(1), START), START.matrix, NO_DETOUR, INTERVAL)
    asked = len(script.asked)
    memory.configure(with_values(Settings(), {'refinement.mode': 'none'}), Bringing())
    memory.track(Reference(prepared(1), START), START.matrix, NO_DETOUR, 1.0)
    assert asked and len(script.asked) == asked


def found_again(scripted, measured, covariance, changes=None, **options):
    """
    Return a memory of two keyframes, the second found again, and poses by dead reckoning.

    The poses are those of the second keyframe and of a frame beyond it.

    :param measured: ``T_first_second`` as it was found.
    """
    scripted(accepted=(RelativePose(0, 1, PoseWithCovariance(measured, covariance)),))
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0, **(changes or {})}, **options)
    second = START @ STEPS[0]
    beyond = second @ STEPS[1]
    for _ in range(2):
        memory.track(Reference(prepared(1), second), beyond.matrix, NO_DETOUR, INTERVAL)
    return memory, second, beyond


def test_until_one_is_found_again_poses_are_those_of_dead_reckoning(scripted):
    scripted(accepted=())
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0})
    second = START @ STEPS[0]
    memory.track(Reference(prepared(1), second), second.matrix, NO_DETOUR, INTERVAL)
    assert memory.published(second) is second and memory.reused == 0


def test_what_is_found_without_any_information_changes_no_pose(scripted):
    """The covariance has the view that was found once more: what its registrations share."""
    memory, second, beyond = found_again(scripted, STEPS[0].matrix, KNOWING_NOTHING)
    assert memory.reused == 1
    found = memory.published(beyond)
    np.testing.assert_allclose(found.matrix, beyond.matrix, atol=1e-9)
    shared = START.rotation @ COVARIANCE[:3, :3] @ START.rotation.T
    assert np.allclose(shared, COVARIANCE[:3, :3])  # alike in all directions
    keyframe = PoseWithCovariance(second.matrix, second.covariance + COVARIANCE)
    np.testing.assert_allclose(found.covariance, (keyframe @ STEPS[1]).covariance, atol=1e-9)


def test_the_published_pose_approaches_where_the_keyframe_was_found(scripted):
    """By a sixtieth a frame; the error that is left is in the covariance."""
    truth = STEPS[0].matrix @ se3.exp([0.01, 0.02, -0.01, 0.01, 0.005, -0.01])
    memory, second, beyond = found_again(scripted, truth, 1e-14 * np.eye(6), {
        'odometry.correction_step': 0.1, 'odometry.correction_turn': 0.1})
    estimate = START.matrix @ truth @ STEPS[1].matrix
    error = se3.difference(estimate, beyond.matrix)
    found = memory.published(beyond)
    np.testing.assert_allclose(found.matrix, se3.perturbed(beyond.matrix, error / 60), atol=1e-7)
    left = found.covariance - np.outer(59 / 60 * error, 59 / 60 * error)
    keyframe = PoseWithCovariance(START.matrix @ truth, COVARIANCE)
    np.testing.assert_allclose(left, (keyframe @ STEPS[1]).covariance, atol=1e-7)
    # the map is seen from the estimate at once
    places = memory.keypoints_from(beyond).reshape(2, KEYPOINTS, 3)[:, 0]
    np.testing.assert_allclose(places[0], se3.inverse(truth @ STEPS[1].matrix)[:3, 3], atol=1e-6)
    np.testing.assert_allclose(places[1], se3.inverse(STEPS[1].matrix)[:3, 3], atol=1e-6)


def test_what_is_known_of_a_pose_beside_the_images_holds_where_a_place_was_found(scripted):
    """As of a plane: the place alone would lift the path out of it."""
    truth = STEPS[0].matrix @ se3.exp([0.01, 0.02, -0.01, 0.01, 0.005, -0.01])
    known = PoseWithCovariance(START.matrix @ truth @ se3.exp([0, 0, 0.02, 0, 0, 0.01]),
                               1e-8 * np.eye(6))
    asked = []
    memory, _, beyond = found_again(scripted, truth, 1e-14 * np.eye(6), {
        'odometry.correction_step': 0.1, 'odometry.correction_turn': 0.1},
        fuse=lambda pose: asked.append(pose.matrix) or known)
    np.testing.assert_allclose(asked[-1], START.matrix @ truth, atol=1e-6)
    error = se3.difference(known.matrix @ STEPS[1].matrix, beyond.matrix)
    found = memory.published(beyond)
    np.testing.assert_allclose(found.matrix, se3.perturbed(beyond.matrix, error / 60), atol=1e-7)
    left = found.covariance - np.outer(59 / 60 * error, 59 / 60 * error)
    keyframe = known.with_covariance(known.covariance + COVARIANCE)
    np.testing.assert_allclose(left, (keyframe @ STEPS[1]).covariance, atol=2e-6)


def test_a_keyframe_that_was_not_found_itself_has_its_own_error_once(scripted):
    """It was registered once; the error that the view before it has in common is carried on."""
    memory, second, beyond = found_again(scripted, STEPS[0].matrix, KNOWING_NOTHING)
    end = beyond @ STEPS[2]
    scripted(chosen=())
    memory.track(Reference(prepared(2), beyond), end.matrix, NO_DETOUR, INTERVAL)
    found = PoseWithCovariance(second.matrix, second.covariance + COVARIANCE)
    np.testing.assert_allclose(memory.published(end).covariance,
                               (found @ STEPS[1] @ STEPS[2]).covariance, atol=1e-9)


def test_a_keyframe_that_serves_again_has_the_error_of_the_way_back(scripted):
    """The frame of the first keyframe, found from the second one."""
    scripted(accepted=(RelativePose(0, 2, PoseWithCovariance(np.eye(4), KNOWING_NOTHING)),))
    memory, _ = memory_at(START, {'odometry.reuse_interval': 10.0})
    second = START @ STEPS[0]
    memory.track(Reference(prepared(1), second), second.matrix, NO_DETOUR, INTERVAL)
    memory.configure(with_values(Settings(), {'odometry.reuse_interval': 0.0}), Bringing())
    for _ in range(2):
        memory.track(Reference(prepared(0), START), START.matrix, NO_DETOUR, INTERVAL)
    back = STEPS[0].inverse()
    turned = second.rotation
    shared = np.zeros((6, 6))
    shared[:3, :3], shared[3:, 3:] = (turned @ part @ turned.T for part in (
        back.covariance[:3, :3], back.covariance[3:, 3:]))
    shared[:3, 3:] = turned @ back.covariance[:3, 3:] @ turned.T
    shared[3:, :3] = shared[:3, 3:].T
    np.testing.assert_allclose(memory.published(START).covariance,
                               (second @ back).covariance + shared, atol=1e-9)


def test_a_keyframe_that_serves_again_does_not_count_the_way_to_it_twice(scripted):
    """The way to the first keyframe is in the poses of both, so the way back is the step's."""
    scripted(accepted=(RelativePose(0, 2, PoseWithCovariance(np.eye(4), KNOWING_NOTHING)),))
    uncertain = PoseWithCovariance(START.matrix, 50 * COVARIANCE)
    found = []
    for start in (START, uncertain):
        memory, _ = memory_at(start, {'odometry.reuse_interval': 10.0})
        second = start @ STEPS[0]
        memory.track(Reference(prepared(1), second), second.matrix, NO_DETOUR, INTERVAL)
        memory.configure(with_values(Settings(), {'odometry.reuse_interval': 0.0}), Bringing())
        for _ in range(2):
            memory.track(Reference(prepared(0), start), start.matrix, NO_DETOUR, INTERVAL)
        found.append(memory.published(start).since(start).covariance)
    np.testing.assert_allclose(found[1], found[0], atol=1e-9)


def test_keyframes_that_are_compared_are_not_dropped(scripted):
    scripted(steps=99, chosen=(1, 3))
    memory, _ = memory_at(START, {'odometry.max_keyframes': 5, 'odometry.reuse_interval': 2.0})
    for index in range(1, 12):
        memory.track(metres_apart(index), START.matrix, NO_DETOUR, INTERVAL)
    kept = [round(frame.stamp / NANOSECONDS / PERIOD) for frame in memory.frames]
    # the search of keyframe 4 for 1 and 3, the newest, and one more
    assert {1, 3, 4, 11} <= set(kept) and len(kept) == 5


def test_what_a_search_needs_is_kept_beyond_the_number(scripted):
    scripted(steps=99, chosen=(0, 1))
    memory, _ = memory_at(START, {'odometry.reuse_interval': 1.0})
    for index in (1, 2):
        memory.track(metres_apart(index), START.matrix, NO_DETOUR, INTERVAL)
    memory.configure(with_values(Settings(), {'odometry.max_keyframes': 2}), Bringing())
    memory.track(metres_apart(3), START.matrix, NO_DETOUR, INTERVAL)
    assert len(memory.frames) == 4  # three that are compared, and the newest


@pytest.mark.parametrize('has_surface', [True, False])
def test_a_keyframe_takes_the_bytes_of_its_images_and_surface(has_surface):
    """Without colours, which no registration needs; the number that fits is rounded down.

    One more is there while a new one takes the place of another.
    """
    def zeros(*shape, kind=np.float32):
        return np.broadcast_to(np.zeros((), kind), shape)
    frame, camera, size = prepared(0), Camera(800, 500, 500, 500, 400, 250), 800 * 500 * (1 + 4)
    surface = None
    if has_surface:
        surface = Surface(GRID, zeros(9000, 3), zeros(9000, 3, kind=float),
                          zeros(9000, kind=bool), zeros(0, kind=int), zeros(50, 40))
        size += 9000 * (12 + 24 + 1) + 50 * 40 * 4
    grey = zeros(500, 800, kind=np.uint8)
    mapped = (int(1.06 * size) // 2 ** 16 + 1) * 2 ** 16
    for count, most in ((4.0, 3), (3.999, 2), (0.6, 1)):
        memory, _ = memory_at(START, {'odometry.keyframe_megabytes': count * mapped / 1e6})
        for index in range(1, 6):
            image = RgbdFrame(prepared(index).stamp, zeros(500, 800, 3, kind=np.uint8),
                              zeros(500, 800), camera)
            memory.track(Reference(
                dataclasses.replace(frame, frame=image, grey=grey, surface=surface),
                metres_apart(index).pose), START.matrix, NO_DETOUR, INTERVAL)
        assert len(memory.frames) == most
    assert all(kept.frame.colour is kept.grey for kept in memory.frames)


def test_a_largest_step_that_is_changed_is_that_of_the_next_frame(scripted):
    far = STEPS[0].matrix @ se3.exp([0.3, 0.4, 0.0, 0.0, 0.0, 0.0])
    memory, _, beyond = found_again(scripted, far, 1e-14 * np.eye(6), {
        'odometry.correction_step': 0.002, 'odometry.correction_turn': 0.1})
    memory.configure(with_values(Settings(), {
        'odometry.correction_step': 0.004, 'odometry.correction_turn': 0.1}), None)
    memory.track(Reference(prepared(1), START @ STEPS[0]), beyond.matrix, NO_DETOUR, INTERVAL)
    moved = memory.published(beyond).translation - beyond.translation
    assert np.linalg.norm(moved) == pytest.approx(0.002 + 0.004, rel=1e-6)


def test_all_that_was_found_again_is_counted(scripted):
    pose = PoseWithCovariance(np.eye(4), KNOWING_NOTHING)
    scripted(accepted=2 * (RelativePose(0, 1, pose),))
    memory, _ = memory_at(START, {'odometry.reuse_interval': 0.0})
    for index, count in ((1, 2), (2, 4), (3, 6)):
        for _ in range(2):
            memory.track(Reference(prepared(index), START), START.matrix, NO_DETOUR, INTERVAL)
        assert memory.reused == count
