# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Which of two poses the images show, part by part of the view.

Keypoints have no say: an object may have most of them. What counts is the area of what is seen,
its depth and its brightness, so that a plain wall weighs as much as a poster before it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from aick_ros.frames.depth import inverse_depth_sigma
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.surface import Surface
from aick_ros.geometry import se3
from aick_ros.settings import SensorSettings

_EVERY = 2  # of the cells has a vote
_DEPTH = 5.6  # standard deviations of one pixel's depth that count as a whole misfit
_GREY = 3.0  # grey levels on a plain surface that do
_OFF_BY = 2.0  # px; and by so much a brightness may be misplaced
_ROW = 1024  # points that are sampled in one row
_SMOOTHED = 5  # px
_LEAD = 0.5  # of the sum of the two misfits, by which a cell tells one pose from the other
_PART = 6  # cells across a part of the view
_FILLED = 0.3  # of its cells must be seen for a part to be counted
_MAJORITY, _TURNOUT = 2.0, 0.1  # one pose leads in a part by so much, with so many of its cells


@dataclass(frozen=True)
class PoseVote:
    """
    How much of a view is for each of two poses.

    :param first: share of the parts of the view that clearly fit the first pose better.
    :param second: the same of the second.
    :param seen: share of the surfaces that can be judged, as both poses put them into view.
    """

    first: float
    second: float
    seen: float

    @property
    def for_second(self) -> float:
        """Share of the second pose in the parts that tell the two apart, 0 where none does."""
        return self.second / max(self.first + self.second, 1e-9)


def pose_vote(source: PreparedFrame, target: PreparedFrame, first: np.ndarray, second: np.ndarray,
         sensor: SensorSettings) -> PoseVote:
    """
    Let the parts of a view vote on where it was seen from.

    A misfit counts up to a bound, so that what moves by itself does not outweigh what stands.

    :param first: ``T_target_source``, 4x4; second: another one. Both views have a surface.
    """
    cells = np.flatnonzero(source.surface.usable)[::_EVERY]
    greys = _smooth(source), _smooth(target)
    images = *greys, _tolerance(greys[0])
    misfits = [_misfit(source, target, images, pose, cells, sensor) for pose in (first, second)]
    seen = np.isfinite(misfits[0]) & np.isfinite(misfits[1])
    lead = misfits[1][seen] - misfits[0][seen]
    row, column = np.divmod(cells[seen], source.surface.grid.width)
    part = (row // _PART) * source.surface.grid.width + column // _PART
    for_first, for_second = (np.bincount(part, led) for led in (lead > _LEAD, lead < -_LEAD))
    count = np.bincount(part)
    counted = count >= _FILLED * _PART ** 2 / _EVERY
    parts = max(np.count_nonzero(counted), 1)
    shares = [np.count_nonzero(counted & (a > _MAJORITY * b) & (a > _TURNOUT * count)) / parts
              for a, b in ((for_first, for_second), (for_second, for_first))]
    return PoseVote(*shares, np.count_nonzero(seen) / max(len(cells), 1))


def _smooth(view: PreparedFrame) -> np.ndarray:
    return cv2.blur(view.grey, (_SMOOTHED, _SMOOTHED)).astype(np.float32)


def _misfit(source: PreparedFrame, target: PreparedFrame, images: tuple[np.ndarray, np.ndarray, np.ndarray],
            pose: np.ndarray, cells: np.ndarray, sensor: SensorSettings) -> np.ndarray:
    """
    Return 0 to 1 for the depth plus 0 to 1 for the brightness; NaN where it is not seen.

    :param images: brightness of the source and of the target, and what that of the source may be
        off by.
    """
    before, now, tolerance = images
    points = source.surface.points[cells].astype(np.float64)
    moved = se3.transform(pose, points)
    seen, partners = target.surface.cells_at(moved)
    misfit = np.full(len(cells), np.nan)
    misfit[seen] = (_depth_misfit(moved[seen], target.surface, partners, sensor)
                    + _grey_misfit(_sample(before, source, points[seen]),
                                   _sample(now, target, moved[seen]),
                                   _sample(tolerance, source, points[seen])))
    return misfit


def _depth_misfit(moved: np.ndarray, target: Surface, partners: np.ndarray,
                  sensor: SensorSettings) -> np.ndarray:
    normals = target.normals[partners]
    z = moved[:, 2]
    slant = np.einsum('ij,ij->i', moved, normals)
    distances = np.einsum('ij,ij->i', moved - target.points[partners], normals)
    sigmas = inverse_depth_sigma(z, sensor) * z * slant
    return np.minimum((distances / (_DEPTH * sigmas)) ** 2, 1.0)


def _grey_misfit(before: np.ndarray, now: np.ndarray, tolerance: np.ndarray) -> np.ndarray:
    if not len(now):
        return now
    gain = np.median(now / np.maximum(before, 1.0))  # the exposure may have changed
    return np.minimum(((now - gain * before) / tolerance) ** 2, 1.0)


def _tolerance(grey: np.ndarray) -> np.ndarray:
    """Return what the brightness may be off by: more where it changes from pixel to pixel."""
    slopes = sum(np.abs(cv2.Scharr(grey, -1, *axis)) for axis in ((1, 0), (0, 1))) / 32
    around = np.ones((2 * _SMOOTHED - 1, 2 * _SMOOTHED - 1), np.uint8)
    return _GREY + _OFF_BY * cv2.dilate(slopes, around)


def _sample(image: np.ndarray, view: PreparedFrame, points: np.ndarray) -> np.ndarray:
    """Return the values of an image at points of its optical frame, N."""
    if not len(points):
        return np.empty(0, np.float32)
    # in rows, as remap takes no more than 32767 of them
    pixels = np.zeros((-(-len(points) // _ROW) * _ROW, 2), np.float32)
    pixels[:len(points)] = view.frame.camera.project(points)
    return cv2.remap(image, pixels.reshape(-1, _ROW, 2), None, cv2.INTER_LINEAR,
                     borderMode=cv2.BORDER_REPLICATE).ravel()[:len(points)]
