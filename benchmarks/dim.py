# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Little light: how much the odometry errs with the colour images made darker and noisier.

    python benchmarks/dim.py [--frames N] CAMERA...

A CAMERA is a recording with ground truth or a kind of rendered camera, as for ``weights.py``. Its
colour images have a share of their brightness, and noise on top. Printed are the frames that were
lost, those registered by depth alone, and the root mean square of the error of the positions.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
from camera_table import print_camera_table
from weights import frames_of

from aick_ros.evaluation.scores.frame_record import FrameRecord, trajectory_of
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.odometry import Odometry
from aick_ros.registration.result import Evidence

FRAMES = 150
LIGHTS = ((1.0, 0.0), (0.5, 15.0), (0.3, 8.0), (0.2, 2.0), (0.2, 5.0), (0.1, 2.0), (0.1, 4.0),
          (0.05, 2.0), (0.0, 0.0))
"""Shares of the brightness, and standard deviations of the noise [grey levels]."""


def in_light(frame: RgbdFrame, share: float, sigma: float, rng: np.random.Generator) -> RgbdFrame:
    """Return a frame with a share of its brightness, and noise."""
    colour = share * frame.colour + rng.normal(0.0, sigma, frame.colour.shape)
    return dataclasses.replace(frame, colour=np.clip(colour, 0, 255).astype(np.uint8))


def rows(camera: str, count: int) -> Iterator[str]:
    """Yield the rows of a camera."""
    frames, truth = frames_of(camera, count)
    for share, sigma in LIGHTS:
        odometry, rng = Odometry(), np.random.default_rng(0)
        updates = [odometry.register_frame(in_light(frame, share, sigma, rng)) for frame in frames]
        errors = compare(trajectory_of([FrameRecord.of(update) for update in updates]), truth)
        assert errors is not None  # the poses have the stamps of the truth
        lost = sum(not update.status.ok for update in updates)
        by_depth = sum(update.evidence is Evidence.DEPTH_ALONE for update in updates)
        yield (f'| {camera} | {share:.0%} | {sigma:g} | {lost} | {by_depth} | '
               f'{1e3 * np.sqrt(np.mean(errors.positions() ** 2)):.1f} |')


def main() -> None:
    """Print the table."""
    print_camera_table(__doc__, ('camera', 'light', 'noise [grey levels]', 'lost',
                                 'by depth alone', 'ATE [mm]'), FRAMES, rows)


if __name__ == '__main__':
    main()
