# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A folder with any damage gives frames, each damaged image a sentence, or ends in one."""

import os
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.sources import open_source
from aick_ros.sources.calibration import write_camera

CAMERA = Camera(16, 12, 13.0, 13.0, 7.5, 5.5)
PIXELS = np.random.default_rng(0)
COLOUR = cv2.imencode('.png', PIXELS.integers(0, 256, (12, 16, 3), np.uint8))[1].tobytes()
DEPTH = cv2.imencode('.png', PIXELS.integers(0, 9000, (12, 16), np.uint16))[1].tobytes()
POSE = '1 0 0 0.5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n'

FILES = {
    'tum': {'rgb.txt': b'# colour\n1.0 a.png\n1.1 b.png\n', 'a.png': COLOUR, 'b.png': COLOUR,
            'depth.txt': b'1.0 c.png\n1.1 d.png\n', 'c.png': DEPTH, 'd.png': DEPTH,
            'groundtruth.txt': b'1.0 0 0 0 0 0 0 1\n1.1 0.1 0 0 0 0 0 1\n'},
    'images': {f'frame-{number:06d}.{name}': content for number in range(2)
               for name, content in (('color.png', COLOUR), ('depth.png', DEPTH),
                                     ('pose.txt', POSE.encode()))}}


@st.composite
def damages(draw, names):
    """Draw functions that damage a folder."""
    name = draw(st.sampled_from(sorted(names)))
    place, part = draw(st.floats(0.0, 1.0)), draw(st.binary(max_size=8))

    def change(path):
        content = path.read_bytes()
        start = round(place * len(content))
        path.write_bytes(content[:start] + part + content[start + len(part):])

    def insert(path):
        content = path.read_bytes()
        start = round(place * len(content))
        path.write_bytes(content[:start] + part + content[start:])

    def cut(path):
        path.write_bytes(path.read_bytes()[:round(place * path.stat().st_size)])

    def replace(make):
        def replaced(path):
            path.unlink()
            make(path)
        return replaced

    return name, draw(st.sampled_from([
        change, insert, cut, Path.unlink, replace(Path.mkdir), replace(os.mkfifo),
        replace(lambda path: path.symlink_to(path)), replace(lambda path: path.write_bytes(b'')),
        replace(lambda path: path.symlink_to('/dev/zero')),
        replace(lambda path: path.write_bytes(COLOUR)), replace(
            lambda path: path.write_bytes(DEPTH))]))


@pytest.mark.parametrize('kind', FILES)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(data=st.data())
def test_any_damage(tmp_path, kind, data):
    folder = tmp_path / 'recording'
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    write_camera(folder / 'camera.json', CAMERA)
    for name, content in FILES[kind].items():
        (folder / name).write_bytes(content)
    for name, damage in data.draw(st.lists(damages([*FILES[kind], 'camera.json']), max_size=3,
                                           unique_by=lambda item: item[0])):
        damage(folder / name)
    damaged = []
    try:
        source = open_source(folder)
        frames = list(source.frames(damaged.append))
        source.ground_truth
    except InputError as error:
        damaged.append(error)
    else:
        assert len(frames) + len(damaged) >= min(len(source), 1)
        assert all(frame.depth.shape == (12, 16) for frame in frames)
    assert all(isinstance(error, InputError) and str(folder) in str(error) for error in damaged)
