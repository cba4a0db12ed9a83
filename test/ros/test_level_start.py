# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A node that waits for what is up publishes nothing before, and begins level, over DDS."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry import se3
from aick_ros.odometry import Odometry
from aick_ros.ros.conversions import from_pose, to_stamp
from aick_ros.sources.synthetic.imu import IMU_MODELS, imu_samples

MS = 10 ** 6
BEFORE, AHEAD = 100 * MS, 10 * MS  # samples are there so long before and after an image [ns]
PUSH = np.array([3.0, 0.0, 0.0])  # m/s^2, until the first image


@pytest.fixture(scope='module')
def samples(source, all_frames):
    """Return the samples of an IMU in the camera, which is pushed until the first image."""
    first, last = all_frames[0].stamp, all_frames[-1].stamp
    found = imu_samples(source.pose, first - BEFORE, last + 2 * AHEAD, IMU_MODELS['perfect'],
                        np.random.default_rng(1))
    is_pushed = (found.stamps <= first)[:, None]
    return dataclasses.replace(
        found, accelerations=found.accelerations + np.where(is_pushed, PUSH, 0.0))


def tilt(T_odom_camera, T_world_camera):
    """Return the angle between z of odom and what is up [deg]."""
    up = (T_odom_camera @ se3.inverse(T_world_camera))[2, 2]
    return np.degrees(np.arccos(np.clip(up, -1.0, 1.0)))


@pytest.mark.parametrize('sigma, wait, most', [(0.01, 10.0, 1.5), (1e-5, 0.35, 3.0)],
                         ids=['what is up is known', 'the wait has passed'])
def test_nothing_is_published_before_and_the_first_pose_is_level(
        rig, start_node, source, all_frames, samples, sigma, wait, most):
    publisher, send_imu_until = rig.offer_imu(samples)
    rig.listen_to_tf()
    start_node(wait_imu_to_init='true', wait_level_to_init='true', imu__level_sigma=sigma,
               imu__level_wait=wait, imu__accelerometer_bias_sigma=0.05)
    rig.wait_until(publisher.get_subscription_count, 'the node to subscribe to the IMU')
    rig.send_camera_info(all_frames[0].camera)
    for frame in all_frames:
        send_imu_until(frame.stamp + AHEAD)
        rig.send(frame)
    rig.answer(all_frames[-1].stamp)
    stamps = [frame.stamp for frame in all_frames]
    begun = stamps.index(rig.stamps()[0])
    assert rig.stamps() == stamps[begun:]
    if wait < 1.0:
        assert begun == next(index for index, stamp in enumerate(stamps)
                             if stamp - stamps[0] >= 1e9 * wait)
    assert begun > 5
    rig.wait_until(lambda: rig.links and rig.poses, 'the transform, and the pose')
    for first in (rig.links[0], rig.poses[0]):
        assert to_stamp(first.header.stamp) == stamps[begun]
    assert tilt(from_pose(rig.odom[0].pose.pose), source.pose(stamps[begun])) < most


def test_without_the_wait_the_push_would_tilt_it(source, all_frames, samples):
    """Of which the test above says nothing else."""
    first = samples.stamps <= all_frames[0].stamp
    frame = dataclasses.replace(all_frames[0], imu=ImuSamples(
        samples.stamps[first], samples.turn_rates[first], samples.accelerations[first]))
    update = Odometry().register_frame(frame)
    assert tilt(update.T_odom_camera, source.pose(frame.stamp)) > 10.0
