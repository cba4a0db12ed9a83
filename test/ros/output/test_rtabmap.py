# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What RTAB-Map receives, in a process of its own with messages built as the wheels' are."""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2

from aick_ros.geometry import se3
from aick_ros.messages.camera_info import to_camera
from aick_ros.messages.raw_image import decode_colour, decode_depth
from aick_ros.odometry import Odometry
from aick_ros.ros.conversions import from_pose, to_stamp

COUNT, DARK = 6, 4
EXTRINSIC = '[0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5]'

# Receives odom_info and prints what it says, a line of JSON each.
RECEIVER = '''
import json
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rtabmap_msgs.msg import OdomInfo

def numbers(t):
    return [t.translation.x, t.translation.y, t.translation.z,
            t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w]

def take(topic, m):
    print(json.dumps({
        'topic': topic, 'frame': m.header.frame_id, 'lost': m.lost, 'matches': m.matches,
        'stamp': m.header.stamp.sec * 10 ** 9 + m.header.stamp.nanosec,
        'inliers': m.inliers, 'features': m.features, 'interval': m.interval,
        'distance': m.distance_travelled, 'covariance': list(m.covariance),
        'new': [(p.x, p.y) for p in m.new_corners], 'corner_inliers': list(m.corner_inliers),
        'reference': len(m.ref_corners), 'transform': numbers(m.transform),
        'guess': numbers(m.guess)}), flush=True)

rclpy.init()
node = rclpy.create_node('receiver')
for topic in ('odom_info', 'odom_info_lite'):
    node.create_subscription(OdomInfo, topic, lambda m, topic=topic: take(topic, m), 100)
# the last of the subscriptions: with its first message the odometry node knows all of them
node.create_subscription(DiagnosticArray, '/diagnostics', lambda m: print(
    json.dumps({'topic': 'diagnostics'}), flush=True), 100)
rclpy.spin(node)
'''


@pytest.fixture(scope='module')
def frames(all_frames, darken):
    frames = list(all_frames[:COUNT])
    frames[DARK] = darken(frames[DARK])
    return frames


@pytest.fixture
def receiver(rtabmap_msgs, rig, tmp_path):
    """Start RTAB-Map's side; the node that is started after it finds the messages, too."""
    log = tmp_path / 'received'
    with log.open('w') as output:
        process = subprocess.Popen([sys.executable, '-c', RECEIVER], stdout=output)

    def received(topic):
        lines = log.read_text().splitlines(keepends=True)
        infos = [json.loads(line) for line in lines if line.endswith('\n')]
        return [info for info in infos if info['topic'] == topic]

    yield received
    process.kill()
    process.wait()


def play(rig, receiver, frames):
    """Play frames to a node that has found the receiver."""
    rig.wait_until(lambda: receiver('diagnostics'), 'the receiver to hear of the node')
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        rig.send(frame)
        rig.answer(frame.stamp)


def test_odom_info_of_each_frame(rig, receiver, start_node, frames):
    start_node(camera_in_base=EXTRINSIC, frame_id='base_link')
    play(rig, receiver, frames)
    stamps = [frame.stamp for frame in frames]
    rig.wait_until(lambda: stamps[-1] in [info['stamp'] for info in receiver('odom_info')],
                   lambda: f'the last odom_info, of {receiver("odom_info")}')
    infos = {info['stamp']: info for info in receiver('odom_info')}
    odometry = Odometry()
    for frame in frames:
        update, info = odometry.register_frame(frame), infos[frame.stamp]
        assert info['frame'] == 'odom'
        assert info['lost'] == (frame is frames[DARK])
        assert info['features'] == len(update.keypoints.pixels)
        assert info['matches'] == len(update.matches) == len(info['new']) == info['reference']
        assert info['inliers'] == update.support
        assert info['corner_inliers'] == list(range(len(update.matches)))
        np.testing.assert_allclose(
            np.reshape(info['new'], (-1, 2)),
            update.keypoints.pixels[update.matches[:, 0]], rtol=1e-6)
        assert info['guess'] == [0.0] * 7


def test_its_motion_is_that_of_the_odometry(rig, receiver, start_node, frames):
    start_node(camera_in_base=EXTRINSIC, frame_id='base_link',
               **{'odometry.motion_prior': False})
    play(rig, receiver, frames[:DARK])
    rig.wait_until(lambda: len(receiver('odom_info')) == DARK, 'odom_info of each frame')
    poses = [from_pose(rig.answer(frame.stamp).pose.pose) for frame in frames[:DARK]]
    infos = receiver('odom_info')
    assert infos[0]['transform'] == [0.0] * 7  # the null transform of RTAB-Map
    assert np.diag(np.reshape(infos[0]['covariance'], (6, 6))).tolist() == [9999.0] * 6
    travelled = 0.0
    for before, now, info in zip(poses, poses[1:], infos[1:]):
        T_before_now = se3.inverse(before) @ now
        np.testing.assert_allclose(info['transform'][:3], T_before_now[:3, 3], atol=1e-6)
        travelled += np.linalg.norm(T_before_now[:3, 3])
        assert info['distance'] == pytest.approx(travelled, abs=1e-5)
        assert info['interval'] == pytest.approx(1 / 30, abs=1e-3)
        assert 0.0 < np.linalg.eigvalsh(np.reshape(info['covariance'], (6, 6)))[0]
        assert info['covariance'][0] < 1.0


def test_the_lite_one_has_no_lists(rig, receiver, start_node, frames):
    start_node()
    play(rig, receiver, frames[:2])
    rig.wait_until(lambda: len(receiver('odom_info_lite')) == 2, 'odom_info_lite')
    info = receiver('odom_info_lite')[1]
    assert info['matches'] > 0
    assert (info['new'], info['reference'], info['corner_inliers']) == ([], 0, [])


def test_without_the_messages_one_sentence_says_so(rig, receiver, start_node, frames):
    """The receiver has them, the node has not."""
    rig.wait_until(lambda: rig.node.count_subscribers('odom_info'), 'the receiver')
    blocked = (sys.executable, '-c', 'import sys; sys.modules["rtabmap_msgs"] = None; '
               'from aick_ros.ros import odom_node; odom_node.main()')
    node = start_node(command=blocked)
    rig.send_camera_info(frames[0].camera)
    rig.send(frames[0])
    node.wait_for_log('somebody subscribes to /odom_info, but rtabmap_msgs is not installed')


def positions(cloud):
    return np.frombuffer(cloud.data, np.float32).reshape(cloud.width, 3)


def test_the_registered_frame_is_published(rtabmap_msgs, rig, start_node, frames):
    """Also that of a lost camera: whoever pairs it with odom receives both."""
    from rtabmap_msgs.msg import RGBDImage
    images = []
    rig.listen(RGBDImage, 'odom_rgbd_image', images.append)
    start_node()
    rig.send_camera_info(frames[0].camera)
    rig.wait_until(lambda: rig.diagnostics, 'the node')
    shown = [frames[0], dataclasses.replace(frames[DARK], depth_stamp=frames[DARK].stamp + 5)]
    for frame in shown:
        rig.send(frame)
        rig.answer(frame.stamp)
    rig.wait_until(lambda: len(images) == 2, 'the images')
    for frame, message in zip(shown, images):
        depth_stamp = frame.stamp if frame.depth_stamp is None else frame.depth_stamp
        assert [to_stamp(part.header.stamp) for part in (message, message.rgb, message.depth)] == [
            frame.stamp, frame.stamp, depth_stamp]
        assert message.header.frame_id == message.depth.header.frame_id == (
            'camera_rgb_optical_frame')
        assert to_camera(message.rgb_camera_info) == frame.camera
        assert to_camera(message.depth_camera_info, rectified=True) == frame.camera
        np.testing.assert_array_equal(decode_colour(message.rgb), frame.colour)
        np.testing.assert_array_equal(decode_depth(message.depth), frame.depth)


def test_the_clouds_are_in_the_odometry_frame(rig, start_node, frames):
    """Of frame to frame odometry the local map is the last frame."""
    clouds, keypoints, maps = [], [], []
    rig.listen(PointCloud2, 'odom_last_frame', clouds.append)
    rig.listen(PointCloud2, 'keypoints', keypoints.append)
    rig.listen(PointCloud2, 'odom_local_map', maps.append)
    start_node(odometry__reference='previous')
    rig.send_camera_info(frames[0].camera)
    rig.send(frames[0])
    rig.send(frames[1])
    rig.wait_until(lambda: len(clouds) == len(keypoints) == len(maps) == 2, 'the clouds')
    for cloud, same, local_map in zip(clouds, keypoints, maps):
        assert local_map.header == cloud.header
        np.testing.assert_allclose(positions(local_map), positions(cloud), atol=1e-5)
        assert cloud.header.frame_id == 'odom'
        assert cloud.width > 100
        assert (cloud.header, cloud.data) == (same.header, same.data)
