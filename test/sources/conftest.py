# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A small recording in memory and as a TUM folder, and the real ones where they are at hand."""

from dataclasses import dataclass, field

import cv2
import numpy as np
import pytest

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory, stamp_to_seconds

START = 1305031102 * NANOSECONDS + 123456789
PERIOD = 33333333
SIZE = (24, 32)


@dataclass
class Recording:
    """An RgbdSource of frames in memory."""

    recorded: list[RgbdFrame]
    ground_truth: Trajectory | None = None
    damage: list[Exception] = field(default_factory=list)
    name: str = 'in memory'

    def __len__(self):
        return len(self.recorded)

    def frames(self, on_damaged):
        yield from self.recorded
        for error in self.damage:
            on_damaged(error)


def random_units(rng):
    """Return a depth image in units of 0.2 mm with a tenth of it missing."""
    units = rng.integers(1500, 45000, SIZE, np.uint16)
    units[rng.random(SIZE) < 0.1] = 0
    return units


@pytest.fixture
def camera():
    return Camera(32, 24, 25.5, 25.25, 15.75, 11.5, 'plumb_bob', (0.1, -0.2, 1e-3, -2e-3, 0.05))


@pytest.fixture
def recording(camera):
    """Return six frames, depth taken at other times than colour, with ground truth."""
    rng = np.random.default_rng(6)
    frames = []
    for index in range(6):
        stamp = START + index * PERIOD
        units = random_units(rng)
        depth = np.where(units, units.astype(np.float32) / np.float32(5000), np.float32(np.nan))
        frames.append(RgbdFrame(
            stamp, rng.integers(0, 256, (*SIZE, 3), np.uint8), depth, camera,
            stamp + int(rng.integers(-9, 10)) * 1_000_000))
    stamps = START - NANOSECONDS // 10 + np.arange(40, dtype=np.int64) * NANOSECONDS // 100
    poses = np.array([se3.exp(rng.normal(0, 0.5, 6)) for _ in stamps])
    return Recording(frames, Trajectory(stamps, poses))


@pytest.fixture
def recorded_folder(tmp_path, recording):
    """Return a TUM folder of the recording, written by OpenCV and by hand."""
    folder = tmp_path / 'rgbd_dataset_freiburg2_small'
    lists = {'rgb': '# colour\n', 'depth': '# depth\n'}
    for frame in recording.recorded:
        units = np.nan_to_num(np.rint(frame.depth * 5000)).astype(np.uint16)
        for part, stamp, image in (('rgb', frame.stamp, frame.colour[:, :, ::-1]),
                                   ('depth', frame.depth_stamp, units)):
            (folder / part).mkdir(parents=True, exist_ok=True)
            file = f'{part}/{stamp_to_seconds(stamp)}.png'
            cv2.imwrite(str(folder / file), image)
            lists[part] += f'{stamp_to_seconds(stamp)} {file}\n'
    for part, text in lists.items():
        (folder / f'{part}.txt').write_text(text)
    (folder / 'camera.json').write_text(
        '{"width": 32, "height": 24, "distortion_model": "plumb_bob",'
        ' "k": [25.5, 0, 15.75, 0, 25.25, 11.5, 0, 0, 1],'
        ' "d": [0.1, -0.2, 1e-3, -2e-3, 0.05]}')
    return folder


@pytest.fixture
def assert_same_frames():
    """Return a function that compares two lists of frames bit for bit."""
    def compare(frames, expected):
        assert len(frames) == len(expected)
        for frame, other in zip(frames, expected):
            assert (frame.stamp, frame.depth_stamp) == (other.stamp, other.depth_stamp)
            assert frame.camera == other.camera
            assert np.array_equal(frame.colour, other.colour)
            assert np.array_equal(frame.depth, other.depth, equal_nan=True)
    return compare


@pytest.fixture(params=['freiburg1_xyz_150', 'freiburg1_rpy_100'])
def real_folder(request, tum_folder):
    return tum_folder(request.param)
