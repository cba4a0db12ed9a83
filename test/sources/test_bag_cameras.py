# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Cameras and extrinsic of a bag whose messages are given."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.sources import SourceOptions
from aick_ros.sources.bag_cameras import BagCameras
from aick_ros.sources.bag_file import BagMessage
from aick_ros.sources.bag_topics import CAMERA_INFO, TRANSFORMS, BagTopics
from aick_ros.sources.writers.bag_messages import camera_info

COLOUR, DEPTH = Camera(320, 240, 262, 263, 159.5, 119.5), Camera(256, 212, 182, 183, 127, 106)
T_COLOUR_DEPTH = se3.exp([0.05, -0.01, 0.005, 0.01, -0.02, 0.015])
T_BASE_COLOUR = se3.exp([0.2, 0.1, 0.5, -1.2, 1.2, -1.2])
NUMBERS = (*T_COLOUR_DEPTH[:3, 3], *se3.to_quaternion(T_COLOUR_DEPTH[:3, :3]))
RGB, INFO, DEPTH_INFO = '/rgb/image_raw', '/rgb/camera_info', '/depth/camera_info'
INFOS = {INFO: [camera_info(1, COLOUR)], DEPTH_INFO: [camera_info(1, DEPTH)]}


def link(parent, child, T, scale=1.0):
    x, y, z, w = (scale * se3.to_quaternion(T[:3, :3])).tolist()
    position = dict(zip('xyz', T[:3, 3].tolist()))
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=parent), child_frame_id=child, transform=SimpleNamespace(
            translation=SimpleNamespace(**position), rotation=SimpleNamespace(x=x, y=y, z=z, w=w)))


def fixed(*links):
    return {'/tf_static': [SimpleNamespace(transforms=list(links))]}


class Bag:
    """A bag of messages by topic, which keeps what was asked for."""

    def __init__(self, messages):
        self._messages, self.asked = messages, []

    def messages(self, topics, on_damaged):
        self.asked += topics
        for topic in topics:
            for content in self._messages.get(topic, []):
                yield BagMessage(topic, 1, content)


def cameras(messages=INFOS, **options):
    types = {topic: CAMERA_INFO if 'info' in topic else TRANSFORMS for topic in messages}
    return BagCameras(Bag(messages), BagTopics(types, 'some.bag'), SourceOptions(**options))


def test_each_camera_has_its_own_calibration():
    found = cameras()
    assert (found.colour(RGB), found.depth('/depth/image_raw')) == (COLOUR, DEPTH)


def test_the_topics_that_are_given_count():
    others = {'/x/camera_info': [camera_info(1, DEPTH)], '/y/camera_info': [
        camera_info(1, COLOUR)], **INFOS}
    found = cameras(others, info_topic='/x/camera_info', depth_info_topic='/y/camera_info',
                    register_depth=True)
    assert (found.colour(RGB), found.depth('/depth/image_raw')) == (DEPTH, COLOUR)


def test_the_first_message_counts():
    found = cameras({INFO: [camera_info(1, COLOUR), camera_info(2, DEPTH)]})
    assert found.colour(RGB) == COLOUR


def test_a_file_comes_before_the_bag(tmp_path):
    path = tmp_path / 'camera.json'
    path.write_text(json.dumps({'width': 256, 'height': 212, 'distortion_model': '', 'd': [],
                                'k': DEPTH.matrix.ravel().tolist()}))
    assert cameras(camera=path).colour(RGB).fx == DEPTH.fx


def test_capital_letters_of_ros_1_are_read():
    info = vars(camera_info(1, COLOUR)).copy()
    for name in 'kdp':
        info[name.upper()] = info.pop(name)
    assert cameras({INFO: [SimpleNamespace(**info)]}).colour(RGB) == COLOUR


@pytest.mark.parametrize('messages, remedy', [
    ({}, 'has no camera_info topic .*; or give a calibration with --camera FILE'),
    ({INFO: []}, 'some.bag has no message on /rgb/camera_info: record it again, or give a '
                 'calibration with --camera FILE'),
    ({INFO: [replace(camera_info(1, COLOUR), width=0)]},
     'some.bag, /rgb/camera_info: .*; or give')])
def test_a_camera_that_is_not_described_is_one_sentence(messages, remedy):
    with pytest.raises(InputError, match=remedy):
        cameras(messages).colour(RGB)


def test_a_missing_calibration_of_depth_names_its_own_option():
    with pytest.raises(InputError, match='choose another one with --depth-info-topic'):
        cameras({DEPTH_INFO: []}).depth('/depth/image_raw')


@pytest.mark.parametrize('frames', [('rgb', 'depth'), ('/rgb', '/depth')])
def test_fixed_transforms_are_joined_whatever_their_slashes(frames):
    tree = fixed(link('base', '/rgb', T_BASE_COLOUR), link('/base', 'depth', (
        T_BASE_COLOUR @ T_COLOUR_DEPTH), scale=2.0))
    found = cameras(tree, register_depth=True)
    for find in (found.depth_in_colour, found.in_colour):
        np.testing.assert_allclose(find(*frames), T_COLOUR_DEPTH, atol=1e-9)


def test_the_tree_is_read_once():
    found = cameras(fixed(link('rgb', 'depth', T_COLOUR_DEPTH)))
    for _ in range(3):
        found.in_colour('rgb', 'depth')
    assert found._bag.asked == ['/tf_static']


def test_a_null_rotation_is_skipped_and_the_next_link_used():
    tree = fixed(link('rgb', 'depth', T_COLOUR_DEPTH, scale=0.0),
                 link('rgb', 'other', T_BASE_COLOUR))
    found = cameras(tree, register_depth=True)
    np.testing.assert_allclose(found.in_colour('rgb', 'other'), T_BASE_COLOUR, atol=1e-9)
    assert found.in_colour('rgb', 'depth') is None
    with pytest.raises(InputError, match=(
            r"^some.bag has no transform from 'depth' \(the depth images\) "
            r"to 'rgb' \(the colour images\) on /tf_static: give it with "
            '--depth-in-colour X Y Z QX QY QZ QW$')):
        found.depth_in_colour('/rgb', '/depth')


def test_one_frame_needs_no_transform_for_a_sensor():
    np.testing.assert_array_equal(cameras({}).in_colour('/imu', 'imu'), np.eye(4))


def test_the_given_pose_is_x_y_z_and_a_quaternion_and_comes_first():
    found = cameras(fixed(link('rgb', 'depth', T_BASE_COLOUR)), register_depth=True,
                    depth_in_colour=NUMBERS)
    np.testing.assert_allclose(found.depth_in_colour('rgb', 'depth'), T_COLOUR_DEPTH, atol=1e-9)
    assert found._bag.asked == []


@pytest.mark.parametrize('numbers', [(1, 2, 3), (1, 2, 3, 0, 0, 0, 0), (*NUMBERS, 1), ()])
def test_numbers_that_are_no_pose_are_rejected(numbers):
    with pytest.raises(InputError, match='--depth-in-colour .*is no pose: x y z qx qy qz qw'):
        cameras(register_depth=True, depth_in_colour=numbers)


@pytest.mark.parametrize('option, value', [('depth_info_topic', DEPTH_INFO),
                                           ('depth_in_colour', NUMBERS)])
def test_options_of_depth_require_that_it_is_registered(option, value):
    name = '--' + option.replace('_', '-')
    with pytest.raises(InputError, match=f'^{name} has no effect without --register-depth$'):
        cameras(**{option: value})
    cameras(**{option: value}, register_depth=True)


@pytest.mark.parametrize('images, info, is_rectified', [
    ('/rgb/image_rect', '/rgb/camera_info', True), ('/rgb/image_raw', '/rgb/camera_info', False),
    ('/rect/image', '/other/camera_info', True), ('/rgb/image', '/rect/camera_info', False)])
def test_the_name_of_the_images_says_whether_they_are_rectified(images, info, is_rectified):
    message = camera_info(1, COLOUR)
    message.p[0] = 100.0
    found = cameras({info: [message]}, info_topic=info).colour(images)
    assert found.fx == (100.0 if is_rectified else COLOUR.fx)
