# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whether a misalignment of the camera is found, and what its correction brings.

    python benchmarks/misalignment.py SOURCE...

A SOURCE is a recording with ground truth, or a rendered room of 120 frames by a Kinect with a
defect: ``good:SEED`` has none; the depth of ``lever:SEED`` is registered 25 mm and 1 degree wrong,
that of ``turned:SEED`` 15 mm and 2 degrees; that of ``late:SEED`` is taken 15 ms later than its
stamps say. The colour camera of ``lens:SEED`` has a lens with a radial coefficient of -0.1, that
of ``lens+:SEED`` one of 0.05, which the calibration does not have. ``raw:SEED`` gives both images
as its two cameras take them, 26 mm apart, with focal lengths of 525 and 585 px, and the
calibration of the depth camera for both.
"""

from __future__ import annotations

import dataclasses
import functools
import sys
from collections.abc import Iterator
from unittest import mock

import cv2
import numpy as np

from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.messages.depth_to_colour import DepthToColour
from aick_ros.odometry import Odometry
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.sources import OnDamaged, RgbdSource, open_source, raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

FRAMES = 120
OFFSETS = {'lever': np.array([-0.025, 0.002, 0.003, *np.radians([0.5, -0.7, 0.4])]),
           'turned': np.array([0.009, -0.012, 0.0, *np.radians([1.4, 1.2, -0.8])])}
DELAYS = {'late': 0.015}
LENSES = {'lens': -0.1, 'lens+': 0.05}
KINDS = 'good', 'raw', *OFFSETS, *DELAYS, *LENSES
DEPTH_CAMERA = Camera(640, 480, 585.0, 585.0, 319.5, 239.5)
T_COLOUR_DEPTH = se3.exp(np.array([-0.026, 0.001, -0.001, *np.radians([0.2, -0.3, 0.1])]))


class Beside:
    """The path of a camera beside that of another one."""

    def __init__(self, source: SyntheticSource, start: int) -> None:
        self._source, self._start = source, start

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` at a time [s]."""
        pose: np.ndarray = self._source.pose(
            self._start + round(NANOSECONDS * time)) @ T_COLOUR_DEPTH
        return pose


def bent(colour: np.ndarray, camera: Camera, radial: float) -> np.ndarray:
    """Return a colour image as a lens with a radial coefficient shows it, HxWx3."""
    lens = dataclasses.replace(camera, distortion_model='plumb_bob', distortion=(radial, 0, 0, 0))
    v, u = np.indices(colour.shape[:2]).reshape(2, -1).astype(float)
    pixels = lens.normalize(np.column_stack([u, v])) * [camera.fx, camera.fy]
    columns, rows = (pixels + [camera.cx, camera.cy]).astype(np.float32).T.reshape(
        2, *colour.shape[:2])
    return cv2.remap(colour, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


class Misaligned:
    """A rendered room, by a camera with a defect."""

    def __init__(self, kind: str, seed: int) -> None:
        options = SyntheticOptions(seed=seed, frames=FRAMES, depth_delay=DELAYS.get(kind, 0.0))
        self._rendered = SyntheticSource(options)
        self.name, self.ground_truth = f'{kind}:{seed}', self._rendered.ground_truth
        self._offset, self._radial = OFFSETS.get(kind), LENSES.get(kind)
        self._camera = options.camera
        self._depth = SyntheticSource(
            dataclasses.replace(options, camera=DEPTH_CAMERA), self._rendered.scene,
            Beside(self._rendered, options.start)) if kind == 'raw' else None

    def __len__(self) -> int:
        """Return the number of frames."""
        return FRAMES

    def frames(self, on_damaged: OnDamaged = raise_damage) -> Iterator[RgbdFrame]:
        """Yield the frames, whose depth counts as registered and as of the same time."""
        return iter(self._all)

    @functools.cached_property
    def _all(self) -> list[RgbdFrame]:
        frames = [dataclasses.replace(frame, depth_stamp=None)
                  for frame in self._rendered.frames()]
        if self._depth is not None:
            return [dataclasses.replace(frame, depth=of_depth.depth, camera=DEPTH_CAMERA)
                    for frame, of_depth in zip(frames, self._depth.frames())]
        if self._radial is not None:
            return [dataclasses.replace(frame, colour=bent(
                frame.colour, self._camera, self._radial)) for frame in frames]
        if self._offset is None:
            return frames
        wrong = DepthToColour(self._camera, self._camera, se3.exp(-self._offset))
        return [dataclasses.replace(frame, depth=wrong.reproject(frame.depth))
                for frame in frames]


def opened(name: str) -> RgbdSource:
    """Return a recording, or a rendered room."""
    kind, _, seed = name.partition(':')
    if kind in KINDS:
        return Misaligned(kind, int(seed))
    return open_source(name)


def row(source: RgbdSource, corrected: bool) -> str:
    """Return the row of a Markdown table."""
    odometry, updates = Odometry(), []
    with mock.patch.object(MisalignmentEstimate, 'learn', MisalignmentEstimate.learn
                           if corrected else lambda estimate, sample: None):
        updates = [odometry.register_frame(frame) for frame in source.frames(raise_damage)]
    errors = compare(Trajectory(np.array([update.stamp for update in updates]),
                                np.array([update.T_odom_camera for update in updates])),
                     source.ground_truth)
    translations, rotations = errors.relative()
    ate, rpe, turn = (np.sqrt(np.mean(values ** 2))
                      for values in (errors.positions(), translations, rotations))
    found = odometry.misalignment.description or 'none'
    return (f'| {source.name} | {found if corrected else "not corrected"} | {1e3 * ate:.2f} | '
            f'{1e3 * rpe:.2f} | {np.degrees(turn):.3f} |')


def main() -> None:
    """Print a table, two rows per recording."""
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    cv2.setNumThreads(1)
    print('| recording | misalignment at the end | ATE [mm] | RPE 1 s [mm] | [deg] |')
    print('|---|---|---|---|---|')
    for name in sys.argv[1:]:
        source = opened(name)
        for corrected in (False, True):
            print(row(source, corrected), flush=True)


if __name__ == '__main__':
    main()
