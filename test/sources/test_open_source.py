# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recognising what kind of recording a path is."""

import math
import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.sources import Kind, SourceOptions, kind_of, open_source, synthetic
from aick_ros.sources.bag import BagSource
from aick_ros.sources.images import ImagesSource
from aick_ros.sources.tum import TumSource
from aick_ros.sources.writers.bag_writer import write_bag


def test_a_recorded_folder_is_recognised(recorded_folder):
    assert isinstance(open_source(str(recorded_folder)), TumSource)
    (recorded_folder / 'depth.txt').unlink()
    with pytest.raises(InputError, match='cannot read the list .*depth.txt'):
        open_source(recorded_folder)


@pytest.mark.parametrize('storage, suffix', [('mcap', '.mcap'), ('sqlite3', '.db3')])
def test_a_bag_is_recognised(tmp_path, recording, storage, suffix):
    bag = tmp_path / 'run'
    write_bag(bag, recording, storage)
    for path in (bag, bag / f'run{suffix}'):
        assert isinstance(open_source(path), BagSource)
    (bag / 'metadata.yaml').unlink()
    assert isinstance(open_source(bag), BagSource)


def test_a_ros_1_bag_is_recognised(tmp_path):
    (tmp_path / 'a.bag').write_bytes(b'#ROSBAG V1.2\n')
    with pytest.raises(InputError, match='a.bag cannot be read as a bag .*version 102'):
        open_source(tmp_path / 'a.bag')


def test_numbered_images_are_recognised(tmp_path):
    cv2.imwrite(str(tmp_path / 'frame-000003.color.png'), np.zeros((4, 4, 3), np.uint8))
    cv2.imwrite(str(tmp_path / 'frame-000003.depth.png'), np.ones((4, 4), np.uint16))
    (tmp_path / 'camera-intrinsics.txt').write_text('1 0 1 0 1 1 0 0 1')
    assert isinstance(open_source(tmp_path), ImagesSource)


def test_options_reach_the_reader(recorded_folder):
    with pytest.raises(InputError, match='none of the 6 images.*within 1e-09 s'):
        open_source(recorded_folder, SourceOptions(max_interval=1e-9))


@pytest.mark.parametrize('name, value', [
    ('colour_topic', '/a'), ('depth_topic', '/a'), ('info_topic', '/a'),
    ('ground_truth_topic', '/a'), ('register_depth', True), ('depth_info_topic', '/a'),
    ('depth_in_colour', (0, 0, 0, 0, 0, 0, 1))])
def test_options_of_bags_are_rejected_for_other_recordings(recorded_folder, name, value):
    options, flag = SourceOptions(**{name: value}), f'--{name.replace("_", "-")}'
    with pytest.raises(InputError, match=f'{flag} has no effect on .*, which is not a bag: omit'):
        open_source(recorded_folder, options)
    with pytest.raises(InputError, match=f'{flag} has no effect on a rendered recording'):
        open_source('synthetic:1', options)


def test_a_calibration_of_a_rendered_recording_is_rejected(tmp_path):
    with pytest.raises(InputError, match='--camera has no effect on a rendered'):
        open_source('synthetic:1', SourceOptions(camera=tmp_path / 'a.json'))


@pytest.mark.parametrize('content, reason', [
    (None, 'nothing does not exist: a source is a ROS 2 bag'),
    ((), r'nothing is empty: a source is a ROS 2 bag \(a folder with metadata.yaml, a .mcap or '
     r'.db3 file\), a ROS 1 bag \(a .bag file\), a TUM folder \(with rgb.txt and depth.txt\), a '
     'folder of frame-000000.color.png, frame-000000.depth.png and so on, or synthetic:SEED$'),
    (('notes.txt', 'a.bag'), 'nothing is not a known kind of recording: .* TUM folder')])
def test_other_paths_are_rejected_with_the_known_kinds(tmp_path, content, reason):
    path = tmp_path / 'nothing'
    if content is not None:
        path.mkdir()
        for name in content:
            (path / name).write_text('')
    with pytest.raises(InputError, match=reason):
        open_source(path)


def test_an_empty_text_is_not_taken_for_the_current_folder(recorded_folder, monkeypatch):
    """As that of a shell's variable that is not set: the folder may be a recording."""
    monkeypatch.chdir(recorded_folder)
    assert len(open_source('.')) > 0
    with pytest.raises(InputError, match='^the source is an empty text: a path is required$'):
        open_source('')
    with pytest.raises(InputError, match='^camera is an empty text: a path is required$'):
        SourceOptions(camera='')


def test_another_file_is_rejected(tmp_path):
    (tmp_path / 'a.txt').write_text('')
    with pytest.raises(InputError, match='a.txt is not a known kind of recording'):
        open_source(tmp_path / 'a.txt')


@pytest.mark.parametrize('url', ['https://x/a.mcap', 's3://b/a', 'file:///a'])
def test_a_url_is_for_the_fleet(url):
    with pytest.raises(InputError, match='is a URL, which only aick fleet reads: copy'):
        open_source(url)


@pytest.mark.parametrize('path', ['synthetic:one', 'synthetic:-1', 'synthetic:1.5',
                                  'synthetic:1' + 30 * '0'])
def test_a_seed_must_be_a_whole_number(path):
    with pytest.raises(InputError, match=f'{path} has a seed that is not a whole number'):
        open_source(path)


@pytest.mark.parametrize('path, seed', [('synthetic', 0), ('synthetic:', 0), ('synthetic:3', 3)])
def test_a_rendered_sequence_is_opened(path, seed, monkeypatch):
    monkeypatch.setattr(synthetic, 'SyntheticSource', lambda options: ('opened', options))
    assert open_source(path) == ('opened', synthetic.SyntheticOptions(seed=seed))


def test_a_folder_called_as_what_is_rendered_is_opened_by_its_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'synthetic').mkdir()
    for path in ('./synthetic', tmp_path / 'synthetic'):
        with pytest.raises(InputError, match='synthetic is empty: a source is'):
            open_source(path)


@pytest.mark.parametrize('names, is_file, kind', [
    (['a.mcap'], True, Kind.BAG), (['a.mcap'], False, Kind.BAG), (['a.db3'], False, Kind.BAG),
    (['metadata.yaml'], False, Kind.BAG), (['a.bag'], True, Kind.BAG), (['a.bag'], False, None),
    (['rgb.txt'], False, Kind.TUM), (['depth.txt'], False, Kind.TUM),
    (['rgb.txt', 'a.mcap'], False, Kind.BAG), (['rgb.txt', 'frame-1.color.png'], False, Kind.TUM),
    (['frame-000001.color.png'], False, Kind.IMAGES), (['a-frame-1.png'], False, None),
    ([], False, None), (['notes.txt'], True, None)])
def test_the_kind_follows_from_the_names(names, is_file, kind):
    assert kind_of(names, is_file) is kind


@pytest.mark.parametrize('interval, is_valid', [(0.0, True), (math.inf, True), (-1e-9, False)])
def test_an_interval_is_not_negative(interval, is_valid):
    if is_valid:
        assert SourceOptions(max_interval=interval).max_interval == interval
    else:
        with pytest.raises(InputError, match='max_interval is -1e-09: at least 0 s is required'):
            SourceOptions(max_interval=interval)


def test_options_have_their_types():
    options = SourceOptions(camera='a.json', depth_in_colour=[0, 0, 1, 0, 0, 0, 1])
    assert options.camera == Path('a.json')
    assert options.depth_in_colour == (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    assert SourceOptions().max_interval == 0.02


@pytest.mark.parametrize('digits, is_seed', [(18, True), (19, False)])
def test_a_seed_has_18_digits_at_most(digits, is_seed, monkeypatch):
    monkeypatch.setattr(synthetic, 'SyntheticSource', lambda options: options.seed)
    path = 'synthetic:' + digits * '9'
    if is_seed:
        assert open_source(path) == int(digits * '9')
    else:
        with pytest.raises(InputError) as raised:
            open_source(path)
        assert str(raised.value) == (f'{path} has a seed that is not a whole number of at most 18 '
                                     'digits: try synthetic:1')


@pytest.mark.parametrize('name, sentence', [
    ('a\0b', 'cannot read '), ('x' * 300, 'cannot read .*: File name too long'),
    (' ', "' ' does not exist: a source is"), ('pipe', 'neither a folder nor a regular file')])
def test_paths_that_cannot_be_read_are_one_sentence(tmp_path, monkeypatch, name, sentence):
    monkeypatch.chdir(tmp_path)
    os.mkfifo('pipe')
    with pytest.raises(InputError, match=sentence):
        open_source(name)


def test_a_folder_of_images_is_read_with_the_options(tmp_path):
    cv2.imwrite(str(tmp_path / 'frame-000003.color.png'), np.zeros((4, 4, 3), np.uint8))
    cv2.imwrite(str(tmp_path / 'frame-000003.depth.png'), np.ones((4, 4), np.uint16))
    camera = tmp_path / 'mine.json'
    camera.write_text('{"width": 4, "height": 4, "k": [9, 0, 2, 0, 9, 2, 0, 0, 1]}')
    frame, = open_source(tmp_path, SourceOptions(camera=camera)).frames()
    assert frame.camera.fx == 9


@pytest.mark.parametrize('name, value', [('colour_topic', ''), ('depth_in_colour', ())])
def test_an_option_is_given_also_where_it_is_empty(recorded_folder, name, value):
    with pytest.raises(InputError, match=f'--{name.replace("_", "-")} has no effect on'):
        open_source(recorded_folder, SourceOptions(**{name: value}))


@pytest.mark.parametrize('name', ['colour_topic', 'depth_topic', 'info_topic',
                                  'ground_truth_topic', 'depth_info_topic'])
def test_a_topic_is_text(name):
    assert getattr(SourceOptions(**{name: '/a'}), name) == '/a'
    with pytest.raises(InputError) as raised:
        SourceOptions(**{name: 5})
    assert str(raised.value) == f'{name}: 5, where an object of the class str is required'
