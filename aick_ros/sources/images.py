# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Folders of numbered images, as 7-Scenes and 3DMatch have them.

``frame-000000.color.png`` or ``.jpg``, ``frame-000000.depth.png`` in millimetres (0 and 65535 for
no depth), ``frame-000000.pose.txt`` with ``T_world_camera`` (optional), and the calibration as
``camera.json`` or ``camera-intrinsics.txt``, in the folder or its parent. The stamps follow from
the numbers at 30 Hz, so a missing number leaves a gap in time.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_CONFIGURATION_BYTES, MAX_DISTANCE
from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import MAX_STAMP, NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.messages.bit_depth import BitDepth
from aick_ros.messages.depth_units import MILLIMETRES, to_metres
from aick_ros.sources import OnDamaged, SourceOptions, raise_damage
from aick_ros.sources.calibration import CAMERA_FILE, HOW_TO_GIVE, read_camera
from aick_ros.sources.image_files import read_colour, read_units

RATE = 30
"""Numbers per second."""

START = NANOSECONDS
"""Stamp of number 0 [ns]; not zero, which means that a stamp was never set."""

INTRINSICS_FILE = 'camera-intrinsics.txt'

_LAST_NUMBER = (MAX_STAMP - START) * RATE // NANOSECONDS
_NO_DEPTH = 65535  # of 7-Scenes, beside 0
_FILE = re.compile(r'frame-(\d+)\.(?:(color)\.(?:png|jpe?g)|(depth)\.png|(pose)\.txt)')


class ImagesSource:
    """
    A folder of numbered images; see :class:`aick_ros.sources.RgbdSource`.

    :raises InputError: where colour, depth or the calibration is missing or cannot be used.
    """

    def __init__(self, folder: Path, options: SourceOptions = SourceOptions()) -> None:
        self.name = folder.resolve().name
        self._folder = folder
        self._files = _find_files(folder)
        self._numbers = sorted(self._files['color'])
        for kind in ('color', 'depth'):
            if not self._files[kind]:
                raise InputError(f'{folder} has no frame-000000.{kind}.png: a folder of numbered '
                                 'images has both colour and depth')
        self._calibration = _find_camera(folder, options.camera)
        self._bits = BitDepth()

    @cached_property
    def ground_truth(self) -> Trajectory | None:
        """The poses, None where there are none; poses that are not finite are skipped."""
        paths = self._files['pose']
        poses = {_stamp(number): _read_pose(paths[number]) for number in sorted(paths)}
        poses = {stamp: pose for stamp, pose in poses.items() if np.isfinite(pose).all()}
        if not poses:
            return None
        return Trajectory(np.array(list(poses), np.int64),
                          np.array([_rigid(pose) for pose in poses.values()]))

    def __len__(self) -> int:
        """Return the number of colour images."""
        return len(self._numbers)

    @property
    def remarks(self) -> Sequence[str]:
        """Sentences on what of it was not used: none."""
        return ()

    def frames(self, on_damaged: OnDamaged = raise_damage) -> Iterator[RgbdFrame]:
        """Yield the frames in the order of their numbers."""
        for number in self._numbers:
            try:
                frame = self._read(number)
            except InputError as error:
                on_damaged(error)
            else:
                yield frame

    def _read(self, number: int) -> RgbdFrame:
        path = self._files['color'][number]
        if number not in self._files['depth']:
            raise InputError(f'{path} has no frame-{number:06d}.depth.png beside it')
        colour, depth = read_colour(path, self._bits), read_units(self._files['depth'][number])
        depth[depth == _NO_DEPTH] = 0
        if not isinstance(self._calibration, Camera):
            self._calibration = Camera.from_camera_info(colour.shape[1], colour.shape[0],
                                                        self._calibration)
        try:
            return RgbdFrame(_stamp(number), colour, to_metres(depth, MILLIMETRES),
                             self._calibration).handed_over()
        except InputError as error:
            raise InputError(f'{path}: {error}') from None


def _stamp(number: int) -> int:
    return START + (number * NANOSECONDS + RATE // 2) // RATE


def _find_files(folder: Path) -> dict[str, dict[int, Path]]:
    """Return kind -> number -> path."""
    files: dict[str, dict[int, Path]] = {'color': {}, 'depth': {}, 'pose': {}}
    for path in sorted(folder.iterdir()):
        match = _FILE.fullmatch(path.name)
        if match:
            number, *kinds = match.groups()
            if _stamp(int(number)) > MAX_STAMP:
                raise InputError(f'{path} has the number {int(number)}: at most '
                                 f'{_LAST_NUMBER} has a stamp at {RATE} Hz; renumber the files')
            files[next(filter(None, kinds))][int(number)] = path
    return files


def _find_camera(folder: Path, given: Path | None) -> Camera | list[float]:
    """Return the camera, or the nine numbers of k where the image size is not known yet."""
    if given is not None:
        return read_camera(given)
    for place in (folder, folder.resolve().parent):
        if (place / CAMERA_FILE).exists():
            return read_camera(place / CAMERA_FILE)
        if (place / INTRINSICS_FILE).exists():
            return _read_intrinsics(place / INTRINSICS_FILE)
    raise InputError(f'{folder} has no calibration: {HOW_TO_GIVE}, or as {INTRINSICS_FILE} with '
                     'three rows (7-Scenes: 585 0 320 / 0 585 240 / 0 0 1)')


def _read_intrinsics(path: Path) -> list[float]:
    """Return k, nine numbers row by row."""
    matrix = _read_matrix(path, (3, 3))
    if not np.isfinite(matrix).all() or matrix[0, 0] <= 0.0 or matrix[1, 1] <= 0.0:
        raise InputError(f'{path} has no positive focal lengths: required are fx 0 cx / 0 fy cy '
                         '/ 0 0 1')
    return [float(number) for number in matrix.flat]


def _read_pose(path: Path) -> np.ndarray:
    """Return ``T_world_camera`` as it is written, 4x4; it may be not finite."""
    pose = _read_matrix(path, (4, 4))
    rotation = pose[:3, :3]
    if not np.isfinite(pose).all():
        return pose
    if np.abs(pose[:3, 3]).max() > MAX_DISTANCE:
        raise InputError(f'{path} is not a pose: it is beyond {MAX_DISTANCE:g} m')
    if np.abs(rotation).max() > 2.0 or not np.allclose(rotation @ rotation.T, np.eye(3),
                                                       atol=1e-2):
        raise InputError(f'{path} is not a pose: its rotation is not orthonormal')
    return pose


def _read_matrix(path: Path, shape: tuple[int, int]) -> np.ndarray:
    """Read rows of numbers, float64."""
    try:
        text = read_text(path, 'the numbers', MAX_CONFIGURATION_BYTES)
        return np.array(text.split(), np.float64).reshape(shape)
    except ValueError as error:  # InputError is one
        raise InputError(f'cannot read {shape[0]} rows of {shape[1]} numbers from {path}: '
                         f'{error}') from None


def _rigid(pose: np.ndarray) -> np.ndarray:
    """Return a pose that was rounded, its rotation orthonormal again, 4x4."""
    return se3.from_quaternion(se3.to_quaternion(pose[:3, :3]).tolist(), pose[:3, 3].tolist())
