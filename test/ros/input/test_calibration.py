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
        self._node.subscriptions[-1].callback(info)
        return self.calibration.camera

    def _count(self):
        self.changes += 1


def test_a_camera_is_known_from_its_first_message(fake_node):
    received = Received(fake_node)
    assert received.calibration.camera is None
    assert not received.calibration.subscription.may_be_silent
    assert received.receive(message()) == CAMERA
    assert received.changes == 1
    assert received.calibration.subscription.may_be_silent


def test_only_another_camera_is_a_change(fake_node):
    received, other = Received(fake_node), Camera(640, 480, 600.0, 600.0, 319.5, 239.5)
    for _ in range(3):
        received.receive(message())
    assert received.changes == len(fake_node.logger.infos) == 1
    assert received.receive(message(other)) == other
    assert received.changes == len(fake_node.logger.infos) == 2


@pytest.mark.parametrize('changes', [{'k': np.zeros(9)}, {'width': 0}], ids=str)
def test_an_unusable_message_is_rejected_and_the_camera_stays(fake_node, changes):
    received = Received(fake_node)
    assert received.receive(message(**changes)) is None
    assert not received.calibration.subscription.may_be_silent
    received.receive(message())
    assert received.receive(message(**changes)) == CAMERA
    assert received.changes == 1
    assert len(fake_node.logger.warnings) == 2
    assert all(text.startswith('camera_info on /rgb/camera_info rejected: ')
               for text in fake_node.logger.warnings)


@pytest.mark.parametrize('rectification, image, expected', [
    ('auto', 'rgb/image', CAMERA), ('auto', 'rgb/image_rect', RECTIFIED),
    ('rectified', 'rgb/image', RECTIFIED), ('raw', 'rgb/image_rect', CAMERA)])
def test_whether_images_are_rectified_is_in_the_parameter_or_their_name(
        fake_node, rectification, image, expected):
    received = Received(fake_node, image, image_rectification=rectification)
    assert received.receive(message()) == expected
