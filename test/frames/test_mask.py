# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a mask hides is gone from depth, brightness and keypoints; the rest stays as it is."""

import copy
import dataclasses
import pickle
import time

import cv2
import numpy as np
import pytest

from aick_ros.borders.records import replaced
from aick_ros.errors import InputError
from aick_ros.features.detector import Features
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.frames.mask import ImageMask, mask_of
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.settings import FeatureSettings, SensorSettings, Settings

RNG = np.random.default_rng(4)
MASK = np.full((48, 64), 255, np.uint8)
MASK[24:, 32:] = 0
HIDDEN = MASK == 0


def frame_of(columns=64, rows=48, channels=(3,)):
    return RgbdFrame(7, RNG.integers(0, 256, (rows, columns, *channels), np.uint8),
                     RNG.uniform(1.0, 3.0, (rows, columns)).astype(np.float32),
                     Camera(columns, rows, 50.0, 50.0, columns / 2, rows / 2))


def saved(path, image=MASK):
    cv2.imwrite(str(path), image)
    return SensorSettings(mask=str(path))


@pytest.mark.parametrize('channels', [(3,), ()])
def test_what_is_hidden_has_no_depth_and_the_brightness_beside_it(channels):
    frame, mask = frame_of(channels=channels), ImageMask(MASK)
    masked = mask.applied(frame)
    assert np.isnan(masked.depth[HIDDEN]).all()
    np.testing.assert_array_equal(masked.depth[~HIDDEN], frame.depth[~HIDDEN])
    np.testing.assert_array_equal(masked.grey[~HIDDEN], frame.grey[~HIDDEN])
    shown = np.argwhere(~HIDDEN)
    for row, column in RNG.choice(np.argwhere(HIDDEN), 20):
        distances = np.linalg.norm(shown - (row, column), axis=1)
        near = shown[distances < distances.min() + 1.0]  # OpenCV's distances are approximate
        assert masked.grey[row, column] in frame.grey[tuple(near.T)]
    np.testing.assert_array_equal(masked.colour, frame.colour)
    assert not np.isnan(frame.depth).any()
    assert not masked.depth.flags.writeable and not masked.grey.flags.writeable


def test_what_is_hidden_makes_no_difference():
    frame, mask = frame_of(), ImageMask(MASK)
    other = dataclasses.replace(frame_of(), camera=frame.camera)
    mixed = dataclasses.replace(
        frame, colour=np.where(HIDDEN[..., None], other.colour, frame.colour),
        depth=np.where(HIDDEN, other.depth, frame.depth))
    found, expected = mask.applied(mixed), mask.applied(frame)
    np.testing.assert_array_equal(found.grey, expected.grey)
    np.testing.assert_array_equal(found.depth, expected.depth)


@pytest.mark.parametrize('replace', [dataclasses.replace, replaced])
def test_a_masked_frame_stays_so_with_other_images_or_another_stamp(replace):
    frame, mask = frame_of(), ImageMask(MASK)
    masked = mask.applied(frame)
    other = dataclasses.replace(frame_of(), camera=frame.camera)
    moved = replace(masked, stamp=8, colour=other.colour)
    np.testing.assert_array_equal(moved.grey, mask.applied(other).grey)
    np.testing.assert_array_equal(moved.depth, masked.depth)
    bare = replace(masked, colour=masked.grey)
    np.testing.assert_array_equal(bare.grey, masked.grey)
    pixels = np.indices((64, 48)).reshape(2, -1).T
    np.testing.assert_array_equal(moved.shows(pixels), masked.shows(pixels))


@pytest.mark.parametrize('channels', [(3,), ()])
def test_colours_of_what_is_hidden_can_be_removed(channels):
    frame, mask = frame_of(channels=channels), ImageMask(MASK)
    masked = mask.applied(frame)
    plain = masked.without_colour()
    colour = np.where(HIDDEN.reshape(48, 64, *len(channels) * (1,)), 7, frame.colour)
    other = mask.applied(dataclasses.replace(frame, colour=colour.astype(np.uint8)))
    np.testing.assert_array_equal(plain.colour, other.without_colour().colour)
    np.testing.assert_array_equal(plain.colour[~HIDDEN], frame.colour[~HIDDEN])
    np.testing.assert_array_equal(plain.grey, masked.grey)
    np.testing.assert_array_equal(plain.depth, masked.depth)


def test_a_copy_hides_the_same():
    frame, mask = frame_of(), ImageMask(MASK, (0.1, 0.0, 0.0, 0.0), 'body')
    expected = mask.applied(frame)
    for copy_ in (pickle.loads(pickle.dumps(mask)), copy.deepcopy(mask)):
        np.testing.assert_array_equal(copy_.applied(frame).depth, expected.depth)
        assert copy_.digest == mask.digest
    assert len({mask.digest, ImageMask(MASK).digest, ImageMask(np.flipud(MASK)).digest,
                ImageMask(MASK.reshape(64, 48)).digest, ImageMask(None).digest}) == 5


def test_a_masked_frame_is_masked_by_another_one_too():
    frame = frame_of()
    both = ImageMask(np.flipud(MASK)).applied(ImageMask(MASK).applied(frame))
    np.testing.assert_array_equal(np.isnan(both.depth), HIDDEN | np.flipud(HIDDEN))


def test_a_mask_is_scaled_to_images_of_its_shape():
    mask = ImageMask(MASK)
    for columns, rows in ((128, 96), (64, 48), (32, 24), (33, 25)):
        masked = mask.applied(frame_of(columns, rows))
        expected = np.zeros((rows, columns), bool)
        expected[-(-rows // 2):, -(-columns // 2):] = True
        assert (np.isnan(masked.depth) != expected).sum() <= (
            0 if columns % 2 == 0 else rows + columns)


@pytest.mark.parametrize('columns, rows', [(64, 64), (80, 48), (64, 36)])
def test_images_of_another_shape_are_rejected(tmp_path, columns, rows):
    mask = mask_of(saved(tmp_path / 'm.png'))
    with pytest.raises(InputError) as raised:
        mask.applied(frame_of(columns, rows))
    assert str(raised.value) == (
        f'the mask {tmp_path}/m.png (sensor.mask) has 64 x 48 pixels and the images {columns} x '
        f'{rows}: it must have their size, or the same ratio of width to height; draw it on an '
        'image of the camera, and save it as PNG with one channel of 8 bits')


def test_shares_of_the_image_are_hidden_like_a_mask(tmp_path):
    sides = mask_of(SensorSettings(roi_ratios=(0.25, 0.125, 0.5, 0.0)))
    hidden = np.isnan(sides.applied(frame_of()).depth)
    assert not hidden[24:, 16:56].any()
    assert hidden.sum() == 64 * 48 - 24 * 40
    masked = saved(tmp_path / 'm.png')
    both = mask_of(dataclasses.replace(masked, roi_ratios=(0.25, 0.0, 0.0, 0.0)))
    hidden = np.isnan(both.applied(frame_of()).depth)
    assert hidden.sum() == HIDDEN.sum() + 16 * 48
    none = mask_of(dataclasses.replace(masked, roi_ratios=(0.5, 0.0, 0.5, 0.0)))
    with pytest.raises(InputError, match='hide all of an image of 64 x 48 pixels: hide less'):
        none.applied(frame_of())


@pytest.mark.parametrize('settings', [
    SensorSettings(), SensorSettings(roi_ratios=(0.0, 0.0, 0.0, 0.0))])
def test_without_one_there_is_none(settings):
    assert mask_of(settings) is None


def test_a_mask_that_hides_nothing_changes_nothing():
    frame = frame_of()
    assert ImageMask(np.full((48, 64), 1, np.uint8)).applied(frame) is frame


class Everywhere:
    """A detector that finds a keypoint at each pixel, whatever it shows."""

    def detect(self, grey):
        v, u = np.indices(grey.shape)
        pixels = np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float32)
        ones = np.ones(len(pixels), np.float32)
        return Features(pixels, np.zeros((len(pixels), 32), np.uint8), ones, ones)


def test_keypoints_are_neither_hidden_nor_at_the_edge_of_the_mask(tmp_path):
    settings = saved(tmp_path / 'm.png')
    every = FeatureSettings(max_keypoints=0)
    frame = dataclasses.replace(frame_of(), depth=np.full((48, 64), 2.0, np.float32))
    found = KeypointExtractor(every, settings, detector=Everywhere()).extract(frame)
    u, v = found.pixels.astype(int).T
    taken = np.zeros((48, 64), bool)
    taken[v, u] = True
    near = cv2.dilate(HIDDEN.astype(np.uint8), np.ones((15, 15), np.uint8)) > 0
    np.testing.assert_array_equal(taken, ~near)
    without = KeypointExtractor(every, SensorSettings(), detector=Everywhere()).extract(frame)
    assert len(without) == 48 * 64


def test_a_file_that_has_changed_is_read_again_and_any_other_once(tmp_path):
    settings = saved(tmp_path / 'm.png')
    before = mask_of(settings)
    assert mask_of(SensorSettings(mask=settings.mask, max_depth=5.0)) is before
    time.sleep(0.02)  # longer than the clock of the file system takes
    saved(tmp_path / 'm.png', np.flipud(MASK))
    assert np.isnan(mask_of(settings).applied(frame_of()).depth[0, -1])


@pytest.mark.parametrize('make, words', [
    (lambda path: None, 'cannot read the mask .*: No such file or directory; name a PNG file'),
    (lambda path: path.mkdir(), 'cannot read the mask .*: Is a directory; name a PNG file that'),
    (lambda path: path.write_bytes(b'text'), 'is no PNG image: draw it'),
    (lambda path: path.write_bytes(b''), 'is no PNG image: draw it'),
    (lambda path: path.write_bytes(cv2.imencode('.png', MASK)[1].tobytes()[:-20]),
     r'\(sensor.mask\) cannot be read: its .* bytes of PNG data are truncated: copy or'),
    (lambda path: saved(path, np.zeros((48, 64, 3), np.uint8)), 'has 3 channels of uint8: draw'),
    (lambda path: saved(path, np.zeros((48, 64), np.uint16)), 'has 1 channel of uint16: draw'),
    (lambda path: saved(path, 0 * MASK), 'is 0 everywhere'),
    (lambda path: path.write_bytes(cv2.imencode('.jpg', MASK)[1].tobytes()), 'is a JPEG image')])
def test_a_file_that_is_no_mask_is_named(tmp_path, make, words):
    make(tmp_path / 'm.png')
    with pytest.raises(InputError, match=words) as raised:
        KeypointExtractor(Settings().features, SensorSettings(mask=str(tmp_path / 'm.png')))
    assert str(tmp_path / 'm.png') in str(raised.value)
    assert 'sensor.mask' in str(raised.value)


def test_errors_name_the_option_that_gave_the_mask(tmp_path):
    """Also where another one has named the same file before."""
    settings = saved(tmp_path / 'm.png', np.zeros((48, 64, 3), np.uint8))
    for name in ('sensor.mask', '--mask'):
        with pytest.raises(InputError, match=rf'm.png \({name}\) has 3 channels'):
            mask_of(settings, name)
    saved(tmp_path / 'm.png')
    mask_of(settings)
    with pytest.raises(InputError, match=r'm.png \(--mask\) has 64 x 48 pixels and the images'):
        mask_of(settings, '--mask').applied(frame_of(40, 70))
    with pytest.raises(InputError, match=r'cannot read the mask \(--mask\) .*none.png'):
        mask_of(SensorSettings(mask=str(tmp_path / 'none.png')), '--mask')


def test_a_name_that_no_file_can_have_is_rejected():
    with pytest.raises(InputError, match=r'cannot read the mask \(sensor.mask\) .*; name a PNG'):
        mask_of(SensorSettings(mask='a\0b'))


def test_a_relative_path_is_named_as_a_whole(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as raised:
        mask_of(SensorSettings(mask='m.png'))
    assert str(raised.value) == (
        f'cannot read the mask (sensor.mask) {tmp_path}/m.png: No such file or directory; name a '
        'PNG file that can be read, or none to use all of the images')
    saved(tmp_path / 'm.png')
    assert mask_of(SensorSettings(mask='m.png')) is not None


def test_the_home_folder_is_filled_in(tmp_path, monkeypatch):
    saved(tmp_path / 'm.png')
    monkeypatch.setenv('HOME', str(tmp_path))
    assert mask_of(SensorSettings(mask='~/m.png')) is not None
