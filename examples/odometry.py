#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Odometry over a recording: the path of the camera, one line per frame.

usage: odometry.py SOURCE     a bag, a TUM folder, a folder of numbered images, or synthetic:SEED
"""

import sys

import numpy as np

from aick_ros import InputError, Odometry, open_source


def main(path: str) -> None:
    """Print stamp, status, position and its standard deviation for each frame."""
    odometry = Odometry()
    for frame in open_source(path).frames():
        update = odometry.register_frame(frame)
        sigma = np.sqrt(np.diag(update.pose.covariance)[:3].max())
        print(f'{update.stamp / 1e9:.3f} s  {update.status.name:<12}',
              f'{update.pose.translation.round(3)} m, +-{1e3 * sigma:.1f} mm')


if __name__ == '__main__':
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    try:
        main(sys.argv[1])
    except InputError as error:  # says what is wrong, where, and what to do
        sys.exit(str(error))
