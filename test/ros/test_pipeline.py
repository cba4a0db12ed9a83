# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The way of a frame through the node, and requests between frames, without DDS."""

import threading
import time
from collections import defaultdict
from types import SimpleNamespace

import numpy as np
import pytest
from rclpy.logging import LoggingSeverity
from std_srvs.srv import Empty

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.messages.synchronizer import Pair
from aick_ros.odometry import Odometry, OdometryUpdate
from aick_ros.registration.status import Status
from aick_ros.ros.conversions import from_pose, header, to_stamp, to_time
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import values_of
from aick_ros.ros.pipeline import Pipeline
from aick_ros.settings import NodeSettings, Settings
from aick_ros.settings.parameter import with_values

STAMP = 1_700_000_000_000_000_000
MS = 1_000_000
PATIENCE = 120.0  # seconds that nothing takes, even on a loaded machine


class Logger:
    """Keeps its level and what it is told."""

    def __init__(self):
        self.lines, self.level = [], None

    def set_level(self, level):
        self.level = level

    def info(self, text, **_):
        self.lines.append(text)

    warning = error = info


class Node:
    """Keeps what is made on it; nobody else is there."""

    def __init__(self):
        self.published, self.services, self.now = defaultdict(list), {}, STAMP
        self.logger, self.context = Logger(), SimpleNamespace(ok=lambda: True)

    def get_logger(self):
        return self.logger

    def get_fully_qualified_name(self):
        return '/odom_node'

    def get_clock(self):
        return SimpleNamespace(now=lambda: SimpleNamespace(
            nanoseconds=self.now, to_msg=lambda: to_time(self.now)))

    def resolve_topic_name(self, name):
        return f'/{name}'

    def create_publisher(self, kind, topic, qos):
        return SimpleNamespace(publish=self.published[topic].append,
                               get_subscription_count=lambda: 0)

    def create_subscription(self, kind, topic, callback, qos, **_):
        return SimpleNamespace(topic_name=topic, qos_profile=qos)

    def destroy_subscription(self, subscription):
        pass

    def create_service(self, kind, name, callback):
        self.services[name] = callback


class Seen:
    """An odometry that sees the camera at poses which the test sets."""

    def __init__(self):
        self.pose, self.status = np.eye(4), Status.OK
        self.misalignment = SimpleNamespace(values=np.zeros(8), description='')

    def prepare(self, frame):
        return SimpleNamespace(frame=frame)

    def register(self, preparation, predict=None, T_base_camera=None):
        self.T_base_camera = T_base_camera
        prepared = SimpleNamespace(frame=preparation.frame, keypoints=(), repeat=None)
        return OdometryUpdate(preparation.frame.stamp, self.status, '',
                              PoseWithCovariance(self.pose), prepared)

    def reset(self):
        self.pose = np.eye(4)

    def change_settings(self, settings):
        self.settings = settings


def message(stamp):
    return SimpleNamespace(header=header(stamp, 'optical'), data=b'')


class Rig:
    """A pipeline whose jobs the test does."""

    def __init__(self, monkeypatch, cores=1, **settings):
        monkeypatch.setattr('aick_ros.ros.pipeline.warm_up', lambda core: None)
        monkeypatch.setattr('os.sched_getaffinity', lambda process: set(range(cores)))
        self.node = Node()
        self.pipeline = Pipeline(self.node, NodeSettings(
            camera_in_base=(0.0,) * 6 + (1.0,), publish_tf=False, **settings), Settings())
        self.camera = self.pipeline._odometry = Seen()
        monkeypatch.setattr(self.pipeline._assembler, 'frame', lambda arrival: SimpleNamespace(
            stamp=arrival.pair.colour_stamp))
        monkeypatch.setattr(self.pipeline._views, 'show', lambda *_: None)
        monkeypatch.setattr(self.pipeline._rtabmap, 'show', lambda *_: None)

    def work(self):
        """Do what waits."""
        queue = self.pipeline._queue
        while queue.backlog or queue._tasks:
            queue.take(self.pipeline._prepare_and_answer, lambda arrival: True)()

    def see(self, *stamps):
        for stamp in stamps:
            self.pipeline._enqueue(Pair(stamp, message(stamp), stamp, message(stamp)))
            self.work()

    def call(self, name):
        self.node.services[f'~/{name}'](Empty.Request(), Empty.Response())
        self.work()

    @property
    def poses(self):
        return [from_pose(message.pose.pose) for message in self.node.published['odom']]

    @property
    def snapshot(self):
        return self.pipeline._diagnostics.snapshot()


@pytest.fixture
def make(monkeypatch):
    return lambda **settings: Rig(monkeypatch, **settings)


def test_the_age_of_an_answer_is_that_of_its_image(make):
    made = make()
    made.node.now = STAMP + 50 * MS
    made.see(STAMP)
    assert values_of(made.snapshot)['delay since the stamp [ms]'] == '50.0'
    assert made.snapshot.delays[0] < 10_000.0


def test_the_odometry_knows_where_the_camera_sits(make):
    made = make()
    made.see(STAMP)
    assert np.array_equal(made.camera.T_base_camera, np.eye(4))


@pytest.mark.parametrize('level, severity', [
    ('debug', LoggingSeverity.DEBUG), ('info', LoggingSeverity.INFO),
    ('warning', LoggingSeverity.WARN), ('error', LoggingSeverity.ERROR)])
def test_each_service_of_the_log_sets_its_level(make, level, severity):
    made = make()
    made.call(f'log_{level}')
    assert made.node.logger.level == severity


def test_a_reset_forgets_the_way_on_every_topic(make, monkeypatch):
    made, forgotten = make(), []
    for part in ('_views', '_rtabmap', '_start'):
        monkeypatch.setattr(getattr(made.pipeline, part), 'reset',
                            lambda part=part: forgotten.append(part))
    made.camera.pose = se3.exp([1, 0, 0, 0, 0, 0])
    made.see(STAMP, STAMP + 33 * MS)
    made.call('reset_odom')
    made.see(STAMP + 66 * MS)
    assert sorted(forgotten) == ['_rtabmap', '_start', '_views']
    np.testing.assert_allclose(made.poses[-1], np.eye(4))


def test_after_a_reset_to_a_pose_the_guess_is_not_waited_for(make):
    made = make(guess_frame_id='wheels', wait_for_transform=0.0)
    made.see(STAMP)
    assert not made.node.published['odom']  # the guess is not known yet
    T_odom_base = se3.exp([1, 2, 3, 0.1, 0.2, 0.3])
    made.pipeline._reset(PoseWithCovariance(T_odom_base))
    made.see(STAMP + 33 * MS)
    np.testing.assert_allclose(made.poses[-1], T_odom_base, atol=1e-9)


def test_a_pose_that_was_set_is_where_it_goes_on_and_no_guess_is_waited_for(make):
    made = make(guess_frame_id='wheels', wait_for_transform=0.0)
    T_odom_base = se3.exp([1, 2, 3, 0.1, 0.2, 0.3])
    made.pipeline._set_pose(PoseWithCovariance(T_odom_base), False)
    made.see(STAMP)
    np.testing.assert_allclose(made.poses[-1], T_odom_base, atol=1e-9)


def test_what_is_skipped_damaged_or_failed_is_counted_as_such(make, monkeypatch):
    made = make(max_update_rate=10.0)
    made.see(*(STAMP + i * 50 * MS for i in range(6)))
    made.call('pause_odom')
    made.see(STAMP + 1000 * MS)
    made.call('resume_odom')

    def broken(error):
        def raises(arrival):
            raise error
        monkeypatch.setattr(made.pipeline._assembler, 'frame', raises)
    broken(InputError('it is damaged'))
    made.see(STAMP + 2000 * MS)
    broken(ZeroDivisionError())
    made.see(STAMP + 3000 * MS, STAMP + 4000 * MS)
    totals = made.snapshot.totals
    assert {count: totals[count] for count in (
        Count.ANSWERED, Count.SKIPPED_BY_RATE_LIMIT, Count.SKIPPED_WHILE_PAUSED, Count.DAMAGED,
        Count.FAILED)} == {Count.ANSWERED: 3, Count.SKIPPED_BY_RATE_LIMIT: 3,
                           Count.SKIPPED_WHILE_PAUSED: 1, Count.DAMAGED: 1, Count.FAILED: 2}


@pytest.fixture(scope='module')
def frames():
    """Return frames of a chequered slope that moves past the camera, by their stamps."""
    rng, camera = np.random.default_rng(1), Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    pattern = np.kron(rng.integers(0, 256, (24, 40), np.uint8), np.ones((10, 10), np.uint8))
    depth = np.broadcast_to(np.linspace(1.0, 1.2, 320, dtype=np.float32), (240, 320))
    return {STAMP + i * 33 * MS: RgbdFrame(
        STAMP + i * 33 * MS, np.ascontiguousarray(pattern[:, 2 * i:320 + 2 * i]),
        depth + np.float32(1e-3 * i), camera) for i in range(8)}


def test_frames_prepared_on_another_thread_are_answered_alike(make, monkeypatch, frames):
    paths = []
    for cores in (1, 2):
        made = make(cores=cores, process_every_frame=True)
        made.pipeline._odometry = Odometry()
        monkeypatch.setattr(made.pipeline._assembler, 'missing_for', lambda pair: '')
        monkeypatch.setattr(made.pipeline._assembler, 'frame',
                            lambda arrival: frames[arrival.pair.colour_stamp])
        made.pipeline.start()
        threads = {thread.name for thread in threading.enumerate()}
        for stamp in frames:
            made.pipeline._enqueue(Pair(stamp, message(stamp), stamp, message(stamp)))
        deadline = time.monotonic() + PATIENCE
        while len(made.node.published['odom']) < len(frames) and time.monotonic() < deadline:
            time.sleep(0.005)
        made.pipeline.close()
        assert ('preparation' in threads) is (cores == 2)
        assert [to_stamp(message.header.stamp)
                for message in made.node.published['odom']] == list(frames)
        paths.append([(from_pose(message.pose.pose), message.pose.covariance)
                      for message in made.node.published['odom']])
        assert made.snapshot.totals[Count.LOST] == 0
    for (pose, covariance), (other, other_covariance) in zip(*paths, strict=True):
        np.testing.assert_array_equal(pose, other)
        np.testing.assert_array_equal(covariance, other_covariance)


def overload(made, monkeypatch, seconds):
    """Let seconds pass in which a third of the frames is dropped and the worker never waits."""
    worker = SimpleNamespace(dropped=0, busy=(0.0,), put_task=lambda task: task())
    monkeypatch.setattr(made.pipeline, '_worker', worker)
    for second in range(seconds + 1):
        monkeypatch.setattr('aick_ros.ros.pipeline.time', SimpleNamespace(
            monotonic=lambda: 1e3 + second))
        made.pipeline._shed_load()
        made.pipeline._arrived += 30
        worker.dropped, worker.busy = worker.dropped + 10, (worker.busy[0] + 1.0,)


def test_under_load_less_is_computed_and_settings_can_change_all_the_same(make, monkeypatch):
    made = make()
    overload(made, monkeypatch, 2)
    assert made.camera.settings.features.max_keypoints == 200
    assert 'half of the keypoints are dropped' in made.node.logger.lines[-1]
    made.pipeline.change_settings(with_values(Settings(), {'features.max_keypoints': 300}))
    assert made.camera.settings.features.max_keypoints == 150


def test_under_a_load_that_stays_every_second_frame_is_skipped(make, monkeypatch):
    made = make()
    overload(made, monkeypatch, 6)
    for i in range(6):
        stamp = STAMP + i * 33 * MS
        made.pipeline._enqueue(Pair(stamp, message(stamp), stamp, message(stamp)))
    assert made.snapshot.totals[Count.SKIPPED_TO_SHED_LOAD] == 3


@pytest.mark.parametrize('settings', [{'shed_load': False}, {'process_every_frame': True}])
def test_where_it_is_not_wanted_everything_is_computed_under_load_too(make, monkeypatch, settings):
    made = make(**settings)
    overload(made, monkeypatch, 6)
    assert not hasattr(made.camera, 'settings')
