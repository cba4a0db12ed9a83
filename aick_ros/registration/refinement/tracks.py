# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keypoints of one view found again in another, to a fraction of a pixel."""

from __future__ import annotations

from dataclasses import dataclass, fields

import cv2
import numpy as np

from aick_ros.frames import depth
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.settings import RefinementSettings, SensorSettings

_LEVELS = 2  # of the pyramid above the image: reaches 4 * window / 2 pixels
_CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.03)
_RETURNED_WITHIN = 0.5  # px; tracked back, a keypoint must come to where it was
_NEAREST = 0.05  # m; what the first pose puts nearer is not looked for
_TURNED = np.radians(3.0)  # a window that has turned farther is not like itself any more


@dataclass(frozen=True, eq=False)
class Tracks:
    """
    Keypoints of the source seen in the target.

    :param keypoints: K indices of keypoints of the source.
    :param points: Kx3 float64, their positions in the source [m].
    :param rays: Kx2 float64, where the target sees them on the plane z = 1.
    :param depths: K float64, what the target measures there [m]; NaN where it has no depth.
    :param sigmas: K float64, standard deviation of the inverse of the points' depths [1/m].
    """

    keypoints: np.ndarray
    points: np.ndarray
    rays: np.ndarray
    depths: np.ndarray
    sigmas: np.ndarray

    def __len__(self) -> int:
        """Return the number of tracks."""
        return len(self.keypoints)

    def __getitem__(self, chosen: np.ndarray) -> Tracks:
        """Return some of the tracks, by their indices or by a mask."""
        return Tracks(*(getattr(self, f.name)[chosen] for f in fields(self)))


class Tracker:
    """
    Follows the image around keypoints from where a first pose puts them.

    A detector places a keypoint to about a pixel of its pyramid level, in each image for itself.
    Aligning the two images around it (Lucas and Kanade 1981, pyramids after Bouguet 2001) places
    one against the other to a tenth of that, and finds keypoints the target did not detect.
    """

    def __init__(self, settings: RefinementSettings, sensor: SensorSettings) -> None:
        self._settings = settings
        self._sensor = sensor

    def track(self, source: PreparedFrame, target: PreparedFrame, T_target_source: np.ndarray) -> Tracks:
        """
        Find the keypoints of the source in the target.

        :param T_target_source: about where the source was; the tracks reach some ten pixels.
        """
        camera = target.frame.camera
        points = source.keypoints.positions[:self._settings.max_tracks].astype(np.float64)
        moved = se3.transform(T_target_source, points)
        ahead = np.flatnonzero(moved[:, 2] > _NEAREST)
        expected = camera.project(moved[ahead])
        corner = camera.width - 1, camera.height - 1
        inside = ((expected >= 0) & (expected <= corner)).all(axis=1)
        kept, expected = ahead[inside], expected[inside].astype(np.float32)
        if len(kept) == 0:
            return Tracks(kept, points[kept], np.empty((0, 2)), np.empty(0), np.empty(0))
        grey, pixels = _turned(source.grey, source.keypoints.pixels[kept], camera,
                               T_target_source[:3, :3])
        seen, found = self._follow(grey, target.grey, pixels, expected, _LEVELS)
        again, returned = self._follow(target.grey, grey, seen, pixels, 0)
        found &= returned & (np.abs(again - pixels).max(axis=1) < _RETURNED_WITHIN)
        kept, seen = kept[found], seen[found]
        rays = camera.normalize(seen)
        valid = np.isfinite(rays).all(axis=1)
        kept, seen, rays = kept[valid], seen[valid], rays[valid]
        variances = source.keypoints.covariances[kept, 2, 2].astype(np.float64)
        return Tracks(kept, points[kept], rays,
                      depth.sample(target.frame.depth, seen, self._sensor),
                      np.sqrt(variances) / points[kept, 2] ** 2)

    def _follow(self, before: np.ndarray, now: np.ndarray, pixels: np.ndarray,
                expected: np.ndarray, levels: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the new pixels, Nx2, and which were found, N bool."""
        side = self._settings.track_window
        seen, status, _ = cv2.calcOpticalFlowPyrLK(
            before, now, pixels.reshape(-1, 1, 2), expected.reshape(-1, 1, 2).copy(),
            winSize=(side, side), maxLevel=levels, criteria=_CRITERIA,
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW)
        return seen.reshape(-1, 2), status.ravel() > 0


def _turned(grey: np.ndarray, pixels: np.ndarray, camera: Camera,
            R_target_source: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """
    Return an image about as the target's camera would see it, and where its pixels are there.

    What is far away moves by the homography of the rotation alone (Hartley and Zisserman 2004,
    8.4), and around what is nearer the image is still turned as it will be seen. The distortion
    is left out: image and pixels are turned alike, so nothing is displaced by that.
    """
    if se3.angle(R_target_source) < _TURNED:
        return grey, pixels
    matrix = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    homography = matrix @ R_target_source @ np.linalg.inv(matrix)
    return (cv2.warpPerspective(grey, homography, grey.shape[::-1]),
            cv2.perspectiveTransform(pixels[:, None], homography)[:, 0])
