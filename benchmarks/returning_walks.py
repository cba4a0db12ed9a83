# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Drift of long rendered walks that return, with and without keyframes that are found again.

    python benchmarks/returning_walks.py [--frames N] SEED...

Each walk (320x240, 15 Hz) is run once with the defaults. Without memory its path is that of the
increments alone, which no keyframe that is found again corrects. Standard deviations are those of
the last position.
"""

from __future__ import annotations

import argparse
from itertools import accumulate

import cv2
import numpy as np
from found_again import followed
from markdown_page import table
from memory import rendered_walk

from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.motion_consistency import pose_consistency
from aick_ros.evaluation.scores.statistics import root_mean_square
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import OdometryUpdate
from aick_ros.sources import raise_damage


def reckoned(updates: list[OdometryUpdate]) -> list[PoseWithCovariance]:
    """Return the poses by the increments alone; every frame must have been tracked."""
    return list(accumulate((update.increment.pose for update in updates[1:]),
                           lambda pose, increment: pose @ increment, initial=updates[0].pose))


def row(seed: int, frames: int) -> tuple[str, ...]:
    """Return the row of a table."""
    source = rendered_walk('walk', seed, frames)
    updates, reuses = followed(source.frames(raise_damage))
    if not all(update.status.ok for update in updates):
        return (f'walk:{seed}', *['lost'] * 7)
    stamps = np.array([update.stamp for update in updates])
    paths = reckoned(updates), [update.pose for update in updates]
    without, kept = (1e3 * root_mean_square(compare(
        Trajectory(stamps, np.array([pose.matrix for pose in path])),
        source.ground_truth).positions()) for path in paths)
    sigmas = (1e3 * np.sqrt(np.trace(path[-1].covariance[:3, :3])) for path in paths)
    along = pose_consistency([FrameRecord.of(update) for update in updates], source.ground_truth)
    return (f'walk:{seed}', f'{without:.1f}', f'{kept:.1f}', f'{kept / without:.2f}',
            *(f'{sigma:.0f}' for sigma in sigmas), f'{along.joint.nees_mean:.1f}',
            str(len(reuses)))


def main() -> None:
    """Print a table, a row per walk."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--frames', type=int, default=1500)
    parser.add_argument('seeds', type=int, nargs='+', metavar='SEED')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    print(table([('walk', 'ATE without memory [mm]', 'with [mm]', 'ratio',
                  'sigma without [mm]', 'with [mm]', 'mean NEES of the poses', 'reuses'),
                 *(row(seed, options.frames) for seed in options.seeds)]))


if __name__ == '__main__':
    main()
