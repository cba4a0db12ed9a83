# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The messages of rgbd_image: taken apart here, and over DDS to the node in its process."""

import subprocess
import sys

import cv2
import numpy as np
import pytest
from rclpy.qos import ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.odometry import Odometry
from aick_ros.ros.conversions import from_pose, to_time
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.input import rgbd_images
from aick_ros.ros.input.assembler import FrameAssembler
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.ros.input.pairing import Pairing
from aick_ros.settings.node import NodeSettings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

IDENTITY = (0.0,) * 6 + (1.0,)
STAMP, DEPTH_STAMP = 10 ** 18, 10 ** 18 + 4_000_000
RAW = Camera(8, 6, 10.0, 10.0, 3.5, 2.5, 'plumb_bob', (0.1, 0.0, 0.0, 0.0, 0.0))
RECTIFIED = Camera(8, 6, 9.0, 9.0, 3.0, 2.0)
COLOUR = np.arange(8 * 6 * 3, dtype=np.uint8).reshape(6, 8, 3)
DEPTH = np.linspace(1.0, 2.0, 8 * 6, dtype=np.float32).reshape(6, 8)


def header(stamp, frame_id='colour'):
    return Header(stamp=to_time(stamp), frame_id=frame_id)


def image(stamp, encoding, pixels):
    return Image(header=header(stamp), height=6, width=8, encoding=encoding,
                 step=pixels.strides[0], data=pixels.tobytes())


def info(camera=RAW):
    return CameraInfo(
        width=camera.width, height=camera.height, k=camera.matrix.ravel(), d=camera.distortion,
        distortion_model=camera.distortion_model,
        p=np.hstack([RECTIFIED.matrix, np.zeros((3, 1))]).ravel())


def message(**parts):
    """An RGBDImage with raw images, or with the given parts in their place."""
    return rgbd_images.RGBDImage(**{
        'header': header(DEPTH_STAMP), 'rgb_camera_info': info(), 'depth_camera_info': info(),
        'rgb': image(STAMP, 'rgb8', COLOUR), 'depth': image(DEPTH_STAMP, '32FC1', DEPTH),
        'rgb_compressed': CompressedImage(), 'depth_compressed': CompressedImage(), **parts})


def message_of_many(*images):
    """An RGBDImages."""
    return rgbd_images.RGBDImages(header=header(STAMP), rgbd_images=images)


class Input:
    """The input of a node that subscribes to rgbd_image; pairs and report are attributes."""

    def __init__(self, node, **settings):
        settings = NodeSettings(subscribe_rgbd=True, camera_in_base=IDENTITY,
                                depth_in_colour=IDENTITY, **settings)
        self.pairs, self.report = [], Diagnostics(node)
        self.assembler = FrameAssembler(node, settings, Extrinsics(None, settings), lambda: None)
        self.pairing = Pairing(node, settings, self.report, self.pairs.append, lambda stamp: None)
        self.subscription = rgbd_images.rgbd_subscription(
            node, settings, self.assembler, self.pairing)
        self._node = node

    def receive(self, *messages):
        [subscription] = self._node.subscriptions
        for content in messages:
            subscription.callback(content)

    def frame(self):
        return self.assembler.frame(self.assembler.arrival(self.pairs[-1]))


@pytest.fixture
def installed(rtabmap_msgs, monkeypatch):
    """Have the messages that were built, though they were not there when ROS was imported."""
    from rtabmap_msgs.msg import RGBDImage, RGBDImages
    monkeypatch.setattr(rgbd_images, 'RGBDImage', RGBDImage)
    monkeypatch.setattr(rgbd_images, 'RGBDImages', RGBDImages)


def test_a_message_has_images_and_camera(node, installed):
    received = Input(node)
    received.receive(message())
    assert [each.topic_name for each in node.subscriptions] == ['/rgbd_image']
    assert received.assembler.missing_for(received.pairs[0]) == ''
    frame = received.frame()
    assert (frame.stamp, frame.depth_stamp) == (STAMP, DEPTH_STAMP)
    np.testing.assert_array_equal(frame.colour, COLOUR)
    np.testing.assert_array_equal(frame.depth, DEPTH)


@pytest.mark.parametrize('rectification, camera', [
    ('auto', RECTIFIED), ('rectified', RECTIFIED), ('raw', RAW)])
def test_its_images_are_rectified_unless_a_parameter_says_otherwise(
        node, installed, rectification, camera):
    received = Input(node, image_rectification=rectification)
    received.receive(message())
    assert received.frame().camera == camera


def test_each_pair_has_the_camera_that_came_with_it(node, installed):
    received = Input(node, image_rectification='raw')
    received.receive(message())
    arrival = received.assembler.arrival(received.pairs[0])
    received.receive(message(rgb_camera_info=info(Camera(8, 6, 20.0, 20.0, 3.5, 2.5)),
                             rgb=image(STAMP + 33_000_000, 'rgb8', COLOUR),
                             depth=image(STAMP + 33_000_000, '32FC1', DEPTH)))
    assert received.assembler.frame(arrival).camera == RAW
    assert received.frame().camera.fx == 20.0


def test_depth_is_registered_by_the_camera_info_of_depth(node, installed):
    received = Input(node, register_depth=True, image_rectification='raw')
    other = info(Camera(4, 3, 5.0, 5.0, 1.5, 1.0))
    received.receive(message(depth_camera_info=other))
    with pytest.raises(InputError, match='calibrated for 4 x 3'):
        received.frame()


def test_compressed_images_are_decoded(node, installed):
    millimetres = np.rint(1000 * DEPTH).astype(np.uint16)
    received = Input(node)
    received.receive(message(
        rgb=Image(), depth=Image(),
        rgb_compressed=CompressedImage(
            header=header(STAMP), format='png',
            data=cv2.imencode('.png', COLOUR[..., ::-1])[1].tobytes()),
        depth_compressed=CompressedImage(
            header=header(DEPTH_STAMP), format='png',
            data=cv2.imencode('.png', millimetres)[1].tobytes())))
    frame = received.frame()
    np.testing.assert_array_equal(frame.colour, COLOUR)
    np.testing.assert_allclose(frame.depth, millimetres / 1000, rtol=1e-6)


def test_an_image_without_a_header_has_that_of_the_message(node, installed):
    bare = image(0, 'rgb8', COLOUR)
    bare.header.frame_id = ''
    received = Input(node)
    received.receive(message(rgb=bare, depth=image(STAMP, '32FC1', DEPTH)))
    [pair] = received.pairs
    assert (pair.colour_stamp, pair.depth_stamp) == (DEPTH_STAMP, STAMP)
    assert pair.colour.header == header(DEPTH_STAMP, 'colour')


@pytest.mark.parametrize('parts, reason', [
    ({'rgb': Image()}, 'it has no colour image'), ({'depth': Image()}, 'it has no depth image'),
    ({'rgb': image(2 * STAMP, 'rgb8', COLOUR)}, 'far ahead of those before')])
def test_what_cannot_be_used_is_rejected_with_the_topic(node, installed, parts, reason):
    received = Input(node)
    received.receive(message(), message(**parts))
    assert len(received.pairs) == 1
    assert received.pairing.rejection.startswith('image on rgbd_image rejected: ')
    assert reason in received.pairing.rejection
    assert received.report.snapshot().totals[Count.IMAGES_REJECTED] == 1


def test_depth_is_moved_by_its_own_camera_into_that_of_colour(node, installed):
    """A plane at 2 m; the depth camera sees half as far to the sides."""
    plane = image(DEPTH_STAMP, '32FC1', np.full((6, 8), 2.0, np.float32))
    narrow = Camera(8, 6, 20.0, 20.0, 3.5, 2.5)
    received = Input(node, register_depth=True, image_rectification='raw')
    received.receive(message(depth=plane, depth_camera_info=info(narrow),
                             rgb_camera_info=info(Camera(8, 6, 10.0, 10.0, 3.5, 2.5))))
    seen = np.isfinite(received.frame().depth)
    assert 0.1 < seen.mean() < 0.5
    assert seen[3, 4] and not seen[0, 0]


@pytest.mark.parametrize('settings, kind', [({}, 'RGBDImage'), ({'rgbd_cameras': 0}, 'RGBDImages'),
                                            ({'rgbd_cameras': 2}, 'RGBDImage')])
def test_it_is_subscribed_to_as_the_parameters_say(node, installed, settings, kind):
    Input(node, topic_queue_size=7, qos_reliability='reliable', **settings)
    [subscription] = node.subscriptions
    assert subscription.msg_type is getattr(rgbd_images, kind)
    assert subscription.qos_profile.depth == 7
    assert subscription.qos_profile.reliability is ReliabilityPolicy.RELIABLE


def test_one_camera_in_a_list_is_no_warning(node, installed, log):
    received = Input(node, rgbd_cameras=0)
    received.receive(message_of_many(message()))
    assert len(received.pairs) == 1
    assert log.warnings == []


def test_a_list_is_warned_of_once(node, installed, log):
    received = Input(node, rgbd_cameras=0)
    for stamp in (STAMP, STAMP + 33_000_000):
        one = message(rgb=image(stamp, 'rgb8', COLOUR), depth=image(stamp, '32FC1', DEPTH))
        received.receive(message_of_many(one, one))
    assert len(received.pairs) == 2
    assert log.warnings == ['rgbd_images has 2 images: only the first is used']
    assert log.throttles == []  # for ever


def test_an_image_that_is_missing_is_explained(node, installed):
    received = Input(node)
    received.receive(message(depth=Image()))
    assert received.pairing.rejection == (
        'image on rgbd_image rejected: it has no depth image; its publisher must send one, raw '
        'or compressed')


def test_of_an_image_sent_both_raw_and_compressed_the_raw_one_is_used(node, installed):
    received = Input(node)
    received.receive(message(rgb_compressed=CompressedImage(data=b'no image')))
    np.testing.assert_array_equal(received.frame().colour, COLOUR)


def test_messages_are_required_only_where_they_are_subscribed_to(monkeypatch):
    monkeypatch.setattr(rgbd_images, 'RGBDImage', None)
    rgbd_images.require_messages(NodeSettings())
    with pytest.raises(InputError, match='^subscribe_rgbd is true, and rtabmap_msgs is not'):
        rgbd_images.require_messages(NodeSettings(subscribe_rgbd=True))


def test_messages_that_are_installed_are_enough(installed):
    rgbd_images.require_messages(NodeSettings(subscribe_rgbd=True))


def test_a_message_that_comes_twice_is_used_once(node, installed):
    received = Input(node)
    received.receive(message(), message())
    assert len(received.pairs) == 1
    assert 'repeats or goes back' in received.pairing.rejection


def test_a_recording_that_starts_again_is_used_again(node, installed):
    received = Input(node)
    for stamp in (STAMP, STAMP + 10 ** 10, STAMP, STAMP + 10 ** 7):
        received.receive(message(rgb=image(stamp, 'rgb8', COLOUR),
                                 depth=image(stamp, '32FC1', DEPTH)))
    assert len(received.pairs) == 4


def test_of_many_cameras_in_one_message_the_first_is_used(node, installed, log):
    received = Input(node, rgbd_cameras=0)
    other = message(rgb=image(STAMP + 1, 'rgb8', COLOUR))
    received.receive(message_of_many(message(), other))
    assert [each.topic_name for each in node.subscriptions] == ['/rgbd_images']
    assert [pair.colour_stamp for pair in received.pairs] == [STAMP]
    assert log.warnings == ['rgbd_images has 2 images: only the first is used']


def test_a_message_of_no_camera_is_rejected(node, installed):
    received = Input(node, rgbd_cameras=0)
    received.receive(message_of_many())
    assert 'it has no colour image' in received.pairing.rejection


def test_of_several_topics_the_first_is_used(node, installed, log):
    received = Input(node, rgbd_cameras=3)
    received.receive(message())
    assert len(received.pairs) == 1
    assert [each.topic_name for each in node.subscriptions] == ['/rgbd_image0']
    assert log.warnings == [
        'rgbd_cameras = 3: only the first camera is used, on rgbd_image0']


def test_an_unusable_camera_info_is_named(node, installed, log):
    received = Input(node)
    received.receive(message(rgb_camera_info=CameraInfo()))
    assert ('camera_info on rgb_camera_info of rgbd_image rejected: '
            in log.warnings[0])
    assert received.assembler.missing_for(received.pairs[0]).startswith(
        'images come but no usable camera_info on rgb_camera_info of rgbd_image: ')


def test_without_rtabmap_msgs_the_node_says_what_is_missing(ros_domain):
    blocked = ('import sys; sys.modules["rtabmap_msgs"] = None; '
               'from aick_ros.ros import odom_node; odom_node.main()')
    done = subprocess.run(
        [sys.executable, '-c', blocked, '--ros-args', '-p', 'subscribe_rgbd:=true'],
        capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.strip().splitlines() == [
        'odom_node: subscribe_rgbd is true, and rtabmap_msgs is not installed: install it (apt '
        'install ros-jazzy-rtabmap-msgs), or set subscribe_rgbd to false']


# Over DDS.

@pytest.fixture(scope='module')
def frames():
    source = SyntheticSource(SyntheticOptions(seed=5, frames=4))
    return [source.frame(i) for i in range(4)]


def test_the_node_follows_rgbd_image(rtabmap_msgs, rig, start_node, frames):
    """Raw, then compressed as older versions of rgbd_sync do it: the numbers are the same."""
    from rtabmap_msgs.msg import RGBDImage
    publisher = rig.node.create_publisher(RGBDImage, 'rgbd_image', 10)
    start_node(wait=False, subscribe_rgbd='true')
    rig.wait_until(publisher.get_subscription_count, 'a subscription of rgbd_image')
    rig.wait_until(lambda: rig.diagnostics, 'the node to publish')
    odometry = Odometry()
    for i, frame in enumerate(frames):
        parts = _raw(rig, frame) if i % 2 == 0 else _compressed(frame)
        camera_info = rig.camera_info_message(frame.camera)
        publisher.publish(RGBDImage(
            header=header(frame.stamp, 'camera_rgb_optical_frame'), rgb_camera_info=camera_info,
            depth_camera_info=camera_info, **parts))
        update = odometry.register_frame(RgbdFrame(
            frame.stamp, frame.colour, frame.depth, frame.camera, frame.depth_stamp))
        np.testing.assert_allclose(from_pose(rig.answer(frame.stamp).pose.pose),
                                   update.T_odom_camera, atol=1e-6)


def _raw(rig, frame):
    return {'rgb': rig.image_message(frame.stamp, 'rgb8', frame.colour),
            'depth': rig.image_message(frame.depth_stamp or frame.stamp, '32FC1', frame.depth)}


def _compressed(frame):
    """Return images without loss; the optical frame is that of the message."""
    height, width = frame.depth.shape
    bytes_of_numbers = frame.depth.view(np.uint8).reshape(height, width, 4)
    stamps = frame.stamp, frame.depth_stamp or frame.stamp
    return {f'{name}_compressed': CompressedImage(
        header=header(stamp, 'camera_rgb_optical_frame'), format='png',
        data=cv2.imencode('.png', pixels)[1].tobytes())
        for name, stamp, pixels in zip(('rgb', 'depth'), stamps, (
            frame.colour[..., ::-1], bytes_of_numbers))}
