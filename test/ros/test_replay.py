# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Bags played to the node in its own process: every frame answered, as offline, near the truth."""

import dataclasses
from contextlib import contextmanager

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.ros.playback import live_run
from aick_ros.ros.playback.listener import listening, wait_until
from aick_ros.ros.playback.live_run import run_live
from aick_ros.ros.playback.pace import RealTime
from aick_ros.sources import open_source, raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers import bag_writer

COUNT = 45  # frames
AHEAD = 15  # frames; the node lets far more wait
PATIENCE = 120.0  # seconds that nothing takes, even on a loaded machine
OPTICAL = 'camera_rgb_optical_frame'
TOPICS = {'rgb/image': bag_writer.COLOUR_TOPIC, 'depth/image': bag_writer.DEPTH_TOPIC,
          'rgb/camera_info': bag_writer.INFO_TOPIC}
EVERY_FRAME = {'process_every_frame': True, 'frame_id': OPTICAL, 'topic_queue_size': 100,
               'qos_reliability': 'reliable'}


class InStep:
    """
    A pace that stays a few frames ahead of the answers, however slow the machine is.

    :param listeners: filled with the listener to the answers once there is one.
    """

    def __init__(self, listeners):
        self._listeners, self._played = listeners, 0

    def run(self, bag):
        return run_live(bag, TOPICS, EVERY_FRAME, self._wait, on_progress=self._count)

    def _count(self, played):
        self._played = played

    def _wait(self, stamp):
        assert wait_until(lambda: self._played - len(self._listeners[0].answers) < AHEAD, PATIENCE)


@pytest.fixture
def in_step(monkeypatch):
    listeners = []

    @contextmanager
    def known():
        with listening() as listener:
            listeners.append(listener)
            yield listener

    monkeypatch.setattr(live_run, 'listening', known)
    return InStep(listeners)


def assert_as_offline(run, bag, count=None):
    """Assert that all frames are answered, the first ``count`` as offline."""
    # the topic of the accelerometer is not played
    frames = [dataclasses.replace(frame, imu=None)
              for frame in open_source(bag).frames(raise_damage)]
    assert [answer.stamp for answer in run.answers] == [frame.stamp for frame in frames]
    odometry = Odometry()
    for answer, frame in zip(run.answers, frames[:count]):
        np.testing.assert_allclose(
            answer.T_odom_base, odometry.register_frame(frame).T_odom_camera, atol=1e-6)


def errors_of(run, bag):
    estimate = Trajectory(np.array([answer.stamp for answer in run.answers]),
                          np.array([answer.T_odom_base for answer in run.answers]))
    return compare(estimate, open_source(bag).ground_truth)


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


@pytest.fixture(scope='module')
def rendered_bag(tmp_path_factory):
    bag = tmp_path_factory.mktemp('rendered') / 'bag'
    bag_writer.write_bag(bag, SyntheticSource(SyntheticOptions(seed=5, frames=COUNT)))
    return bag


def test_rendered_sequence(ros_domain, rendered_bag, in_step):
    run = in_step.run(rendered_bag)
    assert len(run.published_at) == len(run.delays) == COUNT
    assert all(answer.tracked for answer in run.answers)
    assert_as_offline(run, rendered_bag)
    errors = errors_of(run, rendered_bag)
    translations, rotations = errors.relative(1.0)
    assert rms(errors.positions()) < 0.02
    assert rms(translations) < 0.03
    assert rms(np.degrees(rotations)) < 1.0


@pytest.mark.parametrize('name, ate, rpe, turn', [
    # twice what the offline odometry has there
    ('freiburg1_xyz_150', 0.05, 0.06, 4.0), ('freiburg1_rpy_100', 0.07, 0.11, 6.0)])
def test_real_sequence(ros_domain, tum_folder, tmp_path, in_step, name, ate, rpe, turn):
    """Stamps of colour and depth differ here, and a few images have no partner."""
    bag = tmp_path / 'bag'
    bag_writer.write_bag(bag, open_source(tum_folder(name)))
    run = in_step.run(bag)
    assert_as_offline(run, bag, 40)
    assert all(answer.tracked for answer in run.answers)
    errors = errors_of(run, bag)
    translations, rotations = errors.relative(1.0)
    assert rms(errors.positions()) < ate
    assert rms(translations) < rpe
    assert rms(np.degrees(rotations)) < turn


def test_in_a_hurry_the_newest_frames_are_answered(ros_domain, rendered_bag):
    """Played ten times as fast as it can work, the node leaves frames out and keeps up."""
    newest = {**EVERY_FRAME, 'process_every_frame': False, 'preset': 'paper-full'}
    run = run_live(rendered_bag, TOPICS, newest, RealTime(10.0))
    stamps = [answer.stamp for answer in run.answers]
    assert 2 <= len(stamps) < COUNT
    assert stamps == sorted(set(stamps))
    assert stamps[-1] == max(run.published_at)


def test_a_topic_that_the_bag_lacks_is_named(ros_domain, rendered_bag):
    with pytest.raises(InputError, match='no topic /nowhere'):
        run_live(rendered_bag, {**TOPICS, 'rgb/image': '/nowhere'}, EVERY_FRAME, RealTime())


def test_a_node_that_does_not_start_is_reported(ros_domain, rendered_bag):
    with pytest.raises(InputError, match='ended at once with exit code 2'):
        run_live(rendered_bag, TOPICS, {**EVERY_FRAME, 'aick.alpha': 7.0}, RealTime())
