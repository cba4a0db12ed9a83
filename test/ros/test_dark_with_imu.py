# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A node that is lost in the dark goes on in TF by an IMU, over DDS."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.ros.conversions import from_transform, to_stamp
from aick_ros.sources.synthetic.imu import IMU_MODELS, imu_samples

MS = 10 ** 6
BEFORE, AHEAD = 100 * MS, 10 * MS  # samples are there so long before and after an image [ns]
DARK = 18  # the first frame that is; half a second of motion has been seen by then


@pytest.fixture(scope='module')
def samples(source, all_frames):
    """Return the samples of an IMU at the camera."""
    first, last = all_frames[0].stamp, all_frames[-1].stamp
    return imu_samples(source.pose, first - BEFORE, last + 2 * AHEAD, IMU_MODELS['icm42688'],
                       np.random.default_rng(1))


@pytest.mark.parametrize('sigma, end', [(0.3, None), (0.0, DARK)], ids=['carried', 'switched off'])
def test_tf_goes_on_in_the_dark_until_the_position_is_uncertain(
        rig, start_node, source, all_frames, samples, darken, sigma, end):
    publisher, send_imu_until = rig.offer_imu(samples)
    rig.listen_to_tf()
    start_node(wait_imu_to_init='true', frame_id='camera_rgb_optical_frame',
               imu__dead_reckoning_sigma=sigma)
    rig.wait_until(publisher.get_subscription_count, 'the node to subscribe to the IMU')
    rig.send_camera_info(all_frames[0].camera)
    for index, frame in enumerate(all_frames):
        send_imu_until(frame.stamp + AHEAD)
        rig.send(frame if index < DARK else darken(frame))
        rig.answer(frame.stamp)
    stamps = [frame.stamp for frame in all_frames]
    assert [odom.pose.covariance[0] == 9999.0 for odom in rig.odom] == [
        index >= DARK for index in range(len(stamps))]
    rig.wait_until(lambda: len(rig.links) >= len(stamps[:end]), 'the transforms')
    assert [to_stamp(link.header.stamp) for link in rig.links] == stamps[:end]
    motion = se3.inverse(from_transform(rig.links[DARK - 1].transform)) @ from_transform(
        rig.links[-1].transform)
    true = se3.inverse(source.pose(stamps[DARK - 1])) @ source.pose(stamps[:end][-1])
    assert np.linalg.norm((motion - true)[:3, 3]) < 0.005
