# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Dead reckoning along a rendered row of bookshelves: Figure 10 of the paper.

Each frame is registered to the previous one, and the transforms are chained. An error of one of
them, above all of its rotation, distorts the rest of the path.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from aick_ros.evaluation.baselines import Baseline
from aick_ros.evaluation.scores.ground_truth import true_pose
from aick_ros.frames.rectification import rectified
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.corridor import WalkingPath, corridor

_RATE, _SPEED = 20.0, 0.25  # [Hz] by definition: as in the paper, [m/s] chosen
_ENDS = 2.4  # length of the corridor beyond both ends of the path [m]; chosen
_FRAME_STEP = 5  # every so many frames points are collected; chosen
_PIXEL_STEP = 5  # spacing of these points [px]; chosen
_MAX_DEPTH = 1.8  # [m]; only near points are shown, as in the paper; chosen


def walk(frames: int, seed: int = 1) -> SyntheticSource:
    """Return a rendered walk along shelves with the noise of a Kinect."""
    options = SyntheticOptions(seed=seed, frames=frames, rate=_RATE)
    duration = frames / _RATE
    scene = corridor(seed, np.ceil(_SPEED * duration + _ENDS))
    path = WalkingPath(np.random.default_rng([seed, 1]), scene.free, duration)
    return SyntheticSource(options, scene, path)


@dataclass(frozen=True)
class EndPoint:
    """
    Error at the end of dead reckoning; the fields are keys of the JSON.

    :param length_m: length of the true path.
    :param failed: number of failed registrations, for which the camera was assumed to stand still.
    """

    frames: int
    length_m: float
    error_m: float
    error_deg: float
    failed: int

    def to_json(self) -> dict[str, Any]:
        """Return the content of the JSON."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Reckoning:
    """
    Result of dead reckoning, in the world frame, from the true start.

    :param positions: estimated positions of the camera, Nx3 [m].
    :param true_positions: Nx3 [m].
    :param points: observed points, Mx3 [m].
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
    Chain the registrations of each frame to the previous one.

    :param frames: at least one, all covered by the ground truth, which is interpolated as in
        the evaluation.
    :param on_progress: called with the number of frames done.
    :raises ValueError: for a frame that the ground truth does not cover.
    """
    poses: list[np.ndarray] = []
    true_poses: list[np.ndarray] = []
    failed, previous = 0, None
    points, colours = [], []
    for number, frame in enumerate(frames):
        T_world_camera = true_pose(ground_truth, frame.stamp)
        if T_world_camera is None:
            raise ValueError(f'the ground truth does not cover the stamp {frame.stamp}')
        true_poses.append(T_world_camera)
        prepared = method.prepare(frame)
        T_previous_now = np.eye(4)
        if number:
            estimate = method.register(prepared, previous)
            failed += estimate.T_target_source is None
            if estimate.T_target_source is not None:
                T_previous_now = estimate.T_target_source
        poses.append(poses[-1] @ T_previous_now if poses else T_world_camera)
        previous = prepared
        if number % _FRAME_STEP == 0:
            near_points, near_colours = _near_points(frame)
            points.append(se3.transform(poses[-1], near_points))
            colours.append(near_colours)
        on_progress(number + 1)
    return Reckoning(_end_point(np.array(poses), np.array(true_poses), failed),
                     np.array(poses)[:, :3, 3], np.array(true_poses)[:, :3, 3],
                     np.concatenate(points), np.concatenate(colours))


def _near_points(frame: RgbdFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return points of a frame on a grid of pixels, Nx3 [m], and their colours."""
    pinhole = rectified(frame)
    colour, depth = pinhole.colour, pinhole.depth
    height, width = depth.shape
    v, u = (index.ravel() for index in np.mgrid[:height:_PIXEL_STEP, :width:_PIXEL_STEP])
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
