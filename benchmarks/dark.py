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

import argparse
import dataclasses
from collections.abc import Sequence

import cv2
import numpy as np
from weights import frames_of

from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry, OdometryUpdate

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
    true = [truth.at(update.stamp) for update in (first, last)]
    if true[0] is None or true[1] is None:
        return np.inf
    motion = se3.inverse(first.pose.matrix) @ last.pose.matrix
    return float(np.linalg.norm(se3.difference(motion, se3.inverse(true[0]) @ true[1])[:3]))


def nees_of(updates: Sequence[OdometryUpdate], truth: Trajectory, dark: range) -> list[float]:
    """Return the NEES of the increments of dark frames."""
    found = []
    for index in dark:
        increment, stamp = updates[index].increment, updates[index].stamp
        if increment is None:
            continue
        true = [truth.at(at) for at in (stamp - round(NANOSECONDS * increment.interval), stamp)]
        if true[0] is not None and true[1] is not None:
            error = IncrementError.of(increment.pose.matrix, increment.pose.covariance,
                                      se3.inverse(true[0]) @ true[1])
            found.append(np.nan if error.nees is None else error.nees)
    return found


def row(camera: str, count: int) -> str:
    """Return the row of a camera."""
    frames, truth = frames_of(camera, count)
    length = round(DARK * (len(frames) - 1) / seconds(frames[0].stamp, frames[-1].stamp))
    light, errors, nees, lost = updates_of(frames), [], [], 0
    for start in np.linspace(FIRST, len(frames) - length, STARTS).astype(int).tolist():
        dark = range(start, start + length)
        updates = updates_of(frames[:dark.stop], dark)
        errors.append([error_of(found, truth, start - 1, dark[-1]) for found in (updates, light)])
        nees += nees_of(updates, truth, dark)
        lost += sum(not update.status.ok for update in updates)
    in_dark, in_light = 1e3 * np.sqrt(np.mean(np.square(errors), axis=0))
    return (f'| {camera} | {in_dark:.1f} | {in_light:.1f} | {in_dark / in_light:.2f} | {lost} | '
            f'{np.nanmean(nees):.1f} |')


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('cameras', nargs='+', metavar='CAMERA')
    parser.add_argument('--frames', type=int, default=150)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    print('| camera | dark [mm] | light [mm] | ratio | lost | NEES |')
    print('|---|---|---|---|---|---|')
    for camera in options.cameras:
        print(row(camera, options.frames), flush=True)


if __name__ == '__main__':
    main()
