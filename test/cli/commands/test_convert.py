# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings as bags that rosbags itself reads."""

import json

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from aick_ros.sources import open_source, raise_damage
from aick_ros.sources.writers.tum_writer import write_tum


@pytest.fixture
def folder(tmp_path, recording):
    """Return a TUM folder of the recording."""
    write_tum(tmp_path / 'tum', recording)
    return tmp_path / 'tum'


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_bag_has_images_calibration_and_ground_truth(aick, folder, recording, tmp_path, storage):
    outcome = aick('convert', folder, 'bag', '--storage', storage)
    assert (outcome.code, outcome.err) == (0, '')
    assert outcome.out == f'{len(recording)} frames in bag\n'
    with AnyReader([tmp_path / 'bag'],
                   default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        counts = {(connection.msgtype, connection.msgcount) for connection in reader.connections}
    assert counts == {
        ('sensor_msgs/msg/Image', len(recording)), ('sensor_msgs/msg/CameraInfo', len(recording)),
        ('geometry_msgs/msg/PoseStamped', len(recording.ground_truth))}
    for frame, expected in zip(open_source(tmp_path / 'bag').frames(raise_damage),
                               open_source(folder).frames(raise_damage), strict=True):
        assert (frame.stamp, frame.camera) == (expected.stamp, expected.camera)
        np.testing.assert_array_equal(frame.colour, expected.colour)
        np.testing.assert_array_equal(frame.depth, expected.depth)


def test_converts_a_part_in_millimetres(aick, folder, tmp_path):
    assert aick('convert', folder, 'bag', '--limit', '2', '--depth-encoding', '16UC1').code == 0
    frames = list(open_source(tmp_path / 'bag').frames(raise_damage))
    assert len(frames) == 2
    metres = frames[0].depth[np.isfinite(frames[0].depth)]
    np.testing.assert_allclose(1000 * metres, np.rint(1000 * metres), atol=1e-3)


def test_damaged_images_are_skipped(aick, folder, recording, tmp_path):
    colour = sorted((folder / 'rgb').iterdir())
    colour[2].write_bytes(b'no image')
    outcome = aick('convert', folder, 'bag')
    assert outcome.code == 2
    assert colour[2].name in outcome.err
    assert len(list(open_source(tmp_path / 'bag').frames(raise_damage))) == len(recording) - 1


def test_depth_is_registered_by_a_given_extrinsic(aick, folder, tmp_path):
    """Two cameras at one place, calibrated alike: nearly all depth stays where it is."""
    assert aick('convert', folder, 'bag').code == 0
    assert aick('convert', 'bag', 'registered', '--register-depth', '--depth-info-topic',
                '/camera/rgb/camera_info', '--depth-in-colour', 0, 0, 0, 0, 0, 0, 1).code == 0
    before, after = (next(open_source(tmp_path / name).frames(raise_damage))
                     for name in ('bag', 'registered'))
    assert not np.array_equal(before.depth, after.depth, equal_nan=True)
    np.testing.assert_allclose(np.nanmedian(after.depth), np.nanmedian(before.depth), rtol=0.05)
    outcome = aick('convert', 'bag', 'other', '--depth-in-colour', 0, 0, 0, 0, 0, 0, 1)
    assert outcome.code == 2
    assert '--depth-in-colour has no effect without --register-depth' in outcome.err


@pytest.mark.parametrize('arguments, words', [
    (['--storage', 'zip'], "no bag storage 'zip'"), (['--depth-encoding', 'mono8'], 'mono8')])
def test_unwritable_output_is_rejected(aick, folder, tmp_path, arguments, words):
    outcome = aick('convert', folder, 'bag', *arguments)
    assert outcome.code == 2
    assert words in outcome.sentence
    assert list(tmp_path.iterdir()) == [folder]


def test_calibration_can_be_given(aick, folder, tmp_path):
    fields = json.loads((folder / 'camera.json').read_text())
    fields['k'][0] = 300.0
    (tmp_path / 'mine.json').write_text(json.dumps(fields))
    assert aick('convert', folder, 'bag', '--camera', 'mine.json', '--limit', '1').code == 0
    frame = next(open_source(tmp_path / 'bag').frames(raise_damage))
    assert frame.camera.fx == 300.0
