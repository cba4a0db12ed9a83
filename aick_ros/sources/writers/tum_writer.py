# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Folders in the format of the TUM RGB-D benchmark, with the calibration in camera.json."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.trajectory import stamp_to_seconds, write_trajectory
from aick_ros.messages.depth_units import to_units
from aick_ros.sources import OnDamaged, RgbdSource, raise_damage
from aick_ros.sources.calibration import CAMERA_FILE, write_camera
from aick_ros.sources.tum import UNITS_PER_METRE
from aick_ros.sources.writers import Progress, no_progress
from aick_ros.sources.writers.new_folder import new_folder


def write_tum(path: Path, source: RgbdSource, on_damaged: OnDamaged = raise_damage,
              progress: Progress = no_progress) -> int:
    """
    Write a recording as a TUM folder; depth is rounded to 0.2 mm, and omitted beyond 13.1 m.

    :param path: the new folder; it appears once it is complete.
    :returns: the number of frames written.
    :raises InputError: where ``path`` exists, cannot be written, or there are no frames.
    """
    with new_folder(path) as folder:
        for part in ('rgb', 'depth'):
            (folder / part).mkdir(parents=True)
        lists: dict[str, list[str]] = {'rgb': [], 'depth': []}
        for count, frame in enumerate(source.frames(on_damaged), 1):
            if count == 1:
                write_camera(folder / CAMERA_FILE, frame.camera)
            for part, (stamp, image) in _images(frame).items():
                seconds = stamp_to_seconds(stamp)
                _write_png(folder / part / f'{seconds}.png', image)
                lists[part].append(f'{seconds} {part}/{seconds}.png\n')
            progress(count, len(source))
        if not lists['rgb']:
            raise InputError(f'{source.name} has no frames to write')
        for part, lines in lists.items():
            (folder / f'{part}.txt').write_text('# stamp file\n' + ''.join(lines))
        if source.ground_truth is not None:
            write_trajectory(folder / 'groundtruth.txt', source.ground_truth)
    return len(lists['rgb'])


def _images(frame: RgbdFrame) -> dict[str, tuple[int, np.ndarray]]:
    """Return folder -> stamp [ns] and image, in the channel order of OpenCV."""
    colour = frame.colour
    if colour.ndim == 3:
        colour = cv2.cvtColor(colour, cv2.COLOR_RGB2BGR)
    depth_stamp = frame.stamp if frame.depth_stamp is None else frame.depth_stamp
    return {'rgb': (frame.stamp, colour),
            'depth': (depth_stamp, to_units(frame.depth, UNITS_PER_METRE))}


def _write_png(path: Path, image: np.ndarray) -> None:
    _, data = cv2.imencode('.png', image)
    path.write_bytes(data.tobytes())
