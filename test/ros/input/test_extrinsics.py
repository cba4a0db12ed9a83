# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Poses of cameras that are not known: which frames are missing, and what to do."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.borders.limits import MAX_EXTRINSIC
from aick_ros.errors import InputError
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.settings.node import NodeSettings


@pytest.mark.parametrize('frame, remedy', [
    ('camera', "or set frame_id to 'camera'"),
    ('', 'has no frame_id: let the driver set it, or set camera_in_base')])
def test_an_unknown_camera_is_explained(frame, remedy):
    extrinsics = Extrinsics(SimpleNamespace(find=lambda *_: None), NodeSettings())
    with pytest.raises(InputError, match=remedy):
        extrinsics.camera_in_base(frame, 0, wait=False)


def at(metres):
    pose = np.eye(4)
    pose[:3, 3] = metres * np.array([0.6, 0.0, -0.8])
    return pose


def test_a_camera_farther_away_than_any_machine_is_rejected_until_it_is_corrected():
    found = at(1.001 * MAX_EXTRINSIC)
    extrinsics = Extrinsics(SimpleNamespace(find=lambda *_: found), NodeSettings())
    with pytest.raises(InputError, match="from 'camera' to 'base_link' is 1e.03 m long, at most"):
        extrinsics.camera_in_base('camera', 0)
    with pytest.raises(InputError, match="from 'ir' to 'camera' is .* check its publisher"):
        extrinsics.depth_in_colour('camera', 'ir', 0)
    found = at(0.999 * MAX_EXTRINSIC)
    np.testing.assert_array_equal(extrinsics.camera_in_base('camera', 0), found)
    np.testing.assert_array_equal(extrinsics.depth_in_colour('camera', 'ir', 0), found)


@pytest.mark.parametrize('name', ['camera_in_base', 'depth_in_colour'])
def test_a_parameter_in_millimetres_is_rejected(name):
    with pytest.raises(InputError, match=f'{name} = .* more than 1000 m away: its unit is metres'):
        Extrinsics(SimpleNamespace(), NodeSettings(**{name: [1200.0, 0, 0, 0, 0, 0, 1.0]}))


@pytest.mark.parametrize('axis', range(3))
def test_a_parameter_is_too_far_away_along_any_axis(axis):
    numbers = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    for sign in (1.0, -1.0):
        numbers[axis] = sign * 0.999 * MAX_EXTRINSIC
        known = Extrinsics(SimpleNamespace(), NodeSettings(camera_in_base=tuple(numbers)))
        assert known.camera_in_base('camera', 0)[axis, 3] == numbers[axis]
        numbers[axis] = sign * 1.001 * MAX_EXTRINSIC
        with pytest.raises(InputError, match='camera_in_base = .* more than 1000 m away'):
            Extrinsics(SimpleNamespace(), NodeSettings(camera_in_base=tuple(numbers)))
