# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
An object that passes between a camera and a rendered room.

    python benchmarks/passing.py [--speed M_PER_S] [--hand] [--shares SHARE...] SEED...

A board with many keypoints moves at a constant speed through the view, 1.2 m away, from the left
to the right, as wide as some share of the view. The camera (320x240, 30 Hz, a Kinect's noise) is
at rest, or in a hand with ``--hand``. Printed are the largest error of the pose, that at the end,
the largest one without a board, the largest one in standard deviations that the odometry reports,
and the frames that were lost.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator

import cv2
import numpy as np
from at_rest import CAMERA

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource, prints
from aick_ros.sources.synthetic.renderer import Picture, Renderer
from aick_ros.sources.synthetic.surfaces import Rectangle

RATE = 30.0  # Hz
DISTANCE = 1.2  # m, from the camera to the board
HEIGHT = 1.3  # m, more than the view has there
BEFORE, AFTER = 20, 15  # frames that show no board
SHARES = 0.2, 0.3, 0.4, 0.5  # of the width of the view


class Rest:
    """The path of a camera that rests where another one begins."""

    def __init__(self, source: SyntheticSource) -> None:
        self._pose = source.ground_truth.poses[0]

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` at any time."""
        return self._pose


class Passage:
    """
    A board that passes before a camera.

    :param share: of the width of the view that it covers.
    :param speed: [m/s].
    """

    def __init__(self, seed: int, share: float, speed: float, is_held: bool) -> None:
        reach = DISTANCE * CAMERA.width / CAMERA.fx
        width = share * reach
        self._speed, self._first = speed, -reach / 2 - width - 0.05
        self.count = BEFORE + round((reach + width + 0.1) / speed * RATE) + AFTER
        self.options = SyntheticOptions(seed=seed, frames=self.count, camera=CAMERA, rate=RATE)
        source = room_of(self.options, is_held)
        self.poses = source.ground_truth.poses
        self._room = Renderer(source.scene.surfaces, CAMERA)
        self._board = Renderer([board(seed, width, self.poses[0])], CAMERA)

    def picture(self, index: int, has_board: bool) -> Picture:
        """Return what the camera sees, with or without the board."""
        seen = self._room.render(self.poses[index])
        if not has_board:
            return seen
        view, x = self.poses[0], self._first + self._speed * (index - BEFORE) / RATE
        moved = view @ se3.exp([x, 0, 0, 0, 0, 0]) @ se3.inverse(view)
        before = self._board.render(se3.inverse(moved) @ self.poses[index])
        is_nearer = np.nan_to_num(before.depth, nan=np.inf) < np.nan_to_num(seen.depth, nan=np.inf)
        return Picture(np.where(is_nearer[..., None], before.colour, seen.colour),
                       np.where(is_nearer, before.depth, seen.depth))

    def frames(self, has_board: bool) -> Iterator[RgbdFrame]:
        """Return the frames, with the noise of the camera."""
        return measured((self.picture(index, has_board) for index in range(self.count)),
                        self.options)


def room_of(options: SyntheticOptions, is_held: bool) -> SyntheticSource:
    """Return a room with a camera in a hand, or at rest where that begins."""
    source = SyntheticSource(options)
    return source if is_held else SyntheticSource(options, source.scene, Rest(source))


def measured(pictures: Iterable[Picture], options: SyntheticOptions) -> Iterator[RgbdFrame]:
    """Yield the frames of pictures, with the noise of the camera."""
    rng = np.random.default_rng(options.seed)
    for index, picture in enumerate(pictures):
        yield RgbdFrame(options.start + round(index * NANOSECONDS / RATE),
                        options.colour.measure(picture.colour, 1.0, rng),
                        options.depth.measure(picture.depth, CAMERA, rng), CAMERA)


def board(seed: int, width: float, view: np.ndarray) -> Rectangle:
    """Return a board whose left edge is in the middle of a view, 4x4, and which faces it."""
    picture = prints.spines(np.random.default_rng([seed, 9]), width, HEIGHT)
    return Rectangle(view @ se3.exp([0.0, -HEIGHT / 2, DISTANCE, 0.0, 0.0, 0.0]), width, HEIGHT,
                     picture)


def errors_of(frames: Iterable[RgbdFrame],
              poses: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the errors [m], those in standard deviations, and how many frames were lost."""
    odometry, first = Odometry(), se3.inverse(poses[0])
    errors, ratios, lost = [], [], 0
    for frame, pose in zip(frames, poses):
        update = odometry.register_frame(frame)
        lost += update.status not in (Status.OK, Status.FIRST_FRAME)
        error = se3.difference(update.T_odom_camera, first @ pose)[:3]
        sigma = np.sqrt(np.trace(update.pose.covariance[:3, :3]))
        errors.append(float(np.linalg.norm(error)))
        ratios.append(errors[-1] / sigma if sigma > 0 else 0.0)
    return np.array(errors), np.array(ratios), lost


def row(seed: int, share: float, speed: float, is_held: bool) -> str:
    """Return the row of a room and a board."""
    passage = Passage(seed, share, speed, is_held)
    errors, ratios, lost = errors_of(passage.frames(has_board=True), passage.poses)
    clear, _, _ = errors_of(passage.frames(has_board=False), passage.poses)
    return (f'| {seed} | {share:.2f} | {1e3 * errors.max():.1f} | {1e3 * errors[-1]:.1f} | '
            f'{1e3 * clear.max():.1f} | {ratios.max():.1f} | {lost} |')


def main() -> None:
    """Print a row for each room and board."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('seeds', type=int, nargs='+')
    parser.add_argument('--speed', type=float, default=0.7, help='of the board [m/s]')
    parser.add_argument('--hand', action='store_true', help='the camera is in a hand')
    parser.add_argument('--shares', type=float, nargs='+', default=SHARES)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    print('| room | share | largest [mm] | at the end [mm] | without [mm] | in sigma | lost |')
    print('|' + 7 * '---|')
    for seed in options.seeds:
        for share in options.shares:
            print(row(seed, share, options.speed, options.hand), flush=True)


if __name__ == '__main__':
    main()
