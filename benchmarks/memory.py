# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What keyframes that are found again bring, against dead reckoning.

    python benchmarks/memory.py SOURCE...

A SOURCE is a recording with ground truth, ``walk:SEED`` for a walk in a furnished room that
returns to where it was, or ``shelves:SEED`` for one along a row of equal shelves that look alike.
The two are rendered in 320x240. A reuse is false if its error is above 5 cm or 3 degrees.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from unittest import mock

import cv2
import numpy as np

from aick_ros.evaluation.scores.consistency import nees
from aick_ros.evaluation.scores.ground_truth import true_motion, true_pose
from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry, OdometryUpdate
from aick_ros.odometry.keyframe_graph import KeyframeGraph, RelativePose
from aick_ros.odometry.keyframe_search import KeyframeSearch
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources import RgbdSource, open_source, raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource, furniture, materials
from aick_ros.sources.synthetic.assembly import Assembly
from aick_ros.sources.synthetic.lighting import Lamp
from aick_ros.sources.synthetic.path import attitude
from aick_ros.sources.synthetic.room import furnished_room
from aick_ros.sources.synthetic.scene import Scene, Zone
from aick_ros.sources.synthetic.wander import Wander

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
FRAMES, RATE = 600, 15.0
VARIANTS: dict[str, dict[str, Any]] = {
    'previous frame': {'odometry.reference': 'previous'},
    'keyframes, none kept': {'odometry.max_keyframes': 0},
    'keyframes kept': {},
}
SLOW = ((0.6, 0.08, 0.15), (0.3, 0.2, 0.35), (0.1, 0.4, 0.7))
"""Shares of the amplitude and frequencies [Hz] of a movement that returns."""


class Returning:
    """A camera that is moved to and fro about the middle of a zone."""

    def __init__(self, rng: np.random.Generator, zone: Zone, reach: float, degrees: float,
                 heading: float) -> None:
        self._centre, self._heading = zone.centre, heading
        self._position = [Wander(rng, reach * share, SLOW) for share in (1.0, 1.0, 0.7)]
        self._attitude = [Wander(rng, np.radians(degrees) * share, SLOW)
                          for share in (1.0, 0.7, 1.0)]

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` of the optical frame at a time [s]."""
        yaw, pitch, roll = (wander.at(time) for wander in self._attitude)
        pose = np.eye(4)
        pose[:3, :3] = attitude(self._heading + yaw, np.radians(-15) + pitch, roll)
        pose[:3, 3] = self._centre + [wander.at(time) for wander in self._position]
        return pose


def equal_shelves(seed: int) -> Scene:
    """Return a room along whose long walls the same bookshelf stands every half a metre."""
    size = np.array([6.0, 3.4, 2.6])
    room = Assembly(np.random.default_rng([seed, 0]))
    wall = materials.plaster((222, 212, 190))
    room.room(tuple(size), [wall] * 4, materials.planks((150, 106, 66)), wall)
    for quarter in (0, 2):
        for place in np.arange(-2.5, 3.0, 0.5):
            here = room.at(turn=quarter * np.pi / 2).at(place, size[1] / 2)
            here.rng = np.random.default_rng([seed, 7])
            furniture.bookshelf(here, 0.5, 2.2, (112, 74, 48))
    lamps = [Lamp(np.array([[x, 0.0, 2.5]]), np.array([0.0, 0.0, -1.0]), np.full(3, 3.0))
             for x in (-1.5, 1.5)]
    half = size * (0.5, 0.5, 1.0)
    return Scene.assemble(room, lamps, Zone(half * (-1, -1, 0), half),
                          Zone(np.array([-1.0, -0.5, 1.05]), np.array([1.0, 0.5, 1.55])))


def opened(name: str) -> RgbdSource:
    """Return a recording, or a rendered walk."""
    kind, _, seed = name.partition(':')
    if kind not in ('walk', 'shelves'):
        return open_source(name)
    scene = furnished_room(int(seed)) if kind == 'walk' else equal_shelves(int(seed))
    reach, degrees = (0.6, 60.0) if kind == 'walk' else (0.4, 25.0)
    path = Returning(np.random.default_rng([int(seed), 1]), scene.free, reach, degrees, np.pi / 2)
    source = SyntheticSource(SyntheticOptions(
        seed=int(seed), frames=FRAMES, rate=RATE, camera=CAMERA), scene, path)
    source.frame = functools.cache(source.frame)  # rendered once for all variants
    return source


@dataclass(frozen=True)
class Reuse:
    """A keyframe that was found again: ``T_old_new`` between two stamps [ns]."""

    old: int
    new: int
    pose: np.ndarray


def followed(source: RgbdSource, changes: dict[str, Any]
             ) -> tuple[list[OdometryUpdate], list[Reuse]]:
    """Return the updates of a run, and the keyframes that were found again in it."""
    reuses, step = [], KeyframeSearch.step

    def recorded(search: KeyframeSearch, graph: KeyframeGraph,
                 frames: Mapping[int, PreparedFrame], *others: Any) -> tuple[RelativePose, ...]:
        accepted = step(search, graph, frames, *others)
        reuses.extend(Reuse(frames[m.first].stamp, frames[m.second].stamp, m.pose.matrix)
                      for m in accepted)
        return accepted

    odometry = Odometry(with_values(Settings(), changes))
    with mock.patch.object(KeyframeSearch, 'step', recorded):
        return [odometry.register_frame(frame) for frame in source.frames(raise_damage)], reuses


def false_reuses(reuses: list[Reuse], truth: Trajectory) -> int:
    """Return how many reuses are off by more than 5 cm or 3 degrees."""
    errors = [IncrementError.of(reuse.pose, np.eye(6), motion) for reuse in reuses
              if (motion := true_motion(truth, reuse.old, reuse.new)) is not None]
    return sum(error.is_wrong for error in errors)


def largest_step(updates: list[OdometryUpdate]) -> tuple[float, float]:
    """Return the largest difference of the pose from the measured motion [m, rad]."""
    steps = [se3.difference(now.T_odom_camera,
                            before.T_odom_camera @ now.increment.pose.matrix)
             for before, now in zip(updates, updates[1:])
             if now.increment is not None and not now.recovered]
    return (max(np.linalg.norm(step[:3]) for step in steps),
            max(np.linalg.norm(step[3:]) for step in steps))


def pose_nees(updates: list[OdometryUpdate], truth: Trajectory) -> float:
    """Return the mean NEES of the accumulated poses, from the first pose on."""
    known = [(update, true_pose(truth, update.stamp)) for update in updates]
    known = [(update, pose) for update, pose in known if pose is not None]
    T_odom_world = known[0][0].T_odom_camera @ se3.inverse(known[0][1])
    values = [nees(se3.difference(update.T_odom_camera, T_odom_world @ pose),
                   update.pose.covariance) for update, pose in known[1:]]
    return float(np.mean([value for value in values if value is not None]))


def row(name: str, variant: str, source: RgbdSource) -> str:
    """Return the row of a Markdown table."""
    updates, reuses = followed(source, VARIANTS[variant])
    stamps = np.array([update.stamp for update in updates])
    poses = np.array([update.T_odom_camera for update in updates])
    errors = compare(Trajectory(stamps, poses), source.ground_truth)
    translations, rotations = errors.relative()
    ate, rpe, turn = (np.sqrt(np.mean(values ** 2))
                      for values in (errors.positions(), translations, rotations))
    step, step_turn = largest_step(updates)
    return (f'| {name} | {variant} | {1e3 * ate:.2f} | {1e3 * rpe:.2f} | '
            f'{np.degrees(turn):.3f} | {pose_nees(updates, source.ground_truth):.1f} | '
            f'{len(reuses)} | {false_reuses(reuses, source.ground_truth)} | '
            f'{1e3 * step:.2f} | {np.degrees(step_turn):.3f} | '
            f'{np.mean([update.timing["total"] for update in updates]):.0f} |')


def main() -> None:
    """Print a table, a row per recording and variant."""
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    cv2.setNumThreads(1)
    print('| recording | reference | ATE [mm] | RPE 1 s [mm] | [deg] | NEES of the pose | '
          'reuses | false | largest correction [mm] | [deg] | frame [ms] |')
    print('|---|---|---|---|---|---|---|---|---|---|---|')
    for name in sys.argv[1:]:
        source = opened(name)
        for variant in VARIANTS:
            print(row(name, variant, source), flush=True)


if __name__ == '__main__':
    main()
