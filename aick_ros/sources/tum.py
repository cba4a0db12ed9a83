# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Folders of the TUM RGB-D benchmark (Sturm et al., IROS 2012).

``rgb.txt`` and ``depth.txt`` list stamps and files, ``groundtruth.txt`` stamps and poses,
``accelerometer.txt`` what the sensor's accelerometer measures. Lines out of
order are sorted, a line whose stamp repeats is skipped and reported, and a line that cannot be
read is an error.
"""

from __future__ import annotations

import heapq
import os
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_LIST_BYTES
from aick_ros.borders.names import counted
from aick_ros.errors import InputError
from aick_ros.frames.imu import ImuSamples
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import MAX_STAMP
from aick_ros.geometry.trajectory import (
    Trajectory, read_trajectory, seconds_to_stamp, stamp_to_seconds)
from aick_ros.messages.bit_depth import BitDepth
from aick_ros.messages.depth_units import to_metres
from aick_ros.messages.synchronizer import Pair, Synchronizer
from aick_ros.sources import OnDamaged, SourceOptions, raise_damage
from aick_ros.sources.calibration import CAMERA_FILE, HOW_TO_GIVE, read_camera
from aick_ros.sources.image_files import read_colour, read_units
from aick_ros.sources.tum_accelerometer import read_accelerations

UNITS_PER_METRE = 5000
"""Units of a depth PNG per metre, as the benchmark defines them."""

CAMERAS = {
    '1': Camera(640, 480, 517.306408, 516.469215, 318.643040, 255.313989, 'plumb_bob',
                (0.262383, -0.953104, -0.005358, 0.002628, 1.163314)),
    '2': Camera(640, 480, 520.908620, 521.007327, 325.141442, 249.701764, 'plumb_bob',
                (0.231222, -0.784899, -0.003257, -0.000105, 0.917205)),
    '3': Camera(640, 480, 535.433105, 539.212524, 320.106653, 247.632132),
}
"""Camera number -> calibration of the benchmark; images of the third are undistorted."""

_CAMERA_IN_PATH = re.compile(r'(?:freiburg|(?<![a-z])fr)([123])(?!\d)', re.IGNORECASE)


class _List(NamedTuple):
    """A list file: stamps [ns], strictly increasing, with image files, and the skipped lines."""

    images: list[tuple[int, str]]
    skipped: list[InputError]


class TumSource:
    """
    A TUM folder; see :class:`aick_ros.sources.RgbdSource`.

    :raises InputError: where a list or the calibration is missing or cannot be used.
    """

    def __init__(self, folder: Path, options: SourceOptions = SourceOptions()) -> None:
        self.name = folder.resolve().name
        self._folder = folder
        if folder.is_file():
            raise InputError(f'{folder} is a file of a TUM folder: name the folder')
        colour = _read_list(folder, 'rgb.txt')
        depth = _read_list(folder, 'depth.txt')
        self._camera = _find_camera(folder, options.camera)
        self._bits = BitDepth()
        self._skipped = colour.skipped + depth.skipped
        self._imu = read_accelerations(folder)
        self._pairs = _associate(colour.images, depth.images, options.max_interval)
        interval = f'{options.max_interval:g} s'
        if not self._pairs:
            raise InputError(
                f'{folder}: none of the {len(colour.images)} images in rgb.txt and the '
                f'{len(depth.images)} in depth.txt are within {interval} of each '
                'other: check that both lists belong to one recording')
        colours, depths = (len(listed.images) - len(self._pairs) for listed in (colour, depth))
        self._remarks = [] if not colours and not depths else [
            f'{folder}: {colours} of {counted(len(colour.images), "image")} in rgb.txt and '
            f'{depths} of {len(depth.images)} in depth.txt are not used: they have no partner in '
            f'the other list within {interval} (--max-interval)']

    @cached_property
    def ground_truth(self) -> Trajectory | None:
        """The trajectory in groundtruth.txt, None where there is none."""
        path = self._folder / 'groundtruth.txt'
        return read_trajectory(path) if os.path.lexists(path) else None

    def __len__(self) -> int:
        """Return the number of associated pairs."""
        return len(self._pairs)

    @property
    def remarks(self) -> Sequence[str]:
        """Number of images without a partner, in one sentence; none where each has one."""
        return self._remarks

    def frames(self, on_damaged: OnDamaged = raise_damage) -> Iterator[RgbdFrame]:
        """Yield the associated pairs as frames."""
        for error in self._skipped:
            on_damaged(error)
        before = None
        for pair in self._pairs:
            try:
                frame = self._read(pair, before)
            except InputError as error:
                on_damaged(error)
            else:
                before = frame.stamp
                yield frame

    def _read(self, pair: Pair, before: int | None) -> RgbdFrame:
        """Return the frame of a pair, with the accelerations since the stamp before."""
        path = self._folder / pair.colour
        colour = read_colour(path, self._bits)
        depth = read_units(self._folder / pair.depth)
        try:
            return RgbdFrame(pair.colour_stamp, colour, to_metres(depth, UNITS_PER_METRE),
                             self._camera, pair.depth_stamp,
                             self._samples(pair, before)).handed_over()
        except InputError as error:
            raise InputError(f'{path}: {error}') from None

    def _samples(self, pair: Pair, before: int | None) -> ImuSamples | None:
        return None if self._imu is None else self._imu.until(pair.colour_stamp, before)


def _find_camera(folder: Path, given: Path | None) -> Camera:
    if given is not None:
        return read_camera(given)
    if (folder / CAMERA_FILE).exists():
        return read_camera(folder / CAMERA_FILE)
    numbers = _CAMERA_IN_PATH.findall(str(folder.resolve()))
    if numbers:
        return CAMERAS[numbers[-1]]
    raise InputError(f'{folder} has no calibration, and no freiburg1, 2 or 3 in its name: '
                     f'{HOW_TO_GIVE}')


def _read_list(folder: Path, name: str) -> _List:
    path = folder / name
    try:
        lines = read_text(path, 'the list', MAX_LIST_BYTES).splitlines()
    except InputError as error:
        raise InputError(f'{error}; a TUM folder has rgb.txt and depth.txt') from None
    images: dict[int, str] = {}
    skipped = []
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith('#'):
            continue
        stamp, file = _read_line(line, f'{path}, line {number}')
        if stamp in images:
            skipped.append(InputError(
                f'{path}, line {number}: stamp {stamp_to_seconds(stamp)} repeats; the line is '
                'skipped'))
        else:
            images[stamp] = file
    if not images:
        raise InputError(f'{path} lists no images: required are lines of stamp and file name')
    return _List(sorted(images.items()), skipped)


def _read_line(line: str, where: str) -> tuple[int, str]:
    """Return the stamp [ns] and the file of a line."""
    try:
        stamp, file = line.split()
        return seconds_to_stamp(stamp), file
    except ValueError:
        raise InputError(f'{where}: {line.strip()[:80]!r} is not an image: required are a stamp '
                         f'from 0 to {stamp_to_seconds(MAX_STAMP)} s and a file name') from None


def _associate(colour: list[tuple[int, str]], depth: list[tuple[int, str]],
               max_interval: float) -> list[Pair]:
    synchronizer = Synchronizer(max_interval)
    arrivals = heapq.merge(((stamp, synchronizer.add_colour, file) for stamp, file in colour),
                           ((stamp, synchronizer.add_depth, file) for stamp, file in depth),
                           key=itemgetter(0))
    pairs = [pair for stamp, add, file in arrivals for pair in add(stamp, file)]
    return pairs + synchronizer.flush()
