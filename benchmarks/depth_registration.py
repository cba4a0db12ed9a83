# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Measures how long the reprojection of depth takes, median and fastest of many rendered images.

    OPENBLAS_NUM_THREADS=1 python benchmarks/depth_registration.py
"""

from __future__ import annotations

import dataclasses
import json
import time

import cv2
import numpy as np

from aick_ros.evaluation.scores.machine import machine_facts
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.messages.depth_to_colour import DepthToColour
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

T_COLOUR_DEPTH = se3.exp([0.025, 0.0, 0.0, 0.0, 0.005, 0.0])
VGA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
DISTORTED = dataclasses.replace(VGA, distortion=(0.26, -0.95, -0.005, 0.003, 1.16))
HD = Camera(1280, 720, 910.0, 910.0, 639.5, 359.5)
TIMES = 10


def milliseconds(colour_camera: Camera, depths: list[np.ndarray]) -> str:
    """Return how long one image takes, after the first."""
    reprojection = DepthToColour(VGA, colour_camera, T_COLOUR_DEPTH)
    reprojection.reproject(depths[0])
    taken = []
    for depth in depths * TIMES:
        start = time.perf_counter()
        reprojection.reproject(depth)
        taken.append(1e3 * (time.perf_counter() - start))
    return f'{np.median(taken):.1f} ms, fastest {min(taken):.1f} ms'


def main() -> None:
    """Print the machine and the times."""
    cv2.setNumThreads(1)
    print(json.dumps(machine_facts()))
    source = SyntheticSource(SyntheticOptions(frames=5))
    depths = [source.frame(i).depth for i in range(len(source))]
    for name, camera in (('640x480', VGA), ('640x480, distorted', DISTORTED), ('1280x720', HD)):
        print(f'640x480 to {name}: {milliseconds(camera, depths)}')


if __name__ == '__main__':
    main()
