#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Odometry over data of one's own: an .npz file with arrays of images.

The file has ``stamps`` (N, [s]), ``colour`` (NxHxWx3 uint8, red first), ``depth`` (NxHxW uint16,
[mm], 0 for none), and ``k`` (3x3 intrinsic matrix).

usage: custom_source.py FILE.npz
"""

import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from aick_ros import Camera, InputError, Odometry, RgbdFrame


def frames(path: str) -> Iterator[RgbdFrame]:
    """Yield the frames of a file; a source is whatever yields these in order of their stamps."""
    if Path(path).is_file() and not zipfile.is_zipfile(path):
        raise InputError('it is not an .npz file, which numpy.savez writes, or is truncated')
    with np.load(path) as arrays:
        height, width = arrays['depth'].shape[1:]
        camera = Camera.from_camera_info(width, height, arrays['k'].ravel())
        for stamp, colour, depth in zip(arrays['stamps'], arrays['colour'], arrays['depth']):
            metres = np.where(depth > 0, depth / np.float32(1000), np.float32(np.nan))
            yield RgbdFrame(round(stamp * 1e9), colour, metres, camera)


def main(path: str) -> None:
    """Print the status of each frame and the position of the camera."""
    odometry = Odometry()
    for frame in frames(path):
        update = odometry.register_frame(frame)
        print(update.status.name, update.pose.translation.round(3))


if __name__ == '__main__':
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    try:
        main(sys.argv[1])
    except OSError as error:
        sys.exit(f'{sys.argv[1]}: {error.strerror}')
    except (InputError, KeyError) as error:  # KeyError: an array that is missing
        sys.exit(f'{sys.argv[1]}: {error}')
