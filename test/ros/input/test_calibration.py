# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Camera_info messages: which describe the camera, and who hears of a change."""

import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo

from aick_ros.geometry.camera import Camera
from aick_ros.ros.input.calibration import Calibration
from aick_ros.settings.node import NodeSettings

CAMERA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5, 'plumb_bob', (0.1, -0.2, 0.0, 0.0, 0.0))
RECTIFIED = Camera(640, 480, 500.0, 500.0, 320.0, 240.0)


def message(camera=CAMERA, **changes):
    return CameraInfo(**{
        'width': camera.width, 'height': camera.height, 'k': camera.matrix.ravel(),
        'd': camera.distortion, 'distortion_model': camera.distortion_model,
        'p': np.hstack([RECTIFIED.matrix, np.zeros((3, 1))]).ravel(), **changes})


class Received:
    """A calibration with the number of changes, and what the camera sends."""

    def __init__(self, node, image='rgb/image', **settings):
        self.changes, self._node = 0, node
        self.calibration = Calibration(node, 'rgb/camera_info', image, NodeSettings(**settings),
                                       self._count)

    def receive(self, info):
        [*_, subscription] = self._node.subscriptions
        subscription.callback(info)
        return self.calibration.camera

    def _count(self):
        self.changes += 1


def test_a_camera_is_known_from_its_first_message(node):
    received = Received(node)
    assert received.calibration.camera is None
    assert not received.calibration.subscription.may_be_silent
    assert received.receive(message()) == CAMERA
    assert received.changes == 1
    assert received.calibration.subscription.may_be_silent


def test_only_another_camera_is_a_change(node, log):
    received, other = Received(node), Camera(640, 480, 600.0, 600.0, 319.5, 239.5)
    for _ in range(3):
        received.receive(message())
    assert received.changes == len(log.infos) == 1
    assert received.receive(message(other)) == other
    assert received.changes == len(log.infos) == 2


def test_cameras_that_alternate_are_said_to_and_not_logged_each_time(node, log, steady):
    received = Received(node)
    for length in range(500, 560):
        received.receive(message(Camera(640, 480, length, 525.0, 319.5, 239.5)))
        steady.now += 0.03
    assert received.changes == 60
    assert len(log.infos) == 3
    [sentence] = log.warnings
    assert sentence == ('camera_info on /rgb/camera_info changes again and again: if two drivers '
                        'publish it, remap one of them to another topic')
    steady.now += 60.0
    received.receive(message())
    assert log.infos[3:] == [f'camera of /rgb/image, raw images: {CAMERA}']


@pytest.mark.parametrize('changes', [{'k': np.zeros(9)}, {'width': 0}], ids=str)
def test_an_unusable_message_is_rejected_and_the_camera_stays(node, log, changes):
    received = Received(node)
    assert received.receive(message(**changes)) is None
    assert not received.calibration.subscription.may_be_silent
    received.receive(message())
    assert received.receive(message(**changes)) == CAMERA
    assert received.changes == 1
    [text] = log.warnings
    assert text.startswith('camera_info on /rgb/camera_info rejected: ')


@pytest.mark.parametrize('rectification, image, expected', [
    ('auto', 'rgb/image', CAMERA), ('auto', 'rgb/image_rect', RECTIFIED),
    ('rectified', 'rgb/image', RECTIFIED), ('raw', 'rgb/image_rect', CAMERA)])
def test_whether_images_are_rectified_is_in_the_parameter_or_their_name(
        node, rectification, image, expected):
    received = Received(node, image, image_rectification=rectification)
    assert received.receive(message()) == expected


def test_a_camera_is_named_with_its_images_and_whether_they_are_rectified(node, log):
    Received(node).receive(message())
    Received(node, 'rgb/image_rect').receive(message())
    assert log.infos == [
        f'camera of /rgb/image, raw images: {CAMERA}',
        f'camera of /rgb/image_rect, rectified images: {RECTIFIED}']


def test_its_topic_is_its_source(node):
    calibration = Received(node).calibration
    assert calibration.source == calibration.subscription.name == 'rgb/camera_info'
    [subscription] = node.subscriptions
    assert (subscription.topic_name, subscription.msg_type) == ('/rgb/camera_info', CameraInfo)


def test_what_is_rejected_is_not_logged_for_each_message(node, log):
    received = Received(node)
    for _ in range(3):
        received.receive(message(width=0))
    assert len(log.warnings) == 1
    assert min(log.throttles) >= 1.0


@pytest.mark.parametrize('settings, source', [
    ({}, 'rgb_camera_info of rgbd_image'),
    ({'rgbd_cameras': 0}, 'rgb_camera_info of rgbd_images')])
def test_in_rgbd_image_it_is_a_part_of_the_message_whose_images_are_rectified(
        node, log, settings, source):
    received = Received(node, subscribe_rgbd=True, **settings)
    calibration = received.calibration
    assert list(node.subscriptions) == []
    assert (calibration.source, calibration.subscription) == (source, None)
    calibration.take(message())
    assert calibration.camera == RECTIFIED
    assert log.infos == [
        f'camera of /{source.split()[-1]}, rectified images: {RECTIFIED}']
    calibration.take(message(width=0))
    [text] = log.warnings
    assert text.startswith(f'camera_info on {source} rejected: ')


def test_images_of_rgbd_image_are_raw_where_a_parameter_says_so(node):
    calibration = Received(node, subscribe_rgbd=True, image_rectification='raw').calibration
    calibration.take(message())
    assert calibration.camera == CAMERA
