# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whether a distortion of depth images is found, and what its correction brings.

    python benchmarks/distortion.py [--frames N] SOURCE...

A SOURCE is a recording with ground truth, or a rendered room by a Kinect: ``good:SEED`` without
a distortion, ``distorted:SEED`` with a random one, of 4 mm (root mean square) at 1.5 m. Each is
followed without correction, with what is learned on the way, and once more with what was known at
the end of that.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
from collections.abc import Iterator

import cv2
import numpy as np
from markdown_page import table

from aick_ros.evaluation.scores.statistics import root_mean_square
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.frames.depth_distortion import NO_DISTORTION, DepthDistortion
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.sources import OnDamaged, RgbdSource, open_source, raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

FRAMES = 300
SIGMA = 0.004 / 1.5 ** 2  # 1/m
CORRELATED = 0.12  # of the width of the image: length over which a distortion is alike


class Distorted:
    """A rendered room by a camera whose inverse depth has an error that is a random image."""

    def __init__(self, kind: str, seed: int, frames: int) -> None:
        options = SyntheticOptions(seed=seed, frames=frames, rate=30.0)
        self._rendered, self._camera = SyntheticSource(options), options.camera
        self._sigma = SIGMA if kind == 'distorted' else 0.0
        self._seed = seed
        self.name, self.ground_truth = f'{kind}:{seed}', self._rendered.ground_truth

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._rendered)

    @functools.cached_property
    def error(self) -> np.ndarray:
        """Error of the inverse depth, HxW [1/m]."""
        camera = self._camera
        noise = np.random.default_rng([self._seed, 1]).standard_normal(
            (camera.height, camera.width))
        smooth = cv2.GaussianBlur(noise, (0, 0), CORRELATED * camera.width,
                                  borderType=cv2.BORDER_REFLECT)
        error: np.ndarray = self._sigma * (smooth - smooth.mean()) / smooth.std()
        return error

    @functools.cached_property
    def _all(self) -> list[RgbdFrame]:
        return [dataclasses.replace(frame, depth=(
            frame.depth / (1.0 + frame.depth * self.error)).astype(np.float32))
            for frame in self._rendered.frames(raise_damage)]

    def frames(self, on_damaged: OnDamaged = raise_damage) -> Iterator[RgbdFrame]:
        """Yield the frames."""
        return iter(self._all)


class Constant:
    """An estimate of a distortion that stays as it is."""

    def __init__(self, distortion: DepthDistortion) -> None:
        self.distortion = distortion

    def follow(self, camera: Camera) -> None:
        """Stay, whatever the camera sees."""

    def learn(self, equations: object) -> None:
        """Learn nothing."""


def opened(name: str, frames: int) -> RgbdSource:
    """Return a recording, or a rendered room."""
    kind, _, seed = name.partition(':')
    return (Distorted(kind, int(seed), frames) if kind in ('good', 'distorted')
            else open_source(name))


def row(source: RgbdSource, how: str, odometry: Odometry) -> tuple[str, ...]:
    """Return the row of a table."""
    updates = [odometry.register_frame(frame) for frame in source.frames(raise_damage)]
    errors = compare(Trajectory(np.array([update.stamp for update in updates]),
                                np.array([update.T_odom_camera for update in updates])),
                     source.ground_truth)
    translations, rotations = errors.relative()
    found = odometry.distortion
    agreement = ''
    if isinstance(source, Distorted) and source.error.any() and not found.is_none:
        ones = np.ones(source.error.shape, np.float32)
        learned = 1.0 / found.undistorted(ones) - 1.0
        agreement = f'{-np.corrcoef(learned.ravel(), source.error.ravel())[0, 1]:.2f}'
    return (source.name, how, f'{1e3 * 1.5 ** 2 * found.rms:.1f}', agreement,
            f'{1e3 * root_mean_square(errors.positions()):.2f}',
            f'{1e3 * root_mean_square(translations):.2f}',
            f'{np.degrees(root_mean_square(rotations)):.3f}')


def followed(constant: DepthDistortion | None) -> Odometry:
    """Return an odometry that learns a distortion, or corrects one that is given."""
    odometry = Odometry()
    if constant is not None:
        object.__setattr__(odometry._learned, 'distortion', Constant(constant))
        odometry.change_settings(odometry._settings)
    return odometry


def main() -> None:
    """Print a table, three rows per recording."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--frames', type=int, default=FRAMES)
    parser.add_argument('sources', nargs='+', metavar='SOURCE')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    rows = [('recording', 'distortion', 'at 1.5 m [mm]', 'correlation with the true one',
             'ATE [mm]', 'RPE 1 s [mm]', '[deg]')]
    for name in options.sources:
        source = opened(name, options.frames)
        rows.append(row(source, 'not corrected', followed(NO_DISTORTION)))
        learning = followed(None)
        rows.append(row(source, 'learned on the way', learning))
        if not learning.distortion.is_none:
            rows.append(row(source, 'known from the start', followed(learning.distortion)))
    print(table(rows))


if __name__ == '__main__':
    main()
