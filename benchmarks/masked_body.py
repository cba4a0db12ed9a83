# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
A robot that sees its own body, with and without a mask.

    python benchmarks/masked_body.py SEED...

A richly textured body, 0.6 m away and fixed to the camera, covers the lower right quarter of the
views of rendered rooms: 40 frames by hand, 640x480 with a Kinect's noise. Printed are the errors
of the last position, and what it costs to apply the mask to a frame.
"""

from __future__ import annotations

import dataclasses
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from aick_ros.frames.mask import mask_of
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.odometry import Odometry
from aick_ros.settings import SensorSettings, Settings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

FRAMES = 40
DISTANCE, NOISE = 0.6, 0.0008  # m, of the body and of its depth
BODY = np.s_[240:, 320:]


def with_body(frame: RgbdFrame, texture: np.ndarray, rng: np.random.Generator) -> RgbdFrame:
    """Return a frame in which the body covers a quarter of the view."""
    colour, depth = frame.colour.copy(), frame.depth.copy()
    colour[BODY] = np.clip(texture + rng.normal(0.0, 2.0, texture.shape), 0, 255)[..., None]
    depth[BODY] = rng.normal(DISTANCE, NOISE, texture.shape)
    return dataclasses.replace(frame, colour=colour, depth=depth)


def end_error(frames: Sequence[RgbdFrame], settings: Settings, true: np.ndarray) -> float:
    """Return the error of the last position [m]; true: the motion from first to last frame."""
    odometry = Odometry(settings)
    for frame in frames:
        update = odometry.register_frame(frame)
    return float(np.linalg.norm((se3.inverse(true) @ update.T_odom_camera)[:3, 3]))


def cost_of(frames: Sequence[RgbdFrame], sensor: SensorSettings) -> float:
    """Return the median time that applying the mask takes [s]."""
    mask, times = mask_of(sensor), []
    for frame in frames:
        assert mask is not None and frame.grey is not None  # made before, as without a mask
        start = time.perf_counter()
        mask.applied(frame)
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def main() -> None:
    """Print a row for each room."""
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        image = np.full((480, 640), 255, np.uint8)
        image[BODY] = 0
        sensor = SensorSettings(mask=str(Path(folder) / 'mask.png'))
        cv2.imwrite(sensor.mask, image)
        print('| room | path | no body | body | body behind a mask | cost of the mask |\n'
              '|---|---|---|---|---|---|')
        for seed in map(int, sys.argv[1:]):
            source = SyntheticSource(SyntheticOptions(seed=seed, frames=FRAMES))
            frames, rng = list(source.frames()), np.random.default_rng(seed)
            path = [source.ground_truth.at(frame.stamp) for frame in frames]
            length = sum(np.linalg.norm(np.diff([pose[:3, 3] for pose in path], axis=0), axis=1))
            texture = cv2.resize(rng.integers(0, 256, (60, 80), np.uint8), (320, 240),
                                 interpolation=cv2.INTER_NEAREST)
            bodies = [with_body(frame, texture, rng) for frame in frames]
            true = se3.inverse(path[0]) @ path[-1]
            errors = (f'{1e3 * end_error(seen, settings, true):.1f} mm' for seen, settings in (
                (frames, Settings()), (bodies, Settings()), (bodies, Settings(sensor=sensor))))
            print(f'| {seed} | {length:.2f} m | {" | ".join(errors)} | '
                  f'{1e3 * cost_of(bodies, sensor):.2f} ms |', flush=True)


if __name__ == '__main__':
    main()
