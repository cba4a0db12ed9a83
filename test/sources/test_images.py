# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Folders of numbered images: against what was put into them, and how they can be bad."""

import shutil
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np
import pytest

from aick_ros.borders.limits import MAX_DISTANCE
from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import MAX_STAMP
from aick_ros.sources import SourceOptions, raise_damage
from aick_ros.sources.images import START, ImagesSource

RNG = np.random.default_rng(7)
COLOURS = RNG.integers(0, 256, (4, 24, 32, 3), np.uint8)
DEPTHS = RNG.integers(0, 9000, (4, 24, 32), np.uint16)
DEPTHS[:, 0, :3] = 0, 65535, 65534
POSES = [se3.exp(RNG.normal(0, 1, 6)) for _ in range(4)]
NUMBERS = (0, 1, 2, 5)
INTRINSICS = '30.5 0 15.5\n0 30.25 11.5\n0 0 1\n'


def write(folder, number, index):
    cv2.imwrite(str(folder / f'frame-{number:06d}.color.png'), COLOURS[index, :, :, ::-1])
    cv2.imwrite(str(folder / f'frame-{number:06d}.depth.png'), DEPTHS[index])
    np.savetxt(folder / f'frame-{number:06d}.pose.txt', POSES[index], '%.8e', '\t')


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / 'chess' / 'seq-01'
    folder.mkdir(parents=True)
    for index, number in enumerate(NUMBERS):
        write(folder, number, index)
    (folder / 'camera-intrinsics.txt').write_text(INTRINSICS)
    (folder / 'Thumbs.db').write_text('something else')
    return folder


def read(source):
    damage = []
    return list(source.frames(damage.append)), [str(error) for error in damage]


def test_frames_come_back(folder):
    source = ImagesSource(folder)
    assert source.name == 'seq-01'
    assert len(source) == 4
    for _ in range(2):
        frames = list(source.frames(raise_damage))
        assert len(frames) == 4
        for frame, colour, units in zip(frames, COLOURS, DEPTHS):
            metres = np.where(np.isin(units, (0, 65535)), np.nan, units / 1000)
            assert np.array_equal(frame.colour, colour)
            assert np.array_equal(frame.depth, metres.astype(np.float32), equal_nan=True)
            assert frame.camera == Camera(32, 24, 30.5, 30.25, 15.5, 11.5)


def test_stamps_follow_the_numbers_at_30_hz(folder):
    stamps = [frame.stamp for frame in ImagesSource(folder).frames(raise_damage)]
    assert stamps[0] > 0
    seconds = (np.array(stamps) - stamps[0]) / 1e9
    assert np.allclose(seconds, np.array(NUMBERS) / 30, atol=2e-9)
    assert stamps == [START + round(Fraction(number * 10 ** 9, 30)) for number in NUMBERS]


def test_the_stamps_of_large_numbers_have_no_error_that_adds_up(folder):
    write(folder, 300_000, 0)
    *_, last = ImagesSource(folder).frames(raise_damage)
    assert last.stamp == START + 10_000 * 10 ** 9


def test_ground_truth_is_at_the_frames(folder):
    source = ImagesSource(folder)
    for frame, pose in zip(source.frames(raise_damage), POSES):
        assert np.allclose(source.ground_truth.at(frame.stamp), pose, atol=1e-7)
    rotations = source.ground_truth.poses[:, :3, :3]
    assert np.allclose(rotations @ rotations.transpose(0, 2, 1), np.eye(3), atol=1e-14)


def test_jpeg_is_read(folder):
    (folder / 'frame-000000.color.png').unlink()
    bgr = np.full((24, 32, 3), (200, 90, 40), np.uint8)
    cv2.imwrite(str(folder / 'frame-000000.color.jpg'), bgr)
    frame = next(ImagesSource(folder).frames(raise_damage))
    assert np.allclose(frame.colour, (40, 90, 200), atol=4)


def test_intrinsics_may_lie_above(folder):
    shutil.move(folder / 'camera-intrinsics.txt', folder.parent)
    assert next(ImagesSource(folder).frames(raise_damage)).camera.fx == 30.5


def test_poses_are_optional_and_invalid_ones_are_skipped(folder):
    np.savetxt(folder / 'frame-000001.pose.txt', np.full((4, 4), -np.inf))
    source = ImagesSource(folder)
    assert len(source.ground_truth) == 3
    for path in folder.glob('*.pose.txt'):
        path.unlink()
    assert ImagesSource(folder).ground_truth is None


@pytest.mark.parametrize('text, reason', [
    ('1 2 3', 'cannot read 4 rows of 4 numbers'), ('a ' * 16, 'cannot read'),
    ('2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1', 'not orthonormal')])
def test_damaged_poses_are_named(folder, text, reason):
    (folder / 'frame-000002.pose.txt').write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        ImagesSource(folder).ground_truth
    assert 'frame-000002.pose.txt' in str(caught.value)


def test_calibration_may_be_json_above_or_given(folder, tmp_path):
    json = '{"width": 32, "height": 24, "k": [%d, 0, 16, 0, 9, 12, 0, 0, 1]}'
    (folder / 'camera-intrinsics.txt').unlink()
    (folder.parent / 'camera.json').write_text(json % 8)
    assert next(ImagesSource(folder).frames(raise_damage)).camera.fx == 8
    (tmp_path / 'mine.json').write_text(json % 9)
    source = ImagesSource(folder, SourceOptions(camera=tmp_path / 'mine.json'))
    assert next(source.frames(raise_damage)).camera.fx == 9


def test_a_missing_calibration_says_how_to_give_one(folder):
    (folder / 'camera-intrinsics.txt').unlink()
    with pytest.raises(InputError, match=(
            'has no calibration: put one into the folder .* with --camera FILE .*, or as '
            r'camera-intrinsics.txt with three rows \(7-Scenes: 585 0 320 / '
            r'0 585 240 / 0 0 1\)$')):
        ImagesSource(folder)


@pytest.mark.parametrize('text, reason', [
    ('1 2 3', 'cannot read 3 rows of 3 numbers'), ('0 ' * 9, 'no positive focal lengths'),
    ('nan ' * 9, 'no positive focal lengths')])
def test_damaged_intrinsics_are_named(folder, text, reason):
    (folder / 'camera-intrinsics.txt').write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        ImagesSource(folder)
    assert 'camera-intrinsics.txt' in str(caught.value)


@pytest.mark.parametrize('kind', ['color', 'depth'])
def test_a_missing_kind_is_named(folder, kind):
    for path in folder.glob(f'*.{kind}.png'):
        path.unlink()
    with pytest.raises(InputError, match=(
            f'no frame-000000.{kind}.png: a folder of numbered images '
            'has both colour and depth$')):
        ImagesSource(folder)


def test_a_damaged_image_is_reported_and_the_next_one_read(folder):
    broken = folder / 'frame-000000.color.png'
    broken.write_bytes(broken.read_bytes()[:200])
    (folder / 'frame-000001.depth.png').unlink()
    cv2.imwrite(str(folder / 'frame-000002.depth.png'), np.ones((12, 16), np.uint16))
    frames, damage = read(ImagesSource(folder))
    assert len(frames) == 1 and np.array_equal(frames[0].colour, COLOURS[3])
    assert len(damage) == 3
    assert str(broken) in damage[0] and 'truncated' in damage[0]
    assert damage[1].endswith('has no frame-000001.depth.png beside it')
    assert 'frame-000002' in damage[2] and 'depth 16 x 12 pixels' in damage[2]


@pytest.mark.parametrize('digits', [12, 30])
def test_numbers_without_a_stamp_are_rejected(folder, digits):
    write(folder, int('9' * digits), 0)
    with pytest.raises(InputError, match='has the number 9+: at most .* renumber the files'):
        ImagesSource(folder)


@pytest.mark.parametrize('place, number', [((0, 3), 1e300), ((0, 0), 1e300), ((2, 3), -2e8)])
def test_poses_out_of_range_are_named(folder, place, number):
    pose = np.eye(4)
    pose[place] = number
    np.savetxt(folder / 'frame-000001.pose.txt', pose)
    with pytest.raises(InputError, match='frame-000001.pose.txt is not a pose'):
        ImagesSource(folder).ground_truth


@pytest.mark.parametrize('beyond', [0, 1])
def test_the_last_number_has_the_last_stamp(folder, beyond):
    """At 30 Hz from a second on, and before the end of what a stamp can be."""
    last = (2 ** 31 - 1) * 30 - 1
    assert START + last * 10 ** 9 // 30 <= MAX_STAMP < START + (last + 1) * 10 ** 9 // 30
    write(folder, last + beyond, 0)
    if beyond:
        with pytest.raises(InputError) as raised:
            ImagesSource(folder)
        assert str(raised.value) == (
            f'{folder}/frame-{last + 1}.color.png has the number {last + 1}: at most {last} has a '
            'stamp at 30 Hz; renumber the files')
    else:
        *_, frame = ImagesSource(folder).frames(raise_damage)
        assert frame.stamp <= MAX_STAMP


def test_a_calibration_in_the_folder_comes_before_those_above_and_json_before_numbers(folder):
    json = '{"width": 32, "height": 24, "k": [%d, 0, 16, 0, 9, 12, 0, 0, 1]}'
    (folder.parent / 'camera.json').write_text(json % 8)
    assert next(ImagesSource(folder).frames(raise_damage)).camera.fx == 30.5
    (folder / 'camera.json').write_text(json % 7)
    assert next(ImagesSource(folder).frames(raise_damage)).camera.fx == 7


@pytest.mark.parametrize('stretch, is_pose', [(1.004, True), (1.006, False), (0.994, False)])
def test_rotations_of_a_few_digits_are_poses(folder, stretch, is_pose):
    """The products of their rows are off by up to a hundredth."""
    pose = np.diag([stretch, 1.0, 1.0, 1.0])
    np.savetxt(folder / 'frame-000001.pose.txt', pose)
    if is_pose:
        assert len(ImagesSource(folder).ground_truth) == 4
    else:
        with pytest.raises(InputError, match='its rotation is not orthonormal'):
            ImagesSource(folder).ground_truth


@pytest.mark.parametrize('number', [MAX_DISTANCE, -MAX_DISTANCE])
def test_the_largest_distance_of_a_pose_is_within(folder, number):
    pose = np.eye(4)
    pose[1, 3] = number
    np.savetxt(folder / 'frame-000001.pose.txt', pose, '%.17g')
    assert ImagesSource(folder).ground_truth.poses[1, 1, 3] == number
    pose[1, 3] = np.nextafter(number, 2 * number)
    np.savetxt(folder / 'frame-000001.pose.txt', pose, '%.17g')
    with pytest.raises(InputError, match=r'-000001.pose.txt is not a pose: it is beyond 1e\+08'):
        ImagesSource(folder).ground_truth


def test_the_whole_path_of_numbers_is_named(folder):
    (folder / 'camera-intrinsics.txt').write_text('1 2 3')
    with pytest.raises(InputError) as raised:
        ImagesSource(folder)
    assert str(raised.value).startswith(
        f'cannot read 3 rows of 3 numbers from {folder}/camera-intrinsics.txt: ')


@pytest.mark.parametrize('k', ['-30 0 15\n0 30 11\n0 0 1', '30 0 15\n0 0 11\n0 0 1'])
def test_both_focal_lengths_are_positive(folder, k):
    (folder / 'camera-intrinsics.txt').write_text(k)
    with pytest.raises(InputError, match='no positive focal lengths: required are fx 0 cx / 0 fy '
                                         'cy / 0 0 1$'):
        ImagesSource(folder)


@pytest.mark.parametrize('name', [
    'frame-000009.color.png.txt', 'frame-.color.png', 'frame-000009.depth.jpg',
    'frame-000009.pose', 'xframe-000009.color.png', 'frame-000009.colour.png'])
def test_other_names_are_no_images(folder, name):
    (folder / name).write_text('something else')
    assert len(list(ImagesSource(folder).frames(raise_damage))) == 4


def test_the_folder_above_is_known_by_a_relative_path_too(folder, monkeypatch):
    shutil.move(folder / 'camera-intrinsics.txt', folder.parent)
    monkeypatch.chdir(folder)
    source = ImagesSource(Path('.'))
    assert source.name == 'seq-01'
    assert next(source.frames(raise_damage)).camera.fx == 30.5
