# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Poses of cameras that are not known: which frames are missing, and what to do."""

import math

import numpy as np
import pytest

from aick_ros.borders.limits import MAX_EXTRINSIC
from aick_ros.errors import InputError
from aick_ros.geometry.frame_tree import LARGEST_GAP
from aick_ros.odometry.base_odometry import Mount
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.ros.input.transforms import Transforms
from aick_ros.ros.tf_messages import TF_REMEDY
from aick_ros.settings.node import NodeSettings


class Asked(Transforms):
    """The transforms of a node, which keep what they are asked."""

    def __init__(self, node):
        super().__init__(node, ('odom', 'base_link'), lambda: None)
        self.asked = []

    def find(self, *arguments):
        self.asked.append(arguments)
        return super().find(*arguments)


@pytest.fixture
def asked(node):
    return Asked(node)


@pytest.mark.parametrize('frame, remedy', [
    ('camera', "or set frame_id to 'camera'"),
    ('', 'has no frame_id: let the driver set it, or set camera_in_base')])
def test_an_unknown_camera_is_explained(asked, frame, remedy):
    extrinsics = Extrinsics(asked, NodeSettings())
    with pytest.raises(InputError, match=remedy):
        extrinsics.camera_in_base(frame, 0, wait=False)


def test_a_very_long_name_leaves_the_sentence_short(asked):
    extrinsics = Extrinsics(asked, NodeSettings())
    for find in (lambda: extrinsics.camera_in_base('x' * 10 ** 6, 0, wait=False),
                 lambda: extrinsics.depth_in_colour('y' * 10 ** 6, 'x' * 10 ** 6, 0, wait=False)):
        with pytest.raises(InputError, match='^no transform .* .xxx.* yet: .*or set ') as error:
            find()
        assert len(str(error.value)) < 2000


def test_transforms_are_asked_for_from_the_camera_to_the_base_and_at_the_stamp(asked, tell_tf):
    tell_tf({('body', 'camera'): at(0.5), ('camera', 'ir'): at(0.7)})
    extrinsics = Extrinsics(asked, NodeSettings(frame_id='body', wait_for_transform=0.7))
    for wait, how in (((), (0.7,)), ((True,), (0.7,)), ((False,), (0.0, LARGEST_GAP))):
        np.testing.assert_array_equal(
            extrinsics.camera_in_base('camera', 5, *wait).T_base_camera, at(0.5))
        np.testing.assert_array_equal(extrinsics.depth_in_colour('camera', 'ir', 6, *wait),
                                      at(0.7))
        assert asked.asked[-2:] == [('body', 'camera', 5, *how), ('camera', 'ir', 6, *how)]


def test_a_head_that_turns_will_be_known_but_is_not_yet(asked, tell_tf):
    """A frame is taken from the queue, and waits for /tf to reach its stamp."""
    extrinsics = Extrinsics(asked, NodeSettings(wait_for_transform=0.0))
    with pytest.raises(InputError, match='no transform'):
        extrinsics.camera_in_base('camera', 0, wait=False)
    asked.tend()
    for tenths in range(10):
        tell_tf({('base_link', 'camera'): at(0.1 * tenths)}, '/tf', 10 ** 9 + tenths * 10 ** 8)
    np.testing.assert_array_equal(
        extrinsics.camera_in_base('camera', 2 * 10 ** 9, wait=False).T_base_camera, at(0.1 * 9))
    with pytest.raises(InputError, match="'camera' to 'base_link' moves, .* 0.100 s from"):
        extrinsics.camera_in_base('camera', 2 * 10 ** 9)


def test_a_parameter_is_a_pose_of_metres_and_a_quaternion():
    """A quarter turn about z, x to y, and the place; TF is not asked."""
    half = 0.5 ** 0.5
    extrinsics = Extrinsics(None, NodeSettings(
        camera_in_base=(1.0, 2.0, 3.0, 0.0, 0.0, half, half),
        depth_in_colour=(0.0, 0.0, -1.0, half, 0.0, 0.0, half)))
    np.testing.assert_allclose(extrinsics.camera_in_base('', 0).T_base_camera @ [1, 0, 0, 1],
                               [1, 3, 3, 1], atol=1e-12)
    np.testing.assert_allclose(extrinsics.depth_in_colour('', '', 0) @ [0, 1, 0, 1],
                               [0, 0, 0, 1], atol=1e-12)


def test_a_camera_is_fixed_by_a_parameter_or_by_fixed_links(asked, tell_tf):
    by_tf = Extrinsics(asked, NodeSettings(frame_id='body', wait_for_transform=0.0))
    with pytest.raises(InputError):
        by_tf.camera_in_base('head', 0)
    asked.tend()
    tell_tf({('body', 'camera'): at(0.5)})
    tell_tf({('body', 'head'): at(0.5)}, '/tf', 5)
    for _ in range(2):  # looked up, and known
        assert by_tf.camera_in_base('camera', 5).mount is Mount.FIXED
        assert by_tf.camera_in_base('head', 5).mount is Mount.MOVING
    by_parameter = Extrinsics(asked, NodeSettings(camera_in_base=(0.0,) * 6 + (1.0,)))
    assert by_parameter.camera_in_base('head', 5).mount is Mount.FIXED


def test_nobody_can_change_the_pose_that_others_get_too(asked, tell_tf):
    tell_tf({('base_link', 'camera'): at(0.5), ('camera', 'ir'): at(0.7)})
    known = NodeSettings(camera_in_base=(1, 2, 3, 0, 0, 0, 1),
                         depth_in_colour=(4, 5, 6, 0, 0, 0, 1))
    for extrinsics in (Extrinsics(asked, NodeSettings()), Extrinsics(asked, known)):
        for _ in range(2):  # the second time it is known
            for pose in (extrinsics.camera_in_base('camera', 0).T_base_camera,
                         extrinsics.depth_in_colour('camera', 'ir', 0)):
                with pytest.raises(ValueError, match='read-only'):
                    pose[0, 3] = 9.0


def test_an_unknown_transform_is_explained_in_a_sentence(asked):
    extrinsics = Extrinsics(asked, NodeSettings(frame_id='body'))
    with pytest.raises(InputError) as caught:
        extrinsics.camera_in_base('camera', 0)
    assert str(caught.value) == (
        "no transform from 'camera' (the colour image) to 'body' (frame_id) yet: "
        f"{TF_REMEDY}, or set camera_in_base, or set frame_id to 'camera'")
    with pytest.raises(InputError) as caught:
        extrinsics.depth_in_colour('camera', 'ir', 0)
    assert str(caught.value) == (
        "no transform from 'ir' (the depth image) to 'camera' (the colour image) yet: "
        f'{TF_REMEDY}, or set depth_in_colour')


@pytest.mark.parametrize('numbers', [
    (1.0, 2.0, 3.0), (0.0,) * 7, (0.0,) * 3 + (1.0,) * 5, (math.nan,) + (0.0,) * 5 + (1.0,)])
def test_numbers_that_are_no_pose_are_explained(numbers):
    with pytest.raises(InputError) as caught:
        Extrinsics(None, NodeSettings(depth_in_colour=numbers))
    assert str(caught.value) == (f'depth_in_colour = {list(numbers)} is no pose: x y z qx qy qz '
                                 'qw are required')


def at(metres):
    pose = np.eye(4)
    pose[:3, 3] = metres * np.array([0.6, 0.0, -0.8])
    return pose


def test_a_camera_farther_away_than_any_machine_is_rejected_until_it_is_corrected(
        asked, tell_tf):
    tell_tf(dict.fromkeys([('base_link', 'camera'), ('camera', 'ir')], at(1.001 * MAX_EXTRINSIC)))
    extrinsics = Extrinsics(asked, NodeSettings())
    with pytest.raises(InputError, match="from 'camera' to 'base_link' is 1e.03 m long, at most"):
        extrinsics.camera_in_base('camera', 0)
    with pytest.raises(InputError, match="from 'ir' to 'camera' is .* check its publisher"):
        extrinsics.depth_in_colour('camera', 'ir', 0)
    found = at(0.999 * MAX_EXTRINSIC)
    tell_tf(dict.fromkeys([('base_link', 'camera'), ('camera', 'ir')], found))
    np.testing.assert_array_equal(extrinsics.camera_in_base('camera', 0).T_base_camera, found)
    np.testing.assert_array_equal(extrinsics.depth_in_colour('camera', 'ir', 0), found)


@pytest.mark.parametrize('name', ['camera_in_base', 'depth_in_colour'])
def test_a_parameter_in_millimetres_is_rejected(name):
    with pytest.raises(InputError, match=f'{name} = .* more than 1000 m away: its unit is metres'):
        Extrinsics(None, NodeSettings(**{name: [1200.0, 0, 0, 0, 0, 0, 1.0]}))


@pytest.mark.parametrize('axis', range(3))
def test_a_parameter_is_too_far_away_along_any_axis(axis):
    numbers = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    for sign in (1.0, -1.0):
        numbers[axis] = sign * 0.999 * MAX_EXTRINSIC
        known = Extrinsics(None, NodeSettings(camera_in_base=tuple(numbers)))
        assert known.camera_in_base('camera', 0).T_base_camera[axis, 3] == numbers[axis]
        numbers[axis] = sign * 1.001 * MAX_EXTRINSIC
        with pytest.raises(InputError, match='camera_in_base = .* more than 1000 m away'):
            Extrinsics(None, NodeSettings(camera_in_base=tuple(numbers)))


def test_exactly_as_far_as_is_possible_is_possible(asked, tell_tf):
    numbers = (0.0, -MAX_EXTRINSIC, 0.0, 0.0, 0.0, 0.0, 1.0)
    known = Extrinsics(None, NodeSettings(camera_in_base=numbers)).camera_in_base('camera', 0)
    assert known.T_base_camera[1, 3] == -MAX_EXTRINSIC
    tell_tf({('base_link', 'camera'): known.T_base_camera})
    np.testing.assert_array_equal(
        Extrinsics(asked, NodeSettings()).camera_in_base('camera', 0).T_base_camera,
        known.T_base_camera)
