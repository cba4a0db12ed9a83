# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Recordings as another camera would have made them: what the odometry makes of the same scene.

    python benchmarks/other_views.py [--frames N] CAMERA...

A CAMERA is a recording with ground truth or a kind of rendered camera, as for ``weights.py``. Its
images get smaller, fewer, darker, with less depth, with a part of the robot in view, and so on.
Then the odometry begins at other frames, also with a half and a third of the rate. Printed are the
frames that were lost, those in which keypoints seem to move by themselves, which none do in a
static scene, the root mean square of the error of the positions, and the share of the increments
inside their 95 % ellipsoid.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence

import cv2
import numpy as np
from camera_table import print_camera_table
from run_scores import RunScores
from weights import frames_of

from aick_ros.evaluation.scores.consistency import Consistency
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.trajectory import Trajectory

FRAMES = 150
SHORT, STEP = 18, 6  # frames from each other start, and from start to start

Change = Callable[[RgbdFrame, np.random.Generator], RgbdFrame]


def smaller(factor: int) -> Change:
    """Return what makes the images smaller by a whole factor."""
    def change(frame: RgbdFrame, rng: np.random.Generator) -> RgbdFrame:
        camera, first = frame.camera, factor // 2
        width, height = camera.width // factor, camera.height // factor
        return dataclasses.replace(
            frame, colour=cv2.resize(frame.colour, (width, height), interpolation=cv2.INTER_AREA),
            depth=frame.depth[first::factor, first::factor][:height, :width].copy(),
            camera=dataclasses.replace(
                camera, width=width, height=height, fx=camera.fx / factor, fy=camera.fy / factor,
                cx=(camera.cx + 0.5) / factor - 0.5, cy=(camera.cy + 0.5) / factor - 0.5))
    return change


def with_depth(change: Callable[[np.ndarray, np.random.Generator], np.ndarray]) -> Change:
    """Return what changes the depth image."""
    return lambda frame, rng: dataclasses.replace(
        frame, depth=change(frame.depth, rng).astype(np.float32))


def holes(depth: np.ndarray, rng: np.random.Generator, share: float = 0.8) -> np.ndarray:
    """Return a depth image of which a share is missing, in blots."""
    blots = cv2.resize(rng.random([size // 16 for size in depth.shape]), depth.shape[::-1])
    return np.where(blots < np.quantile(blots, share), np.nan, depth)


def speckled(share: float) -> Change:
    """Return what removes a share of the depth image, pixel by pixel."""
    return with_depth(lambda depth, rng: np.where(rng.random(depth.shape) < share, np.nan, depth))


def blurred(frame: RgbdFrame, rng: np.random.Generator) -> RgbdFrame:
    """Return a frame whose lens is out of focus, by 3 px."""
    return dataclasses.replace(frame, colour=cv2.GaussianBlur(frame.colour, (0, 0), 3.0))


def with_gripper(frame: RgbdFrame, rng: np.random.Generator) -> RgbdFrame:
    """Return a frame with a part of the robot before the lower seventh of the view."""
    colour, depth = frame.colour.copy(), frame.depth.copy()
    top = depth.shape[0] * 6 // 7
    shape = depth.shape[0] - top, depth.shape[1]
    pattern = np.random.default_rng(5).normal(110.0, 25.0, (shape[0] // 12, shape[1] // 24))
    grey = cv2.resize(pattern, shape[::-1])[..., None] + rng.normal(0.0, 3.0, (*shape, 3))
    colour[top:] = np.clip(grey, 0, 255)
    depth[top:] = 0.6 + rng.normal(0.0, 0.002, shape)
    return dataclasses.replace(frame, colour=colour, depth=depth)


CHANGES: dict[str, Change] = {
    'none': lambda frame, rng: frame,
    'half the resolution': smaller(2),
    'a quarter of the resolution': smaller(4),
    'out of focus': blurred,
    'no depth beyond 1.2 m': with_depth(lambda depth, rng: np.where(depth > 1.2, np.nan, depth)),
    '80 % of the depth missing': with_depth(holes),
    'single pixels of depth missing, 1 %': speckled(0.01),
    'single pixels of depth missing, 10 %': speckled(0.1),
    'depth noise of 15 mm at 1 m': with_depth(
        lambda depth, rng: depth + 0.015 * depth ** 2 * rng.standard_normal(depth.shape)),
    'depth 3 % too long': with_depth(lambda depth, rng: 1.03 * depth),
    'a gripper in view': with_gripper}

WITHOUT_DEPTH = {'no depth for half a second': slice(40, 55),
                 'no depth in every second frame': slice(1, None, 2)}


def without_depth(frames: Sequence[RgbdFrame], missing: slice) -> list[RgbdFrame]:
    """Return the frames, some of them without depth."""
    found = list(frames)
    for i in range(*missing.indices(len(found))):
        found[i] = dataclasses.replace(found[i], depth=np.full_like(found[i].depth, np.nan))
    return found


def row(camera: str, name: str, runs: Sequence[Sequence[RgbdFrame]], truth: Trajectory) -> str:
    """Return the row of some runs over a camera's frames, the errors in the mean of the runs."""
    found = [RunScores.of(frames, truth) for frames in runs]
    consistency = Consistency.of(nees for run in found for nees in run.nees)
    frames, lost, with_objects = (sum(counts) for counts in zip(
        *((run.frames, run.lost, run.with_objects) for run in found)))
    return (f'| {camera} | {name} | {frames} | {lost} | {with_objects} | '
            f'{1e3 * np.mean([run.ate for run in found]):.1f} | '
            f'{consistency.inside_95 or 0.0:.2f} |')


def rows(camera: str, count: int) -> Iterator[str]:
    """Yield the rows of a camera."""
    frames, truth = frames_of(camera, count)
    for name, change in CHANGES.items():
        rng = np.random.default_rng(7)
        yield row(camera, name, [[change(frame, rng) for frame in frames]], truth)
    for name, missing in WITHOUT_DEPTH.items():
        yield row(camera, name, [without_depth(frames, missing)], truth)
    for every, name in ((1, 'other starts'), (2, 'half the rate'), (3, 'a third of the rate')):
        fewer = frames[::every]
        yield row(camera, name, [fewer[start:start + SHORT] for start in range(
            0, len(fewer) - SHORT + 1, STEP)], truth)


def main() -> None:
    """Print the table."""
    print_camera_table(__doc__, (
        'camera', 'change', 'frames', 'lost', 'with objects', 'ATE [mm]', 'increments inside'),
        FRAMES, rows)


if __name__ == '__main__':
    main()
