# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The path in the viewer Rerun, with the uncertainty of its positions, over time."""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from aick_ros.evaluation.scores.consistency import QUANTILES
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS

TIMELINE = 'time'
ESTIMATE, LOST = (23, 105, 170), (198, 40, 40)
"""Colours, as red, green and blue."""

UNTIL_NOW = rrb.VisibleTimeRanges(rrb.VisibleTimeRange(
    TIMELINE, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()))
"""Shows an entity with all that was logged of it before the time that is viewed."""

_ELLIPSOID = QUANTILES[3][0] ** 0.5  # half an axis of the 95 % ellipsoid [sigma]; derived


class Trail:
    """
    Logs positions as a growing path with 95 % ellipsoids, and sets the time of all else.

    :param stream: where to log to.
    """

    def __init__(self, stream: rr.RecordingStream) -> None:
        self._stream = stream
        self._start: int | None = None
        self._last: np.ndarray | None = None

    def set_time(self, stamp: int) -> None:
        """Let what is logged from now on have a stamp [ns]; the first one is the start."""
        self._start = stamp if self._start is None else self._start
        self._stream.set_time(TIMELINE, duration=(stamp - self._start) / NANOSECONDS)

    def add(self, position: np.ndarray, covariance: np.ndarray, is_lost: bool) -> None:
        """
        Log a position.

        :param covariance: 3x3; there is no ellipsoid where it is infinite.
        """
        if self._last is not None:
            self._stream.log('world/path', rr.LineStrips3D(
                [[self._last, position]], colors=[LOST if is_lost else ESTIMATE]))
        self._last = position.copy()
        if not np.isfinite(covariance).all():
            return
        variances, axes = np.linalg.eigh(covariance)
        axes[:, 0] *= np.sign(np.linalg.det(axes))  # a rotation, not a reflection
        self._stream.log('world/covariance', rr.Ellipsoids3D(
            centers=[position], half_sizes=[_ELLIPSOID * np.sqrt(np.maximum(variances, 0))],
            quaternions=[rr.Quaternion(xyzw=se3.to_quaternion(axes))], colors=[ESTIMATE]))
