# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Two seconds of darkness: by how much depth alone errs more than keypoints with it.

    python benchmarks/dark.py [--frames N] CAMERA...

A CAMERA is a recording with ground truth or a kind of rendered camera, as for ``weights.py``. From
some frames on, evenly chosen, the colour images are black for two seconds. Printed are the root
mean squares of the error of the motion over that time, in the dark and in light, their ratio, the
frames that were lost, and the mean NEES of the increments in the dark.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from camera_table import print_camera_table
from weights import frames_of

from aick_ros.evaluation.scores.consistency import Consistency
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.ground_truth import true_motion
from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.evaluation.scores.run_errors import RunErrors
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import seconds
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry, OdometryUpdate

FRAMES = 150
FIRST, STARTS = 20, 7  # the first frame that is dark, and how many of them are tried
DARK = 2.0  # s


def black(frame: RgbdFrame) -> RgbdFrame:
    """Return a frame without light."""
    return dataclasses.replace(frame, colour=np.zeros_like(frame.colour))


def updates_of(frames: Sequence[RgbdFrame], dark: range = range(0)) -> list[OdometryUpdate]:
    """Return the updates of frames, some of which are dark."""
    odometry = Odometry()
    return [odometry.register_frame(black(frame) if index in dark else frame)
            for index, frame in enumerate(frames)]


def error_of(updates: Sequence[OdometryUpdate], truth: Trajectory, start: int, end: int) -> float:
    """Return the error of the motion between two frames [m]; infinite without ground truth."""
    first, last = updates[start], updates[end]
    true = true_motion(truth, first.stamp, last.stamp)
    if true is None:
        return np.inf
    motion = se3.inverse(first.pose.matrix) @ last.pose.matrix
    return float(np.linalg.norm(se3.difference(motion, true)[:3]))


def rows(camera: str, count: int) -> Iterator[str]:
    """Yield the row of a camera."""
    frames, truth = frames_of(camera, count)
    length = round(DARK * (len(frames) - 1) / seconds(frames[0].stamp, frames[-1].stamp))
    light, errors, lost = updates_of(frames), [], 0
    increments: list[IncrementError] = []
    for start in np.linspace(FIRST, len(frames) - length, STARTS).astype(int).tolist():
        dark = range(start, start + length)
        updates = updates_of(frames[:dark.stop], dark)
        errors.append([error_of(found, truth, start - 1, dark[-1]) for found in (updates, light)])
        increments += RunErrors.of([FrameRecord.of(updates[at]) for at in dark], truth).accepted
        lost += sum(not update.status.ok for update in updates)
    in_dark, in_light = 1e3 * np.sqrt(np.mean(np.square(errors), axis=0))
    nees = Consistency.of(error.nees for error in increments).nees_mean or 0.0
    yield (f'| {camera} | {in_dark:.1f} | {in_light:.1f} | {in_dark / in_light:.2f} | {lost} | '
           f'{nees:.1f} |')


def main() -> None:
    """Print the table."""
    print_camera_table(__doc__, ('camera', 'dark [mm]', 'light [mm]', 'ratio', 'lost', 'NEES'),
                       FRAMES, rows)


if __name__ == '__main__':
    main()
