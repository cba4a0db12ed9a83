# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Pure dead reckoning along a rendered row of bookshelves: Figure 10 of the paper.

Each frame is registered to the one before it, and the transforms are chained. Whatever is wrong
with one of them, its rotation above all, bends all that comes after it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from aick_ros.evaluation.baselines import Baseline
from aick_ros.evaluation.baselines.dense import undistorted
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.corridor import WalkingPath, corridor

FRAMES = 1000
_RATE, _SPEED = 20.0, 0.25  # [Hz], [m/s]; the rate is the paper's
_ENDS = 2.4  # [m] of the corridor at which nobody walks
_NEAREST_FRAMES = 5  # one of so many gives its points
_STEP = 5  # [px] between these points
_MAX_DEPTH = 1.8  # [m]; only what is near is shown, as in the paper


def walk(frames: int, seed: int = 1) -> SyntheticSource:
    """Return somebody's walk along shelves, of so many frames, with a Kinect's noise."""
    options = SyntheticOptions(seed=seed, frames=frames, rate=_RATE)
    duration = frames / _RATE
    scene = corridor(seed, np.ceil(_SPEED * duration + _ENDS))
    path = WalkingPath(np.random.default_rng([seed, 1]), scene.free, duration)
    return SyntheticSource(options, scene, path)


@dataclass(frozen=True)
class EndPoint:
    """
    Where dead reckoning ends; the fields are keys of the JSON.

    :param length_m: of the true path.
    :param failed: registrations of which there were none; the camera was taken to stand still.
    """

    frames: int
    length_m: float
    error_m: float
    error_deg: float
    failed: int

    def to_json(self) -> dict[str, Any]:
        """Return what ``json.dumps`` takes."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Reckoning:
    """
    What dead reckoning makes of a walk, in the world of its true start.

    :param positions: Nx3, of the camera [m]; true_positions likewise.
    :param points: Mx3, what it saw [m].
    :param colours: Mx3 uint8 (red, green, blue), of the points.
    """

    end: EndPoint
    positions: np.ndarray
    true_positions: np.ndarray
    points: np.ndarray
    colours: np.ndarray


def reckon(method: Baseline, frames: Iterable[RgbdFrame], ground_truth: Trajectory,
           on_progress: Callable[[int], None] = lambda frames: None) -> Reckoning:
    """
    Chain the registrations of frames to the ones before them.

    :param frames: at least one, all inside the ground truth.
    :param on_progress: told the number of frames done.
    """
    poses, truths, failed, before = [], [], 0, None
    points, colours = [], []
    for number, frame in enumerate(frames):
        truths.append(ground_truth.at(frame.stamp))
        prepared = method.prepare(frame)
        T_before_now = np.eye(4)
        if number:
            estimate = method.register(prepared, before)
            failed += estimate.T_target_source is None
            if estimate.T_target_source is not None:
                T_before_now = estimate.T_target_source
        poses.append(poses[-1] @ T_before_now if poses else truths[0])
        before = prepared
        if number % _NEAREST_FRAMES == 0:
            seen, painted = _near_points(frame)
            points.append(se3.transform(poses[-1], seen))
            colours.append(painted)
        on_progress(number + 1)
    return Reckoning(_end_point(np.array(poses), np.array(truths), failed),
                     np.array(poses)[:, :3, 3], np.array(truths)[:, :3, 3],
                     np.concatenate(points), np.concatenate(colours))


def _near_points(frame: RgbdFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return points of a frame on a grid of pixels, Nx3 [m], and their colours."""
    colour, depth = undistorted(frame)
    v, u = (index.ravel() for index in np.mgrid[:depth.shape[0]:_STEP, :depth.shape[1]:_STEP])
    z = depth[v, u].astype(np.float64)
    with np.errstate(invalid='ignore'):
        kept = (z > 0) & (z < _MAX_DEPTH)
    u, v, z = u[kept], v[kept], z[kept]
    camera = frame.camera
    points = np.column_stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z])
    return points, colour[v, u]


def _end_point(poses: np.ndarray, truths: np.ndarray, failed: int) -> EndPoint:
    error = se3.inverse(truths[-1]) @ poses[-1]
    steps = np.diff(truths[:, :3, 3], axis=0)
    return EndPoint(len(poses), float(np.linalg.norm(steps, axis=1).sum()),
                    float(np.linalg.norm(error[:3, 3])),
                    float(np.degrees(se3.angle(error[:3, :3]))), failed)
