# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keypoints of one frame tracked into another, to a fraction of a pixel."""

from __future__ import annotations

import numpy as np

from aick_ros import kernels
from aick_ros.frames import depth
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.last_results import LastResults
from aick_ros.registration.refinement.lucas_kanade import (
    Pyramid, track_coarsely, track_there_and_back)
from aick_ros.registration.refinement.windows import Windows
from aick_ros.registration.tracks import Tracks
from aick_ros.settings import RefinementSettings, SensorSettings

_LEVELS = 2  # of the image pyramid; chosen: tracks up to 4 * window / 2 pixels of error
_NEAREST = 0.05  # m; chosen: keypoints that the first pose puts nearer are skipped
_CACHED_FRAMES = 3  # chosen: a frame, its keyframe, and one in reserve


class Tracker:
    """
    Tracks keypoints by the image around them, from where a first pose puts them.

    A detector locates a keypoint to about a pixel of its pyramid level, independently in each
    image. Aligning the two images around it locates one relative to the other to a tenth of
    that, and finds keypoints that were not detected in the target.
    """

    def __init__(self, settings: RefinementSettings, sensor: SensorSettings) -> None:
        self._settings = settings
        self._sensor = sensor
        self._windows = LastResults(self._windows_of, _CACHED_FRAMES)
        self._pyramids = LastResults(self._pyramid_of, _CACHED_FRAMES)

    def track(self, source: PreparedFrame, target: PreparedFrame,
              T_target_source: np.ndarray, is_near: bool = False) -> Tracks:
        """
        Find the keypoints of the source in the target.

        What the windows around them show is measured once for a source.

        :param T_target_source: first pose, 4x4, with an error of at most some ten pixels.
        :param is_near: whether it has one of at most two pixels.
        """
        camera = target.frame.camera
        points = source.keypoints.positions[:self._settings.max_tracks].astype(np.float64)
        kept, expected = _visible(points, T_target_source, camera)
        windows = self._windows(source)[kept]
        warps = windows.warps(camera, T_target_source)
        seen, found = track_there_and_back(
            self._pyramids(source), self._pyramids(target),
            source.keypoints.pixels.take(kept, axis=0), expected, warps, is_near)
        rows, = found.nonzero()
        kept, seen, windows = kept.take(rows), seen.take(rows, axis=0), windows[rows]
        seen = seen - windows.shifts(camera, T_target_source, warps.take(rows, axis=0))
        rays = camera.normalize(seen)
        if not np.isfinite(rays).all():
            valid = np.flatnonzero(np.isfinite(rays).all(axis=1))
            kept, seen, rays, windows = kept[valid], seen[valid], rays[valid], windows[valid]
        return Tracks(kept, windows.points, rays,
                      depth.sample(target.frame.depth, seen, self._sensor), windows.sigmas)

    def track_back(self, source: PreparedFrame, target: PreparedFrame,
                   T_target_source: np.ndarray, is_near: bool = False) -> Tracks:
        """
        Find the keypoints of the target in the source, which needs none of its own.

        :param T_target_source: first pose, 4x4, with an error of at most some ten pixels.
        :param is_near: whether it has one of at most two pixels.
        :returns: tracks of the source in the target all the same, with depths of the source;
            ``keypoints`` are those of the target.
        """
        seen = self.track(target, source, se3.inverse(T_target_source), is_near)
        return seen.reversed(self._sensor)

    def track_few(self, source: PreparedFrame, target: PreparedFrame,
                  T_target_source: np.ndarray, count: int) -> Tracks:
        """
        Find some keypoints of the source in the target, to half a pixel, without their depths.

        :param T_target_source: first pose, 4x4, with an error of at most some thirty pixels.
        :param count: about how many keypoints are sought, weak and strong ones.
        """
        camera = target.frame.camera
        windows = self._windows(source)
        step = max(1, len(windows.points) // count)
        kept, expected = _visible(windows.points[::step], T_target_source, camera)
        rows = step * kept
        seen, found = track_coarsely(
            self._pyramids(source), self._pyramids(target),
            source.keypoints.pixels.take(rows, axis=0), expected,
            windows[rows].warps(camera, T_target_source))
        rays = camera.normalize(seen)
        kept, = (found & (rays[:, 0] == rays[:, 0])).nonzero()  # NaN: there is no such ray
        rows, depths = rows.take(kept), np.empty(len(kept))
        depths.fill(np.nan)
        return Tracks(rows, windows.points.take(rows, axis=0), rays.take(kept, axis=0), depths,
                      windows.sigmas.take(rows))

    def _pyramid_of(self, frame: PreparedFrame) -> Pyramid:
        return Pyramid(frame.grey, self._settings.track_window, _LEVELS)

    def _windows_of(self, frame: PreparedFrame) -> Windows:
        chosen = np.arange(self._settings.sought(len(frame.keypoints)))
        return Windows.of(frame, chosen, self._settings.track_window, self._sensor)


def _visible(points: np.ndarray, T_target_source: np.ndarray,
             camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return the K indices of points that a pose puts into the image, and their pixels, Kx2."""
    kept, pixels = np.empty(len(points), np.int64), np.empty((len(points), 2), np.float32)
    count = kernels.visible(points, T_target_source, camera.model, _NEAREST, kept, pixels)
    return kept[:count], pixels[:count]
