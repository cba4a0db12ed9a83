# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Bags played to the node in its own process: every frame answered, as offline, near the truth."""

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.ros.playback.live_run import run_live
from aick_ros.ros.playback.pace import RealTime
from aick_ros.sources import open_source, raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers import bag_writer

OPTICAL = 'camera_rgb_optical_frame'
TOPICS = {'rgb/image': bag_writer.COLOUR_TOPIC, 'depth/image': bag_writer.DEPTH_TOPIC,
          'rgb/camera_info': bag_writer.INFO_TOPIC}
EVERY_FRAME = {'process_every_frame': True, 'frame_id': OPTICAL, 'topic_queue_size': 100,
               'qos_reliability': 'reliable'}


def assert_as_offline(run, bag):
    odometry = Odometry()
    expected = {frame.stamp: odometry.register_frame(frame).T_odom_camera
                for frame in open_source(bag).frames(raise_damage)}
    assert [answer.stamp for answer in run.answers] == list(expected)
    for answer in run.answers:
        np.testing.assert_allclose(answer.T_odom_base, expected[answer.stamp], atol=1e-6)


def errors_of(run, bag):
    estimate = Trajectory(np.array([answer.stamp for answer in run.answers]),
                          np.array([answer.T_odom_base for answer in run.answers]))
    return compare(estimate, open_source(bag).ground_truth)


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


@pytest.fixture(scope='module')
def rendered_bag(tmp_path_factory):
    bag = tmp_path_factory.mktemp('rendered') / 'bag'
    bag_writer.write_bag(bag, SyntheticSource(SyntheticOptions(seed=0, frames=75)))
    return bag


def test_rendered_sequence(ros_domain, rendered_bag):
    run = run_live(rendered_bag, TOPICS, EVERY_FRAME, RealTime())
    assert len(run.published_at) == len(run.delays) == 75
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
def test_real_sequence(ros_domain, tum_folder, tmp_path, name, ate, rpe, turn):
    """Stamps of colour and depth differ here, and a few images have no partner."""
    bag = tmp_path / 'bag'
    bag_writer.write_bag(bag, open_source(tum_folder(name)))
    # at half the rate the backlog stays within its limit on a loaded machine too
    run = run_live(bag, TOPICS, EVERY_FRAME, RealTime(0.5))
    assert_as_offline(run, bag)
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
    assert 2 <= len(stamps) < 75
    assert stamps == sorted(set(stamps))
    assert stamps[-1] == max(run.published_at)


def test_a_topic_that_the_bag_lacks_is_named(ros_domain, rendered_bag):
    with pytest.raises(InputError, match='no topic /nowhere'):
        run_live(rendered_bag, {**TOPICS, 'rgb/image': '/nowhere'}, EVERY_FRAME, RealTime())


def test_a_node_that_does_not_start_is_reported(ros_domain, rendered_bag):
    with pytest.raises(InputError, match='ended at once with exit code 2'):
        run_live(rendered_bag, TOPICS, {**EVERY_FRAME, 'aick.alpha': 7.0}, RealTime())
