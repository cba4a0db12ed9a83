# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A board that comes before a wall: what of it is in space that was free before."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.intruders import hidden_by_intruders, on_intruders
from aick_ros.settings import SensorSettings

CAMERA = Camera(160, 120, 150.0, 150.0, 79.5, 59.5)
WALL, BOARD, LAST = 2.0, 1.2, 80  # m, m, and the last column that the board hides
SENSOR = SensorSettings()
T_EARLIER_FRAME = se3.exp([0.05, -0.02, 0.1, 0.02, -0.03, 0.01])


def seen(board=0, wall=WALL, pose=np.eye(4)):
    """Return the depth image of a wall, with a board before its first columns, HxW [m]."""
    v, u = np.indices((CAMERA.height, CAMERA.width)).reshape(2, -1)
    rays = np.column_stack([CAMERA.normalize(np.column_stack([u, v]).astype(float)),
                            np.ones(u.size)]) @ pose[:3, :3].T
    depth = ((wall - pose[2, 3]) / rays[:, 2]).reshape(120, 160).astype(np.float32)
    depth[:, :board] = BOARD
    return depth


def view(depth, stamp=1):
    """Return a frame with keypoints all over its image."""
    v, u = np.mgrid[6:118:8, 4:158:8].reshape(2, -1)
    pixels, z = np.column_stack([u, v]).astype(np.float32), depth[v, u]
    has_depth = np.isfinite(z)
    positions = CAMERA.back_project(pixels[has_depth].astype(float), z[has_depth].astype(float))
    count, grey = len(positions), np.zeros(depth.shape, np.uint8)
    keypoints = KeypointFrame(
        stamp, positions, np.zeros((count, 32), np.uint8), np.tile(np.eye(3), (count, 1, 1)),
        pixels[has_depth])
    return PreparedFrame(RgbdFrame(stamp, grey, depth, CAMERA), keypoints, grey)


EARLIER = view(seen(), stamp=0)
PASSED = view(seen(board=LAST, pose=T_EARLIER_FRAME))


def test_keypoints_on_what_has_moved_in_are_those_before_free_space():
    """Wherever the camera has moved to; not where the earlier frame has not looked."""
    found = on_intruders(PASSED, EARLIER, T_EARLIER_FRAME, SENSOR)
    pixels = PASSED.keypoints.pixels
    places = CAMERA.project(se3.transform(T_EARLIER_FRAME, PASSED.keypoints.positions))
    inside = ((places > 3) & (places < (156, 116))).all(axis=1)
    assert found[inside & (pixels[:, 0] < LAST - 10)].all() and found.sum() > 80
    assert not found[pixels[:, 0] > LAST + 10].any()


@pytest.mark.parametrize('change', [
    {'board': 0}, {'board': 10}, {'board': LAST, 'wall': BOARD * 1.05}],
    ids=['none', 'few keypoints', 'hardly before the wall'])
def test_without_it_none_are(change):
    frame = view(seen(**change))
    earlier = view(seen(wall=change.get('wall', WALL)))
    assert not on_intruders(frame, earlier, np.eye(4), SENSOR).any()


def test_what_was_there_has_not_moved_in():
    still = view(seen(board=LAST))
    assert not on_intruders(PASSED, still, np.eye(4), SENSOR).any()


def test_an_edge_may_be_some_pixels_beside_where_it_was():
    """As where depth is taken later than colour: two pixels of 160."""
    assert not on_intruders(view(seen(board=LAST + 2)), view(seen(board=LAST)), np.eye(4),
                            SENSOR).any()


def test_nothing_is_known_where_the_earlier_frame_has_no_depth():
    blind = view(np.full((120, 160), np.nan, np.float32))
    assert not on_intruders(PASSED, blind, T_EARLIER_FRAME, SENSOR).any()


def test_what_is_behind_an_earlier_frame_is_not_in_its_view():
    behind = se3.exp([0, 0, -3.0, 0, 0, 0])
    assert not on_intruders(PASSED, EARLIER, behind, SENSOR).any()


def test_few_that_are_hidden_are_none():
    frame = view(seen(board=10))
    assert not hidden_by_intruders(frame, EARLIER, np.eye(4), SENSOR).any()


def test_keypoints_that_were_tracked_are_hidden_behind_it():
    tracked = dataclasses.replace(PASSED, is_tracked=True)
    hidden = hidden_by_intruders(tracked, EARLIER, T_EARLIER_FRAME, SENSOR)
    places = CAMERA.project(se3.transform(
        se3.inverse(T_EARLIER_FRAME), EARLIER.keypoints.positions))
    inside = ((places > 3) & (places < (156, 116))).all(axis=1)
    assert hidden[inside & (places[:, 0] < LAST - 5)].all() and hidden.sum() > 80
    assert not hidden[places[:, 0] > LAST + 5].any()
