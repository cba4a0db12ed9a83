# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Topics of a running odometry node in the viewer Rerun."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from aick_ros.reports.jpeg import to_jpeg
from aick_ros.reports.trail import ESTIMATE, UNTIL_NOW, Trail

_KEYPOINT = (57, 255, 106)
_AXES = 0.1  # [m]; chosen
_MILLISECONDS = ' [ms]'


class LiveView:
    """
    Logs what a node publishes, as it comes.

    The world is the frame of the odometry: x forward, y left, z up.

    :param stream: where to log to.
    """

    def __init__(self, stream: rr.RecordingStream) -> None:
        self._stream, self._trail = stream, Trail(stream)
        self._position, self._message = np.zeros(3), ''
        stream.send_blueprint(_blueprint())
        stream.log('world', rr.ViewCoordinates.FLU, static=True)
        stream.log('world/base', rr.TransformAxes3D(_AXES), static=True)

    def add_pose(self, stamp: int, T_odom_base: np.ndarray, covariance: np.ndarray) -> None:
        """Log the pose of the base; an infinite covariance means lost, or lost until now."""
        self._trail.set_time(stamp)
        self._position = T_odom_base[:3, 3]
        self._stream.log('world/base', rr.Transform3D(
            translation=self._position, mat3x3=T_odom_base[:3, :3]))
        is_tracked = bool(np.isfinite(covariance).all())
        self._trail.add(self._position, covariance[:3, :3], not is_tracked)
        self._log_tracked(is_tracked)

    def add_lost(self, stamp: int) -> None:
        """Log that a frame has no pose."""
        self._trail.set_time(stamp)
        self._log_tracked(False)

    def add_path(self, positions: np.ndarray) -> None:
        """Log the path before, Nx3."""
        self._stream.log('world/path_before', rr.LineStrips3D([positions], colors=[ESTIMATE]),
                         static=True)

    def add_image(self, stamp: int, colour: np.ndarray) -> None:
        """Log an image, HxWx3 or HxW uint8."""
        self._trail.set_time(stamp)
        self._stream.log('image', rr.EncodedImage(contents=to_jpeg(colour),
                                                  media_type='image/jpeg'))

    def add_keypoints(self, stamp: int, positions: np.ndarray) -> None:
        """Log the keypoints of a frame in the world, Nx3."""
        self._trail.set_time(stamp)
        self._stream.log('world/keypoints', rr.Points3D(
            positions, colors=[_KEYPOINT], radii=[0.005]))

    def add_health(self, message: str, numbers: Mapping[str, float]) -> None:
        """Log the diagnostics, at the time of the last frame: their clock may be another one."""
        for name, number in numbers.items():
            group = 'times' if name.endswith(_MILLISECONDS) else 'health'
            self._stream.log([group, name.removesuffix(_MILLISECONDS)], rr.Scalars(number))
        if message != self._message:
            self._message = message
            self._stream.log('status/changes', rr.TextLog(message))

    def _log_tracked(self, is_tracked: bool) -> None:
        self._stream.log('status/tracked', rr.Scalars(float(is_tracked)))


def _blueprint() -> rrb.Blueprint:
    """Return the layout: the space with all of the path, the image, and series below."""
    return rrb.Blueprint(rrb.Vertical(
        rrb.Horizontal(
            rrb.Spatial3DView(origin='world', name='space', overrides={
                f'world/{name}': UNTIL_NOW for name in ('path', 'covariance')}),
            rrb.Spatial2DView(origin='image', name='image and matches'),
            column_shares=[3, 2]),
        rrb.Horizontal(
            rrb.TimeSeriesView(origin='times', name='times [ms]'),
            rrb.TimeSeriesView(origin='status', name='tracked'),
            rrb.TextLogView(origin='status', name='status')),
        row_shares=[3, 1]), collapse_panels=True)
