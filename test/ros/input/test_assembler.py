# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames of pairs: what is missing for one, and which cameras and extrinsics it is made with."""

import re

import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, Image

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.messages.synchronizer import Pair
from aick_ros.ros.conversions import to_time
from aick_ros.ros.input.assembler import FrameAssembler
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.ros.input.transforms import Transforms
from aick_ros.settings.node import NodeSettings

STAMP, DEPTH_STAMP = 10 ** 18, 10 ** 18 + 5_000_000
CAMERA, OTHER = Camera(8, 6, 10.0, 10.0, 3.5, 2.5), Camera(8, 6, 20.0, 20.0, 3.5, 2.5)
COLOUR = np.arange(8 * 6 * 3, dtype=np.uint8).reshape(6, 8, 3)
DEPTH = np.linspace(1.0, 2.0, 8 * 6, dtype=np.float32).reshape(6, 8)


def image(stamp, encoding, pixels, frame_id):
    message = Image(height=6, width=8, encoding=encoding, step=pixels.strides[0],
                    data=pixels.tobytes())
    message.header.stamp, message.header.frame_id = to_time(stamp), frame_id
    return message


PAIR = Pair(STAMP, image(STAMP, 'rgb8', COLOUR, 'colour'),
            DEPTH_STAMP, image(DEPTH_STAMP, '32FC1', DEPTH, 'infrared'))


class Asked(Extrinsics):
    """The extrinsics of a node, which keep what they are asked."""

    def __init__(self, node, settings):
        super().__init__(Transforms(node, ('odom', 'base_link'), lambda: None), settings)
        self.asked = []

    def camera_in_base(self, *arguments, wait=True):
        self.asked.append((*arguments, wait))
        return super().camera_in_base(*arguments, wait)

    def depth_in_colour(self, *arguments, wait=True):
        self.asked.append((*arguments, wait))
        return super().depth_in_colour(*arguments, wait)


class Assembly:
    """An assembler that receives calibrations."""

    def __init__(self, node, **settings):
        self._node, self.changes, settings = node, [], NodeSettings(**settings)
        self.extrinsics = Asked(node, settings)
        self.assembler = FrameAssembler(node, settings, self.extrinsics,
                                        lambda: self.changes.append(None))

    def calibrate(self, topic, camera):
        self.tell(topic, info(camera))

    def tell(self, topic, message):
        for subscription in self._node.subscriptions:
            if subscription.topic_name == topic:
                subscription.callback(message)


def info(camera):
    return CameraInfo(width=camera.width, height=camera.height, k=camera.matrix.ravel(),
                      d=camera.distortion, distortion_model=camera.distortion_model)


@pytest.fixture
def assembly(node):
    return Assembly(node)


@pytest.fixture
def registering(node):
    """Return an assembly for depth images that are not registered to colour."""
    return Assembly(node, register_depth=True)


@pytest.fixture
def connected(registering, tell_tf):
    """Return one whose two cameras are in one place."""
    tell_tf({('base_link', 'colour'): np.eye(4), ('colour', 'infrared'): np.eye(4)})
    return registering


def test_a_calibration_of_depth_is_subscribed_only_where_depth_is_registered(assembly, node):
    assert [s.name for s in assembly.assembler.subscriptions] == ['rgb/camera_info']
    registering = Assembly(node, register_depth=True)
    assert [s.name for s in registering.assembler.subscriptions] == [
        'rgb/camera_info', 'depth/camera_info']


def test_a_pair_needs_the_camera_then_its_place_on_the_base(assembly, tell_tf):
    assert 'no usable camera_info on /rgb/camera_info' in assembly.assembler.missing_for(PAIR)
    assembly.calibrate('/rgb/camera_info', CAMERA)
    assert len(assembly.changes) == 1
    assert assembly.assembler.missing_for(PAIR).startswith("no transform from 'colour'")
    tell_tf({('base_link', 'colour'): np.eye(4)})
    assert assembly.assembler.missing_for(PAIR) == ''
    assert assembly.extrinsics.asked == 2 * [('colour', STAMP, False)]  # it must not block


def test_registered_depth_needs_its_own_camera_and_extrinsic(registering, tell_tf):
    tell_tf({('base_link', 'colour'): np.eye(4)})
    registering.calibrate('/rgb/camera_info', CAMERA)
    assert 'comes on /depth/camera_info' in registering.assembler.missing_for(PAIR)
    registering.calibrate('/depth/camera_info', CAMERA)
    assert registering.assembler.missing_for(PAIR).startswith("no transform from 'infrared'")
    assert registering.extrinsics.asked[-1] == ('colour', 'infrared', DEPTH_STAMP, False)
    tell_tf({('colour', 'infrared'): np.eye(4)})
    assert registering.assembler.missing_for(PAIR) == ''


def test_an_arrival_keeps_the_cameras_of_its_time(assembly, steady):
    assembly.calibrate('/rgb/camera_info', CAMERA)
    arrival = assembly.assembler.arrival(PAIR)
    assembly.calibrate('/rgb/camera_info', OTHER)
    assert assembly.assembler.frame(arrival).camera == CAMERA
    assert arrival.paired_at == steady.now
    assert arrival.camera_frame == 'colour'
    assert arrival.size == COLOUR.nbytes + DEPTH.nbytes


def test_an_arrival_without_a_camera_uses_the_first_one_known(assembly):
    arrival = assembly.assembler.arrival(PAIR)
    with pytest.raises(InputError, match='no usable camera_info'):
        assembly.assembler.frame(arrival)
    assembly.calibrate('/rgb/camera_info', CAMERA)
    frame = assembly.assembler.frame(arrival)
    assert (frame.stamp, frame.depth_stamp, frame.camera) == (STAMP, DEPTH_STAMP, CAMERA)
    np.testing.assert_array_equal(frame.colour, COLOUR)
    np.testing.assert_array_equal(frame.depth, DEPTH)


def test_depth_is_registered_with_the_extrinsic_at_its_stamp(connected):
    arrival = connected.assembler.arrival(PAIR)
    connected.calibrate('/rgb/camera_info', CAMERA)
    with pytest.raises(InputError, match='depth/camera_info'):
        connected.assembler.frame(arrival)
    connected.calibrate('/depth/camera_info', CAMERA)
    frame = connected.assembler.frame(arrival)
    assert connected.extrinsics.asked[-1] == ('colour', 'infrared', DEPTH_STAMP, True)
    # the cameras are one and the same: each pixel stays where it is
    valid = np.isfinite(frame.depth)
    assert valid.mean() > 0.5
    np.testing.assert_allclose(frame.depth[valid], DEPTH[valid], atol=0.1)
    np.testing.assert_array_equal(frame.colour, COLOUR)


def test_registered_depth_is_moved_by_the_extrinsic_from_depth_to_colour(registering, tell_tf):
    """A plane at 2 m, seen by a depth camera 0.3 m ahead of the other, is at 2.3 m of that."""
    plane = image(DEPTH_STAMP, '32FC1', np.full((6, 8), 2.0, np.float32), 'infrared')
    tell_tf({('colour', 'infrared'): se3.exp([0, 0, 0.3, 0, 0, 0])})
    for name in ('rgb', 'depth'):
        registering.calibrate(f'/{name}/camera_info', CAMERA)
    arrival = registering.assembler.arrival(PAIR._replace(depth=plane))
    depth = registering.assembler.frame(arrival).depth
    assert np.isfinite(depth).mean() > 0.5
    np.testing.assert_allclose(depth[np.isfinite(depth)], 2.3, rtol=1e-5)


def test_the_cameras_of_depth_and_colour_are_not_exchanged(connected):
    """Both are 8 x 6; the one of colour has twice the focal length, so it sees half as far."""
    plane = image(DEPTH_STAMP, '32FC1', np.full((6, 8), 2.0, np.float32), 'infrared')
    connected.calibrate('/rgb/camera_info', OTHER)
    connected.calibrate('/depth/camera_info', CAMERA)
    arrival = connected.assembler.arrival(PAIR._replace(depth=plane))
    assert (arrival.camera, arrival.depth_camera) == (OTHER, CAMERA)
    frame = connected.assembler.frame(arrival)
    assert frame.camera == OTHER
    assert np.isfinite(frame.depth).all()  # all of colour's view is inside that of depth
    connected.calibrate('/rgb/camera_info', CAMERA)
    connected.calibrate('/depth/camera_info', OTHER)
    frame = connected.assembler.frame(connected.assembler.arrival(PAIR._replace(depth=plane)))
    assert 0.1 < np.isfinite(frame.depth).mean() < 0.5


def test_each_calibration_is_named_by_its_own_images(registering, log):
    for name in ('rgb', 'depth'):
        registering.calibrate(f'/{name}/camera_info', CAMERA)
    assert [text.split(',')[0] for text in log.infos] == [
        'camera of /rgb/image', 'camera of /depth/image']


def test_an_arrival_keeps_the_camera_of_depth_of_its_time(connected):
    for name in ('rgb', 'depth'):
        connected.calibrate(f'/{name}/camera_info', CAMERA)
    arrival = connected.assembler.arrival(PAIR)
    before = connected.assembler.frame(arrival).depth
    connected.calibrate('/depth/camera_info', OTHER)
    np.testing.assert_array_equal(connected.assembler.frame(arrival).depth, before)
    assert len(connected.changes) == 3


def test_without_registration_there_is_no_camera_of_depth(assembly):
    assembly.calibrate('/rgb/camera_info', CAMERA)
    assert assembly.assembler.arrival(PAIR).depth_camera is None
    assembly.assembler.take_camera_infos(info(OTHER), info(CAMERA))
    arrival = assembly.assembler.arrival(PAIR)
    assert (arrival.camera, arrival.depth_camera) == (OTHER, None)


def test_calibrations_that_came_with_the_images_are_those_of_each(node):
    registering = Assembly(node, register_depth=True, subscribe_rgbd=True,
                           image_rectification='raw')
    assert registering.assembler.subscriptions == []
    registering.assembler.take_camera_infos(info(OTHER), info(CAMERA))
    arrival = registering.assembler.arrival(PAIR)
    assert (arrival.camera, arrival.depth_camera) == (OTHER, CAMERA)


def test_what_is_missing_is_a_whole_sentence(registering, tell_tf):
    tell_tf({('base_link', 'colour'): np.eye(4)})
    missing_for = registering.assembler.missing_for
    assert missing_for(PAIR) == (
        'images come but no usable camera_info on /rgb/camera_info: remap rgb/camera_info to the '
        'topic of the calibration')
    registering.calibrate('/rgb/camera_info', CAMERA)
    assert missing_for(PAIR) == (
        'register_depth is set but no usable camera_info comes on /depth/camera_info: remap '
        'depth/camera_info to the topic of the calibration')
    registering.tell('/depth/camera_info', CameraInfo())
    assert re.match('register_depth is set but no usable camera_info comes on /depth/camera_info: '
                    '(?!remap)', missing_for(PAIR))
