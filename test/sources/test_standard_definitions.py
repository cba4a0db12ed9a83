# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Definitions in bags that agree with those of ROS, and some that do not."""

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from aick_ros.sources.bag_topics import CAMERA_INFO, COMPRESSED_IMAGE, IMAGE, IMU, POSES
from aick_ros.sources.standard_definitions import difference

READ = (IMAGE, COMPRESSED_IMAGE, CAMERA_INFO, IMU, *POSES)
NEXT = '\n' + '=' * 80 + '\nMSG: '
HEADER = NEXT + 'std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n'
TIME = NEXT + 'builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n'
IMAGE_TEXT = ('std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n'
              'uint8 is_bigendian\nuint32 step\nuint8[] data\n')


def image(text=IMAGE_TEXT, header=HEADER, time=TIME):
    """Return what differs in a bag with this definition of an image."""
    return difference(get_types_from_msg(text + header + time, IMAGE), IMAGE, is_ros2=True)


@pytest.mark.parametrize('store, is_ros2', [
    *((store, True) for store in Stores if store.name.startswith('ROS2')),
    (Stores.ROS1_NOETIC, False)])
def test_no_release_of_ros_differs(store, is_ros2):
    types = get_typestore(store).fielddefs
    assert [difference(types, name, is_ros2) for name in READ] == [''] * len(READ)


def test_an_image_as_in_ros_does_not_differ():
    assert image() == ''


@pytest.mark.parametrize('changed', [
    {'text': IMAGE_TEXT + 'float64 exposure\n'}, {'text': 'uint32 MAX=3\n' + IMAGE_TEXT},
    {'text': IMAGE_TEXT.replace('uint32', 'int64')}, {'time': TIME.replace('int32', 'int64')},
    {'text': IMAGE_TEXT.replace('string', 'string<=9').replace('uint8[]', 'uint8[<=9]')}])
def test_what_makes_no_difference_to_who_reads_it_is_none(changed):
    assert image(**changed) == ''


@pytest.mark.parametrize('changed, expected', [
    ({'text': IMAGE_TEXT.replace('step', 'stride')}, f'{IMAGE} has no step'),
    ({'text': IMAGE_TEXT.replace('step', 'Step')}, f'{IMAGE} has no step'),
    ({'header': HEADER.replace('frame_id', 'id')}, 'std_msgs/msg/Header has no frame_id'),
    ({'time': TIME.replace(' sec', ' s')}, 'builtin_interfaces/msg/Time has no sec'),
    *(({'text': IMAGE_TEXT.replace(*change)}, f'{field} of {IMAGE} is of another type than in ROS')
      for change, field in (
          (('uint32 step', 'float32 step'), 'step'), (('uint32 step', 'uint32[] step'), 'step'),
          (('uint32 step', 'string step'), 'step'), (('string enc', 'uint8 enc'), 'encoding'),
          (('uint8[] data', 'uint8 data'), 'data'), (('uint8[] data', 'uint8[9] data'), 'data'),
          (('uint8[] data', 'string[] data'), 'data'),
          (('std_msgs/Header h', 'builtin_interfaces/Time h'), 'header')))])
def test_what_is_missing_or_of_another_kind_is_named(changed, expected):
    assert image(**changed) == expected


def test_an_array_has_as_many_elements_as_in_ros():
    types = {**get_typestore(Stores.ROS2_JAZZY).fielddefs}
    constants, fields = types[CAMERA_INFO]
    shorter = [(name, (kind, (content[0], 9)) if name == 'p' else (kind, content))
               for name, (kind, content) in fields]
    assert difference({**types, CAMERA_INFO: (constants, shorter)}, CAMERA_INFO, True) == (
        f'p of {CAMERA_INFO} is of another type than in ROS')


def test_messages_in_a_list_are_compared_too():
    name = 'tf2_msgs/msg/TFMessage'
    types = {**get_typestore(Stores.ROS2_JAZZY).fielddefs, 'geometry_msgs/msg/Vector3': ([], [])}
    assert difference(types, name, True) == 'geometry_msgs/msg/Vector3 has no x'


def test_capital_letters_are_those_of_ros_1():
    types = get_typestore(Stores.ROS1_NOETIC).fielddefs
    assert difference(types, CAMERA_INFO, is_ros2=True) == f'{CAMERA_INFO} has no d'


def test_types_that_are_not_of_ros_or_not_defined_are_left_to_the_reader():
    assert difference(get_types_from_msg('int32 x\n', 'a/msg/A'), 'a/msg/A', True) == ''
    assert difference({}, IMAGE, True) == ''
