# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whether the covariance of increments is right, whatever the camera.

    python benchmarks/increments.py [--frames N] CAMERA...

A CAMERA is a recording with ground truth or a kind of rendered camera, as for ``weights.py``. Of
each the mean NEES of the increments of the odometry is printed, which is 6 where the covariance is
right, and the share inside its 95 % ellipsoid; of all increments, and of those after the first
thirty, when something is known of the camera.
"""

from __future__ import annotations

from collections.abc import Iterator

from camera_table import print_camera_table
from weights import frames_of

from aick_ros.evaluation.scores.consistency import Consistency
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.run_errors import RunErrors
from aick_ros.odometry import Odometry

FRAMES = 150
FIRST = 30  # frames, until something is known of the camera


def consistencies(camera: str, count: int) -> tuple[Consistency, Consistency]:
    """Return that of all increments of the first frames of a camera, and of the later ones."""
    frames, truth = frames_of(camera, count)
    odometry = Odometry()
    records = [FrameRecord.of(odometry.register_frame(frame)) for frame in frames]
    all_of_them, later = (
        Consistency.of(error.nees for error in RunErrors.of(part, truth).accepted)
        for part in (records, records[FIRST:]))
    return all_of_them, later


def rows(camera: str, count: int) -> Iterator[str]:
    """Yield the row of a camera."""
    found = consistencies(camera, count)
    yield f'| {camera} | ' + ' | '.join(
        f'{each.nees_mean or 0.0:.1f} | {each.inside_95 or 0.0:.2f}' for each in found) + ' |'


def main() -> None:
    """Print the table."""
    print_camera_table(
        __doc__, ('camera', 'mean NEES', 'inside 95 %', 'later: mean NEES', 'inside 95 %'), FRAMES,
        rows)


if __name__ == '__main__':
    main()
