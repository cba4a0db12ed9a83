# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames of pairs: what is missing for one, and which cameras and extrinsics it is made with."""

import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, Image

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.messages.synchronizer import Pair
from aick_ros.ros.conversions import to_time
from aick_ros.ros.input.assembler import FrameAssembler
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


class FakeExtrinsics:
    """
    Extrinsics that are identities, and keep what was asked.

    :ivar unknown: frames without a transform.
    """

    def __init__(self):
        self.unknown, self.asked, self.T_colour_depth = set(), [], np.eye(4)

    def camera_in_base(self, frame, stamp, wait=True):
        return self._find((frame,), stamp, wait)

    def depth_in_colour(self, colour_frame, depth_frame, stamp, wait=True):
        return self._find((colour_frame, depth_frame), stamp, wait)

    def _find(self, frames, stamp, wait):
        self.asked.append((*frames, stamp, wait))
        if self.unknown & set(frames):
            raise InputError(f'no transform of {frames[-1]}')
        return self.T_colour_depth if len(frames) == 2 else np.eye(4)


class Assembly:
    """An assembler that receives calibrations."""

    def __init__(self, node, **settings):
        self._node, self.extrinsics, self.changes = node, FakeExtrinsics(), []
        self.assembler = FrameAssembler(node, NodeSettings(**settings), self.extrinsics,
                                        lambda: self.changes.append(None))

    def calibrate(self, topic, camera):
        for subscription in self._node.subscriptions:
            if subscription.topic_name == topic:
                subscription.callback(info(camera))


def info(camera):
    return CameraInfo(width=camera.width, height=camera.height, k=camera.matrix.ravel(),
                      d=camera.distortion, distortion_model=camera.distortion_model)


@pytest.fixture
def assembly(fake_node):
    return Assembly(fake_node)


@pytest.fixture
def registering(fake_node):
    """Return an assembly for depth images that are not registered to colour."""
    return Assembly(fake_node, register_depth=True)


def test_a_calibration_of_depth_is_subscribed_only_where_depth_is_registered(assembly, fake_node):
    assert [s.name for s in assembly.assembler.subscriptions] == ['rgb/camera_info']
    registering = Assembly(fake_node, register_depth=True)
    assert [s.name for s in registering.assembler.subscriptions] == [
        'rgb/camera_info', 'depth/camera_info']


def test_a_pair_needs_the_camera_then_its_place_on_the_base(assembly):
    assert 'no usable camera_info on rgb/camera_info' in assembly.assembler.missing_for(PAIR)
    assembly.calibrate('/rgb/camera_info', CAMERA)
    assert len(assembly.changes) == 1
    assembly.extrinsics.unknown = {'colour'}
    assert assembly.assembler.missing_for(PAIR) == 'no transform of colour'
    assembly.extrinsics.unknown = {'infrared'}
    assert assembly.assembler.missing_for(PAIR) == ''
    assert assembly.extrinsics.asked[-1] == ('colour', STAMP, False)  # it must not block


def test_registered_depth_needs_its_own_camera_and_extrinsic(registering):
    registering.calibrate('/rgb/camera_info', CAMERA)
    assert 'comes on depth/camera_info' in registering.assembler.missing_for(PAIR)
    registering.calibrate('/depth/camera_info', CAMERA)
    registering.extrinsics.unknown = {'infrared'}
    assert registering.assembler.missing_for(PAIR) == 'no transform of infrared'
    assert registering.extrinsics.asked[-1] == ('colour', 'infrared', DEPTH_STAMP, False)
    registering.extrinsics.unknown = set()
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


def test_depth_is_registered_with_the_extrinsic_at_its_stamp(registering):
    arrival = registering.assembler.arrival(PAIR)
    registering.calibrate('/rgb/camera_info', CAMERA)
    with pytest.raises(InputError, match='depth/camera_info'):
        registering.assembler.frame(arrival)
    registering.calibrate('/depth/camera_info', CAMERA)
    frame = registering.assembler.frame(arrival)
    assert registering.extrinsics.asked[-1] == ('colour', 'infrared', DEPTH_STAMP, True)
    # the cameras are one and the same: each pixel stays where it is
    valid = np.isfinite(frame.depth)
    assert valid.mean() > 0.5
    np.testing.assert_allclose(frame.depth[valid], DEPTH[valid], atol=0.1)
    np.testing.assert_array_equal(frame.colour, COLOUR)


def test_registered_depth_is_moved_by_the_extrinsic_from_depth_to_colour(registering):
    """A plane at 2 m, seen by a depth camera 0.3 m ahead of the other, is at 2.3 m of that."""
    plane = image(DEPTH_STAMP, '32FC1', np.full((6, 8), 2.0, np.float32), 'infrared')
    registering.extrinsics.T_colour_depth = se3.exp([0, 0, 0.3, 0, 0, 0])
    for name in ('rgb', 'depth'):
        registering.calibrate(f'/{name}/camera_info', CAMERA)
    arrival = registering.assembler.arrival(PAIR._replace(depth=plane))
    depth = registering.assembler.frame(arrival).depth
    assert np.isfinite(depth).mean() > 0.5
    np.testing.assert_allclose(depth[np.isfinite(depth)], 2.3, rtol=1e-5)


def test_the_cameras_of_depth_and_colour_are_not_exchanged(registering):
    """Both are 8 x 6; the one of colour has twice the focal length, so it sees half as far."""
    plane = image(DEPTH_STAMP, '32FC1', np.full((6, 8), 2.0, np.float32), 'infrared')
    registering.calibrate('/rgb/camera_info', OTHER)
    registering.calibrate('/depth/camera_info', CAMERA)
    arrival = registering.assembler.arrival(PAIR._replace(depth=plane))
    assert (arrival.camera, arrival.depth_camera) == (OTHER, CAMERA)
    frame = registering.assembler.frame(arrival)
    assert frame.camera == OTHER
    assert np.isfinite(frame.depth).all()  # all of colour's view is inside that of depth
    registering.calibrate('/rgb/camera_info', CAMERA)
    registering.calibrate('/depth/camera_info', OTHER)
    frame = registering.assembler.frame(registering.assembler.arrival(PAIR._replace(depth=plane)))
    assert 0.1 < np.isfinite(frame.depth).mean() < 0.5


def test_each_calibration_is_named_by_its_own_images(registering, fake_node):
    for name in ('rgb', 'depth'):
        registering.calibrate(f'/{name}/camera_info', CAMERA)
    assert [text.split(',')[0] for text in fake_node.logger.infos] == [
        'camera of /rgb/image', 'camera of /depth/image']


def test_an_arrival_keeps_the_camera_of_depth_of_its_time(registering):
    for name in ('rgb', 'depth'):
        registering.calibrate(f'/{name}/camera_info', CAMERA)
    arrival = registering.assembler.arrival(PAIR)
    before = registering.assembler.frame(arrival).depth
    registering.calibrate('/depth/camera_info', OTHER)
    np.testing.assert_array_equal(registering.assembler.frame(arrival).depth, before)
    assert len(registering.changes) == 3


def test_without_registration_there_is_no_camera_of_depth(assembly):
    assembly.calibrate('/rgb/camera_info', CAMERA)
    assert assembly.assembler.arrival(PAIR).depth_camera is None
    assembly.assembler.take_camera_infos(info(OTHER), info(CAMERA))
    arrival = assembly.assembler.arrival(PAIR)
    assert (arrival.camera, arrival.depth_camera) == (OTHER, None)


def test_calibrations_that_came_with_the_images_are_those_of_each(fake_node):
    registering = Assembly(fake_node, register_depth=True, subscribe_rgbd=True,
                           image_rectification='raw')
    assert registering.assembler.subscriptions == []
    registering.assembler.take_camera_infos(info(OTHER), info(CAMERA))
    arrival = registering.assembler.arrival(PAIR)
    assert (arrival.camera, arrival.depth_camera) == (OTHER, CAMERA)


def test_what_is_missing_is_a_whole_sentence(registering):
    missing_for = registering.assembler.missing_for
    assert missing_for(PAIR) == 'images come but no usable camera_info on rgb/camera_info'
    registering.calibrate('/rgb/camera_info', CAMERA)
    assert missing_for(PAIR) == (
        'register_depth is set but no usable camera_info comes on depth/camera_info')
