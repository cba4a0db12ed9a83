# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""TUM folders: against the frames they were made of, and each way in which one can be bad."""

import shutil

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry.trajectory import stamp_to_seconds
from aick_ros.sources import SourceOptions, raise_damage
from aick_ros.sources.calibration import HOW_TO_GIVE
from aick_ros.sources.tum import CAMERAS, TumSource


def read(source):
    """Return the frames and the damage that was reported."""
    damage = []
    return list(source.frames(damage.append)), [str(error) for error in damage]


def edit(path, change):
    path.write_text(change(path.read_text()))


def test_frames_come_back(recorded_folder, recording, assert_same_frames):
    source = TumSource(recorded_folder)
    assert source.name == 'rgbd_dataset_freiburg2_small'
    assert source.ground_truth is None
    assert len(source) == 6
    for _ in range(2):
        assert_same_frames(list(source.frames(raise_damage)), recording.recorded)


def test_ground_truth_is_read(recorded_folder):
    (recorded_folder / 'groundtruth.txt').write_text('# t\n1.5 1 2 3 0 0 0 1\n2.5 4 5 6 0 0 1 0\n')
    truth = TumSource(recorded_folder).ground_truth
    assert truth.stamps.tolist() == [1_500_000_000, 2_500_000_000]
    assert truth.poses[1].tolist() == [[-1, 0, 0, 4], [0, -1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]


def test_ground_truth_that_is_a_link_to_nowhere_is_not_taken_for_none(recorded_folder):
    (recorded_folder / 'groundtruth.txt').symlink_to('nowhere.txt')
    with pytest.raises(InputError, match='groundtruth.txt: No such file'):
        TumSource(recorded_folder).ground_truth


@pytest.mark.parametrize('name', ['rgb.txt', 'depth.txt'])
def test_comments_may_be_indented(recorded_folder, name):
    count = len(TumSource(recorded_folder))
    path = recorded_folder / name
    path.write_text(f'  # an indented comment\n\t#\n{path.read_text()}')
    assert len(TumSource(recorded_folder)) == count


def test_damaged_ground_truth_names_file_and_line(recorded_folder):
    (recorded_folder / 'groundtruth.txt').write_text('# t\n1.5 1 2 3 0 0 0 1\n2.5 4 5\n')
    with pytest.raises(InputError, match='groundtruth.txt, line 3'):
        TumSource(recorded_folder).ground_truth


def test_association_is_the_classical_one(real_folder):
    def stamps(name):
        return [round(float(line.split()[0]) * 1e6) * 1000
                for line in (real_folder / name).read_text().splitlines() if line[0] != '#']

    colour, depth = stamps('rgb.txt'), stamps('depth.txt')
    candidates = sorted((abs(c - d), c, d) for c in colour for d in depth if abs(c - d) < 2e7)
    pairs = {}
    for _, c, d in candidates:
        if c not in pairs and d not in pairs.values():
            pairs[c] = d
    frames = list(TumSource(real_folder).frames(raise_damage))
    assert [(frame.stamp, frame.depth_stamp) for frame in frames] == sorted(pairs.items())


def test_real_frames_are_those_in_the_files(real_folder):
    source = TumSource(real_folder)
    frame = next(source.frames(raise_damage))
    files = [line.split()[1] for line in (real_folder / 'rgb.txt').read_text().splitlines()
             if f'{frame.stamp // 1000 / 1e6:.6f}' in line]
    assert np.array_equal(frame.colour[:, :, ::-1], cv2.imread(str(real_folder / files[0])))
    assert frame.camera == CAMERAS['1']
    assert source.ground_truth.at(frame.stamp) is not None


@pytest.mark.parametrize('path, number', [
    ('rgbd_dataset_freiburg1_xyz', '1'), ('fr2_desk', '2'), ('fr3/office', '3'),
    ('freiburg1/cut_of_freiburg3', '3'), ('TUM-FR1-room', '1')])
def test_the_path_selects_the_camera(recorded_folder, tmp_path, path, number):
    (recorded_folder / 'camera.json').unlink()
    moved = tmp_path / 'elsewhere' / path
    shutil.copytree(recorded_folder, moved)
    source = TumSource(moved)
    assert source._camera == CAMERAS[number]


@pytest.mark.parametrize('path', ['desk', 'fr4_desk', 'freiburg12', 'afr1ca', 'frame1'])
def test_a_path_without_a_camera_is_rejected(recorded_folder, tmp_path, path):
    (recorded_folder / 'camera.json').unlink()
    shutil.move(recorded_folder, tmp_path / path)
    with pytest.raises(InputError, match='no calibration.*camera.json.*--camera FILE'):
        TumSource(tmp_path / path)


def test_a_given_camera_comes_first(recorded_folder, tmp_path):
    given = tmp_path / 'mine.json'
    given.write_text('{"width": 32, "height": 24, "k": [9, 0, 16, 0, 9, 12, 0, 0, 1]}')
    source = TumSource(recorded_folder, SourceOptions(camera=given))
    assert next(source.frames(raise_damage)).camera.fx == 9


def test_lines_out_of_order_are_sorted(recorded_folder, recording, assert_same_frames):
    lines = (recorded_folder / 'rgb.txt').read_text().splitlines()
    lines[1], lines[-1] = lines[-1], lines[1]
    (recorded_folder / 'rgb.txt').write_text('\n'.join(lines))
    frames, damage = read(TumSource(recorded_folder))
    assert_same_frames(frames, recording.recorded)
    assert damage == []


def test_stamps_that_repeat_are_skipped_and_reported(
        recorded_folder, recording, assert_same_frames):
    lines = (recorded_folder / 'rgb.txt').read_text().splitlines()
    lines[3:3] = [lines[2], lines[1]]
    (recorded_folder / 'rgb.txt').write_text('\n'.join(lines))
    frames, damage = read(TumSource(recorded_folder))
    assert_same_frames(frames, recording.recorded)
    assert len(damage) == 2
    assert 'rgb.txt, line 4: stamp 1305031102.156790122 repeats' in damage[0]
    assert 'rgb.txt, line 5' in damage[1]


def test_a_damaged_image_is_reported_and_the_next_one_read(
        recorded_folder, recording, assert_same_frames):
    colour, depth = (sorted((recorded_folder / part).iterdir()) for part in ('rgb', 'depth'))
    colour[0].write_bytes(colour[0].read_bytes()[:300])
    colour[1].unlink()
    depth[2].write_bytes(b'')
    shutil.copy(colour[3], depth[3])
    frames, damage = read(TumSource(recorded_folder))
    assert_same_frames(frames, recording.recorded[4:])
    for text, path, reason in zip(damage, (colour[0], colour[1], depth[2], depth[3]), (
            '300 bytes of PNG data are truncated', 'No such file', 'it is empty: copy',
            '3 channels of uint8')):
        assert str(path) in text and reason in text
    assert len(damage) == 4


def test_images_of_different_size_are_reported(recorded_folder):
    depth = sorted((recorded_folder / 'depth').iterdir())[0]
    cv2.imwrite(str(depth), np.ones((12, 16), np.uint16))
    frames, damage = read(TumSource(recorded_folder))
    assert len(frames) == 5
    assert 'colour is 32 x 24 and depth 16 x 12 pixels' in damage[0]
    assert 'rgb' in damage[0]


@pytest.mark.parametrize('name', ['rgb.txt', 'depth.txt'])
def test_a_missing_list_is_named(recorded_folder, name):
    (recorded_folder / name).unlink()
    with pytest.raises(InputError) as raised:
        TumSource(recorded_folder)
    assert str(raised.value) == (
        f'cannot read the list {recorded_folder}/{name}: No such file or directory; a TUM folder '
        'has rgb.txt and depth.txt')


@pytest.mark.parametrize('line', ['1305031102.2', 'abc rgb/a.png', '1.0 a b', 'nan rgb/a.png',
                                  'inf rgb/a.png', '1e200 rgb/a.png', '-1 rgb/a.png',
                                  '2147483648 rgb/a.png', '9223372036.86 rgb/a.png'])
def test_a_malformed_line_is_named(recorded_folder, line):
    edit(recorded_folder / 'depth.txt', lambda text: text.replace('# depth', f'# depth\n{line}'))
    with pytest.raises(InputError, match=(
            'depth.txt, line 2: .*is not an image: required are a stamp from '
            '0 to 2147483647.999999999 s and a file name$')):
        TumSource(recorded_folder)


def test_a_binary_list_is_rejected(recorded_folder):
    (recorded_folder / 'rgb.txt').write_bytes(b'\xff\xfe\x00')
    with pytest.raises(InputError, match='cannot read the list .*rgb.txt'):
        TumSource(recorded_folder)


def test_an_empty_list_is_rejected(recorded_folder):
    (recorded_folder / 'rgb.txt').write_text('# nothing\n')
    with pytest.raises(InputError, match=(
            'rgb.txt lists no images: required are lines of stamp and file '
            'name$')):
        TumSource(recorded_folder)


def test_lists_of_different_times_are_rejected(recorded_folder):
    edit(recorded_folder / 'depth.txt', lambda text: text.replace('\n1305', '\n1405'))
    with pytest.raises(InputError, match='none of the 6 images in rgb.txt and the 6 in depth.txt'):
        TumSource(recorded_folder)


def test_the_interval_limits_the_pairs(recorded_folder, recording):
    offsets = [abs(frame.depth_stamp - frame.stamp) / 1e9 for frame in recording.recorded]
    limit = float(np.median(offsets)) + 1e-5
    source = TumSource(recorded_folder, SourceOptions(max_interval=limit))
    assert 0 < len(source) == sum(offset <= limit for offset in offsets) < 6


def test_images_without_a_partner_are_counted(recorded_folder):
    assert not TumSource(recorded_folder).remarks
    edit(recorded_folder / 'depth.txt', lambda text: '\n'.join(text.splitlines()[:-2]))
    source = TumSource(recorded_folder)
    assert len(source) == 4
    assert source.remarks == [
        f'{recorded_folder}: 2 of 6 images in rgb.txt and 0 of 4 in depth.txt are not used: they '
        'have no partner in the other list within 0.02 s (--max-interval)']


@pytest.mark.parametrize('number, published', [
    ('1', (517.3, 516.5, 318.6, 255.3, 0.2624, -0.9531, -0.0054, 0.0026, 1.1633)),
    ('2', (520.9, 521.0, 325.1, 249.7, 0.2312, -0.7849, -0.0033, -0.0001, 0.9172)),
    ('3', (535.4, 539.2, 320.1, 247.6))])
def test_cameras_are_those_that_the_benchmark_publishes(number, published):
    """The table of its page on file formats: fx, fy, cx, cy, then the distortion of a Kinect."""
    camera = CAMERAS[number]
    assert (camera.width, camera.height, camera.distortion_model) == (640, 480, 'plumb_bob')
    given = (camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion)
    assert len(given) == len(published)
    np.testing.assert_allclose(given[:4], published[:4], atol=0.05 + 1e-9)
    np.testing.assert_allclose(given[4:], published[4:], atol=0.00005 + 1e-9)


def test_a_calibration_in_the_folder_comes_before_that_of_the_path(recorded_folder):
    assert 'freiburg2' in recorded_folder.name
    assert TumSource(recorded_folder)._camera.width == 32


def test_a_damaged_frame_leaves_its_samples_to_the_next_one(recorded_folder, recording):
    """Samples of an accelerometer since the frame before, none of them lost."""
    stamps = [frame.stamp for frame in recording.recorded]
    times = np.arange(stamps[0] - 50_000_000, stamps[-1] + 50_000_000, 10_000_000)
    (recorded_folder / 'accelerometer.txt').write_text(''.join(
        f'{stamp_to_seconds(int(time))} 0 -9.8 0\n' for time in times))
    colour = sorted((recorded_folder / 'rgb').iterdir())
    colour[2].write_bytes(b'')
    frames, damage = read(TumSource(recorded_folder))
    assert len(frames) == 5 and len(damage) == 1
    np.testing.assert_array_equal(np.concatenate([frame.imu.stamps for frame in frames]),
                                  times[times <= stamps[-1]])
    assert frames[2].stamp == stamps[3] and frames[2].imu.stamps[0] <= stamps[2]


@pytest.mark.parametrize('line, sentence', [
    ('x' * 100, f"{'x' * 80!r} is not an image"), ('  a b c ', "'a b c' is not an image")])
def test_the_line_is_quoted_without_its_end(recorded_folder, line, sentence):
    edit(recorded_folder / 'rgb.txt', lambda text: f'{text}{line}\n')
    count = len((recorded_folder / 'rgb.txt').read_text().splitlines())
    with pytest.raises(InputError) as raised:
        TumSource(recorded_folder)
    assert str(raised.value) == (
        f'{recorded_folder}/rgb.txt, line {count}: {sentence}: required are a stamp from 0 to '
        '2147483647.999999999 s and a file name')


def test_lists_without_a_pair_are_described_with_their_numbers(recorded_folder):
    edit(recorded_folder / 'depth.txt', lambda text: '\n'.join(text.splitlines()[:3]))
    edit(recorded_folder / 'depth.txt', lambda text: text.replace('\n1305', '\n1405'))
    with pytest.raises(InputError) as raised:
        TumSource(recorded_folder, SourceOptions(max_interval=0.5))
    assert str(raised.value) == (
        f'{recorded_folder}: none of the 6 images in rgb.txt and the 2 in depth.txt are within '
        '0.5 s of each other: check that both lists belong to one recording')


def test_depth_lines_that_repeat_are_reported_too(recorded_folder):
    edit(recorded_folder / 'depth.txt', lambda text: text + text.splitlines()[2] + '\n')
    _, [damage] = read(TumSource(recorded_folder))
    stamp = (recorded_folder / 'depth.txt').read_text().splitlines()[2].split()[0]
    assert damage == (f'{recorded_folder}/depth.txt, line 8: stamp {stamp} repeats; the line is '
                      'skipped')


def test_the_last_pair_waits_for_no_image_after_it(recorded_folder, recording):
    """Half a period apart another image might be nearer, but there is none."""
    *lines, last = (recorded_folder / 'depth.txt').read_text().splitlines()
    late = recording.recorded[-1].stamp + 15_000_000
    (recorded_folder / 'depth.txt').write_text('\n'.join(
        [*lines, f'{stamp_to_seconds(late)} {last.split()[1]}']))
    frames, damage = read(TumSource(recorded_folder))
    assert len(frames) == 6 and damage == []
    assert frames[-1].depth_stamp == late


def test_the_colour_image_of_a_pair_that_does_not_fit_is_named(recorded_folder):
    colour, depth = (sorted((recorded_folder / part).iterdir())[0] for part in ('rgb', 'depth'))
    cv2.imwrite(str(depth), np.ones((12, 16), np.uint16))
    _, damage = read(TumSource(recorded_folder))
    assert damage[0].startswith(f'{colour}: colour is 32 x 24 and depth 16 x 12 pixels')


def test_a_file_of_a_folder_is_not_the_folder(recorded_folder):
    with pytest.raises(InputError, match='rgb.txt is a file of a TUM folder: name the folder'):
        TumSource(recorded_folder / 'rgb.txt')


def test_a_missing_list_comes_before_a_missing_calibration(recorded_folder):
    for name in ('camera.json', 'depth.txt'):
        (recorded_folder / name).unlink()
    with pytest.raises(InputError, match='depth.txt.*; a TUM folder has rgb.txt and depth.txt'):
        TumSource(recorded_folder)


def test_a_folder_without_a_calibration_says_where_it_was_sought(recorded_folder, tmp_path):
    (recorded_folder / 'camera.json').unlink()
    recorded_folder = recorded_folder.rename(tmp_path / 'desk')
    with pytest.raises(InputError) as raised:
        TumSource(recorded_folder)
    assert str(raised.value) == (f'{recorded_folder} has no calibration, and no freiburg1, 2 or 3 '
                                 f'in its name: {HOW_TO_GIVE}')
