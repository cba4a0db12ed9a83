# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Launch files in the style of rtabmap_ros's, with package and executable of the odometry changed.

What they start as odometry is started and fed; odom and odom_info come back for each frame. The
package index has no launch: a stand-in reads the files, and hands their parameters over in a
file, typed as YAML, as launch_ros does.
"""

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
import yaml
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image

from aick_ros.ros.conversions import header, to_stamp
from aick_ros.ros.playback.node_process import NODE_COMMAND
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

FOLDER = Path(__file__).parent / 'launch_files'
OPTICAL = 'camera_rgb_optical_frame'
OURS = {"package='rtabmap_odom'": "package='aick_ros'",
        "executable='rgbd_odometry'": "executable='odom_node'"}


class LaunchConfiguration(str):
    """The name of a launch argument, in place of its value."""


def launched(monkeypatch, tmp_path, name):
    """Return the nodes of a launch file, after the two names of the odometry were changed."""
    def node(**fields):
        return SimpleNamespace(**{'name': fields['executable'], 'namespace': '', 'arguments': [],
                                  **fields})

    arguments = {}
    for module, contents in {
            'launch': {'LaunchDescription': list}, 'launch_ros': {},
            'launch_ros.actions': {'Node': node},
            'launch.actions': {'DeclareLaunchArgument': lambda name, default_value:
                               arguments.update({name: default_value})},
            'launch.substitutions': {'LaunchConfiguration': LaunchConfiguration}}.items():
        monkeypatch.setitem(sys.modules, module, ModuleType(module))
        vars(sys.modules[module]).update(contents)
    text = (FOLDER / name).read_text()
    for theirs, ours in OURS.items():
        assert theirs in text
        text = text.replace(theirs, ours)
    changed = tmp_path / name
    changed.write_text(text)
    nodes = [action for action in runpy.run_path(str(changed))['generate_launch_description']()
             if action]

    def value(given):
        return arguments[given] if isinstance(given, LaunchConfiguration) else given

    def typed(given):
        return yaml.safe_load(value(given)) if value(given) is not given else given

    for each in nodes:
        each.parameters = {name: typed(given) for group in each.parameters
                           for name, given in group.items()}
        each.remappings = [f'{name}:={value(topic)}' for name, topic in each.remappings]
        each.arguments = list(map(value, each.arguments))
    return nodes


@pytest.fixture
def odometry(monkeypatch, tmp_path, start_node):
    """Start the odometry of a launch file, and return its process."""
    def start(name):
        [node] = [node for node in launched(monkeypatch, tmp_path, name)
                  if (node.package, node.executable) == ('aick_ros', 'odom_node')]
        file = tmp_path / 'parameters.yaml'
        file.write_text(yaml.safe_dump({'/**': {'ros__parameters': node.parameters}}))
        return start_node(
            wait=False, bare=True, command=[
                *NODE_COMMAND, *node.arguments, '--ros-args', '--params-file', str(file), '--'],
            remappings=[*node.remappings, f'__node:={node.name}', f'__ns:=/{node.namespace}'])
    return start


@pytest.fixture(scope='module')
def frames():
    source = SyntheticSource(SyntheticOptions(seed=5, frames=3))
    return [source.frame(i) for i in range(3)]


def publish_the_mount(rig):
    """Publish on /tf_static where the camera sits, as its driver does."""
    from tf2_msgs.msg import TFMessage
    link = TransformStamped(header=header(0, 'camera_link'), child_frame_id=OPTICAL)
    link.transform.rotation.x = link.transform.rotation.z = -0.5
    link.transform.rotation.y = link.transform.rotation.w = 0.5
    publisher = rig.node.create_publisher(TFMessage, '/tf_static', QoSProfile(
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    publisher.publish(TFMessage(transforms=[link]))


def parts(rig, frame):
    """Return colour, depth and calibration of a frame."""
    info = rig.camera_info_message(frame.camera)
    info.header = header(frame.stamp, OPTICAL)
    return (rig.image_message(frame.stamp, 'rgb8', frame.colour),
            rig.image_message(frame.stamp, '32FC1', frame.depth), info)


def separate(rig):
    """Return the publishers of a camera with separate topics, and how it sends a frame."""
    publishers = [rig.node.create_publisher(kind, f'/camera/{topic}', 10) for kind, topic in (
        (Image, 'color/image_raw'), (Image, 'aligned_depth_to_color/image_raw'),
        (CameraInfo, 'color/camera_info'))]

    def send(frame):
        for publisher, message in zip(publishers, parts(rig, frame)):
            publisher.publish(message)
    return publishers, send


def synchronised(rig):
    """Return the publisher of a node like rgbd_sync, and how it sends a frame."""
    from rtabmap_msgs.msg import RGBDImage
    publisher = rig.node.create_publisher(RGBDImage, '/camera/rgbd_image', 10)

    def send(frame):
        colour, depth, info = parts(rig, frame)
        publisher.publish(RGBDImage(header=colour.header, rgb=colour, depth=depth,
                                    rgb_camera_info=info, depth_camera_info=info))
    return [publisher], send


@pytest.mark.parametrize('name, namespace, camera, said', [
    ('images_and_imu.launch.py', '', separate, [
        "'wait_imu_to_init' of rgbd_odometry changes nothing here: an IMU is not used"]),
    ('rgbd_image.launch.py', '/rtabmap', synchronised, [
        "'Odom/ResetCountdown' of rgbd_odometry changes nothing here: a lost odometry needs no",
        "'Vis/MinInliers' of rgbd_odometry changes nothing here",
        "'queue_size' is read as sync_queue_size = 10",
        "'publish_null_when_lost' is read as lost_policy = 'null'"]),
    ('two_cameras.launch.py', '', synchronised, [
        'rgbd_cameras = 2: only the first camera is used, on rgbd_image0',
        "'Reg/Force3DoF' of rgbd_odometry changes nothing here: z, roll and pitch"])])
def test_a_launch_file_needs_two_names_changed(rtabmap_msgs, rig, odometry, frames, name,
                                               namespace, camera, said):
    """Odometry and odom_info, for which SLAM and viewer wait, come for each frame."""
    pytest.importorskip('tf2_msgs', reason='tf2_msgs is not installed')
    from rtabmap_msgs.msg import OdomInfo
    answers, infos = [], []
    rig.listen(OdomInfo, f'{namespace}/odom_info', infos.append)
    rig.listen(Odometry, f'{namespace}/odom', answers.append)
    publish_the_mount(rig)
    publishers, send = camera(rig)
    node = odometry(name)
    rig.wait_until(lambda: all(any(
        endpoint.qos_profile.reliability == ReliabilityPolicy.RELIABLE for endpoint in
        rig.node.get_subscriptions_info_by_topic(publisher.topic_name))
        for publisher in publishers), lambda: f'the node to subscribe: {node.log}')
    rig.wait_until(lambda: rig.diagnostics, 'the node to publish')
    for frame in frames:
        send(frame)
        for received in (answers, infos):
            rig.wait_until(
                lambda: frame.stamp in [to_stamp(message.header.stamp) for message in received],
                lambda: f'the answer to a frame: {node.log}')
    assert [message.child_frame_id for message in answers] == 3 * ['camera_link']
    assert [message.lost for message in infos] == 3 * [False]
    for sentence in said:
        assert sentence in node.log
