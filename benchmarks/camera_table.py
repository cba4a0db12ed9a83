# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A table about cameras, which are the arguments of the command: recordings or rendered ones."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence

import cv2


def print_camera_table(description: str, columns: Sequence[str], frames: int,
                       rows_of: Callable[[str, int], Iterable[str]]) -> None:
    """
    Print a Markdown table, the rows of one camera after those of the other.

    :param description: of the command.
    :param frames: of each camera, unless the command line says otherwise.
    :param rows_of: returns the rows by the name of a camera and the number of its frames.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument('cameras', nargs='+', metavar='CAMERA')
    parser.add_argument('--frames', type=int, default=frames, help='of each camera')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    print('| ' + ' | '.join(columns) + ' |')
    print('|' + len(columns) * '---|')
    for camera in options.cameras:
        for row in rows_of(camera, options.frames):
            print(row, flush=True)
