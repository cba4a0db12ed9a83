# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The time of one frame as a share of cv2.Odometry's on the same pair, frame by frame in turn."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import islice
from typing import Any

import numpy as np

from aick_ros.evaluation.baselines.registry import METHODS, make
from aick_ros.odometry import Odometry
from aick_ros.sources import RgbdSource, raise_damage

_WARM_UP = 5  # frames


def frame_time(source: RgbdSource) -> dict[str, float | int]:
    """
    Return medians of processor time, which other programs on the machine disturb least.

    :returns: ``share``: all of a frame (keypoints, registration, refinement, covariance) by all
        that cv2.Odometry on depth does for it (undistortion, pyramids, normals, registration);
        ``share_of_registration``: the same by its registration alone. Milliseconds of each.
    """
    method = METHODS['opencv-depth']
    odometry, rival, before, times = Odometry(), make(method.factory, method.options), None, []
    for index, frame in enumerate(islice(source.frames(raise_damage), 60)):
        ours, _ = _timed(odometry.register_frame, frame)
        prepare, prepared = _timed(rival.prepare, frame)
        if before is not None:
            register, _ = _timed(rival.register, prepared, before)
            if index >= _WARM_UP:
                times.append((ours, prepare, register))
        before = prepared
    ours, prepare, register = np.array(times).T
    return {'frames': len(times), 'share': float(np.median(ours / (prepare + register))),
            'share_of_registration': float(np.median(ours / register)),
            'ours_ms': 1e3 * float(np.median(ours)),
            'opencv_ms': 1e3 * float(np.median(prepare + register))}


def _timed(work: Callable[..., Any], *arguments: Any) -> tuple[float, Any]:
    """Return the processor time of a call [s] and what it returns."""
    start = time.process_time()
    result = work(*arguments)
    return time.process_time() - start, result
