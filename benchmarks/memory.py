# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What keyframes that are found again bring, against dead reckoning.

    python benchmarks/memory.py SOURCE...

A SOURCE is a recording with ground truth, ``walk:SEED`` for a walk in a furnished room that
returns to where it was, or ``shelves:SEED`` for one along a row of equal shelves that look alike.
The two are rendered in 320x240. A reuse is off if its error is above 5 cm or 3 degrees.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest import mock

import cv2
import numpy as np
from found_again import followed
from lookalike import CAMERA, Returning, equal_shelves

from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.motion_consistency import pose_consistency
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry.pose_correction import PoseCorrection
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources import RgbdSource, open_source, raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.room import furnished_room

FRAMES, RATE = 600, 15.0
VARIANTS: dict[str, dict[str, Any]] = {
    'previous frame': {'odometry.reference': 'previous'},
    'keyframes, none kept': {'odometry.max_keyframes': 0},
    'keyframes kept': {},
}


def opened(name: str) -> RgbdSource:
    """Return a recording, or a rendered walk."""
    kind, _, seed = name.partition(':')
    if kind not in ('walk', 'shelves'):
        return open_source(name)
    source = rendered_walk(kind, int(seed), FRAMES)
    source.frame = functools.cache(source.frame)  # rendered once for all variants
    return source


def rendered_walk(kind: str, seed: int, frames: int) -> SyntheticSource:
    """Return a walk that returns, in a furnished room or along equal shelves."""
    scene = furnished_room(seed) if kind == 'walk' else equal_shelves(seed)
    reach, degrees = (0.6, 60.0) if kind == 'walk' else (0.4, 25.0)
    path = Returning(np.random.default_rng([seed, 1]), scene.free, reach, degrees)
    return SyntheticSource(SyntheticOptions(
        seed=seed, frames=frames, rate=RATE, camera=CAMERA), scene, path)


@contextmanager
def noted_corrections() -> Iterator[list[np.ndarray]]:
    """Note by how much each frame corrects the pose, 6 [m, rad], of all that run meanwhile."""
    steps, approach = [np.zeros(6)], PoseCorrection.approach

    def noted(correction: PoseCorrection, T_odom_camera: np.ndarray,
              T_reckoned_camera: np.ndarray, interval: float) -> np.ndarray:
        before = correction.T_odom_reckoned
        left = approach(correction, T_odom_camera, T_reckoned_camera, interval)
        steps.append(se3.difference(correction.T_odom_reckoned @ T_reckoned_camera,
                                    before @ T_reckoned_camera))
        return left

    with mock.patch.object(PoseCorrection, 'approach', noted):
        yield steps


def row(name: str, variant: str, source: RgbdSource) -> str:
    """Return the row of a Markdown table."""
    with noted_corrections() as steps:
        updates, reuses = followed(
            source.frames(raise_damage), with_values(Settings(), VARIANTS[variant]))
    stamps = np.array([update.stamp for update in updates])
    poses = np.array([update.T_odom_camera for update in updates])
    found = [reuse.error(source.ground_truth) for reuse in reuses]
    errors = compare(Trajectory(stamps, poses), source.ground_truth)
    translations, rotations = errors.relative()
    ate, rpe, turn = (np.sqrt(np.mean(values ** 2))
                      for values in (errors.positions(), translations, rotations))
    step, step_turn = (max(np.linalg.norm(step[part]) for step in steps)
                       for part in (slice(3), slice(3, 6)))
    poses_nees = pose_consistency(
        [FrameRecord.of(update) for update in updates], source.ground_truth).joint.nees_mean
    return (f'| {name} | {variant} | {1e3 * ate:.2f} | {1e3 * rpe:.2f} | '
            f'{np.degrees(turn):.3f} | {poses_nees:.1f} | '
            f'{len(reuses)} | {sum(error.is_wrong for error in found if error)} | '
            f'{1e3 * step:.2f} | {np.degrees(step_turn):.3f} | '
            f'{np.mean([update.timing["total"] for update in updates]):.0f} |')


def main() -> None:
    """Print a table, a row per recording and variant."""
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    cv2.setNumThreads(1)
    print('| recording | reference | ATE [mm] | RPE 1 s [mm] | [deg] | NEES of the pose | '
          'reuses | off | largest correction [mm] | [deg] | frame [ms] |')
    print('|---|---|---|---|---|---|---|---|---|---|---|')
    for name in sys.argv[1:]:
        source = opened(name)
        for variant in VARIANTS:
            print(row(name, variant, source), flush=True)


if __name__ == '__main__':
    main()
