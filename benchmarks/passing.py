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
import functools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from at_rest import CAMERA

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
from aick_ros.sources.synthetic import (
    ColourSensor, DepthSensor, SyntheticOptions, SyntheticSource, prints)
from aick_ros.sources.synthetic.renderer import Picture, Renderer
from aick_ros.sources.synthetic.surfaces import Rectangle

RATE = 30.0  # Hz
DISTANCE = 1.2  # m, from the camera to the board
HEIGHT = 1.3  # m, more than the view has there
BEFORE, AFTER = 20, 15  # frames that show no board
SHARES = 0.2, 0.3, 0.4, 0.5  # of the width of the view
FALSE = 0.01  # m; no noise moves the camera as far from one frame to the next


class Room:
    """
    A rendered room, and the path of a camera through it.

    What was rendered is kept: the recordings of a room have poses in common.
    """

    def __init__(self, seed: int) -> None:
        self._source = SyntheticSource(SyntheticOptions(seed=seed, frames=1, camera=CAMERA))
        self._renderer = Renderer(self._source.scene.surfaces, CAMERA)
        self._pictures: dict[bytes, Picture] = {}

    def poses(self, count: int, is_held: bool) -> np.ndarray:
        """Return those of a camera in a hand, or at rest where that begins, Nx4x4."""
        stamps = [stamp_of(index if is_held else 0) for index in range(count)]
        return np.array([self._source.pose(stamp) for stamp in stamps])

    def picture(self, pose: np.ndarray) -> Picture:
        """Return what the camera sees from a pose."""
        key = pose.tobytes()
        if key not in self._pictures:
            self._pictures[key] = self._renderer.render(pose)
        return self._pictures[key]


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
        self._room, self._seed = room_of(seed), seed
        self.poses = self._room.poses(self.count, is_held)
        self._board = Renderer([board(seed, width, self.poses[0])], CAMERA)

    def picture(self, index: int, has_board: bool = True) -> Picture:
        """Return what the camera sees, with or without the board."""
        seen = self._room.picture(self.poses[index])
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
                        self._seed)


@functools.lru_cache(maxsize=1)
def room_of(seed: int) -> Room:
    """Return the room of a seed."""
    return Room(seed)


def stamp_of(index: int) -> int:
    """Return the stamp of a frame [ns]."""
    return SyntheticOptions.start + round(index * NANOSECONDS / RATE)


def measured(pictures: Iterable[Picture], seed: int | Sequence[int]) -> Iterator[RgbdFrame]:
    """Yield the frames of pictures, with the noise of the camera."""
    rng, colour, depth = np.random.default_rng(seed), ColourSensor(), DepthSensor()
    for index, picture in enumerate(pictures):
        yield RgbdFrame(stamp_of(index), colour.measure(picture.colour, 1.0, rng),
                        depth.measure(picture.depth, CAMERA, rng), CAMERA)


def board(seed: int, width: float, view: np.ndarray) -> Rectangle:
    """Return a board whose left edge is in the middle of a view, 4x4, and which faces it."""
    picture = prints.spines(np.random.default_rng([seed, 9]), width, HEIGHT)
    return Rectangle(view @ se3.exp([0.0, -HEIGHT / 2, DISTANCE, 0.0, 0.0, 0.0]), width, HEIGHT,
                     picture)


@dataclass(frozen=True)
class Errors:
    """
    What the poses of a recording differ from the truth by.

    :param positions: of the frames [m].
    :param ratios: of the frames, in standard deviations that the odometry reports.
    :param false: frames that were registered with a motion wrong by more than ``FALSE``.
    :param lost: frames that were not registered.
    """

    positions: np.ndarray
    ratios: np.ndarray
    false: int
    lost: int

    @property
    def largest(self) -> float:
        """The largest error of a position [mm]."""
        return float(1e3 * self.positions.max())

    @property
    def last(self) -> float:
        """The error of the last position [mm]."""
        return float(1e3 * self.positions[-1])


def errors_of(frames: Iterable[RgbdFrame], poses: np.ndarray) -> Errors:
    """Return the errors of the odometry on the frames of a camera with these poses, Nx4x4."""
    odometry, first = Odometry(), se3.inverse(poses[0])
    errors, ratios, false, lost, before = [], [], 0, 0, None
    for frame, pose in zip(frames, first @ poses):
        update = odometry.register_frame(frame)
        is_lost = update.status not in (Status.OK, Status.FIRST_FRAME)
        lost += is_lost
        now = update.T_odom_camera, pose
        if before is not None and not is_lost:
            false += motion_error(before, now) > FALSE
        before = now
        sigma = np.sqrt(np.trace(update.pose.covariance[:3, :3]))
        errors.append(float(np.linalg.norm(se3.difference(*now)[:3])))
        ratios.append(errors[-1] / sigma if sigma > 0 else 0.0)
    return Errors(np.array(errors), np.array(ratios), false, lost)


def motion_error(before: tuple[np.ndarray, np.ndarray],
                 now: tuple[np.ndarray, np.ndarray]) -> float:
    """Return the error of the motion [m] between two pairs of a pose, 4x4, and the true one."""
    motion, true = (se3.inverse(start) @ end for start, end in zip(before, now))
    return float(np.linalg.norm(se3.difference(motion, true)[:3]))


def row(seed: int, share: float, speed: float, is_held: bool) -> str:
    """Return the row of a room and a board."""
    passage = Passage(seed, share, speed, is_held)
    errors = errors_of(passage.frames(has_board=True), passage.poses)
    clear = errors_of(passage.frames(has_board=False), passage.poses)
    return (f'| {seed} | {share:.2f} | {errors.largest:.1f} | {errors.last:.1f} | '
            f'{clear.largest:.1f} | {errors.ratios.max():.1f} | {errors.lost} |')


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
