# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Vote of the images on two poses, block by block of the view.

Keypoints have no vote, as an object may have most of them. Depth and brightness are compared over
the area of the visible surfaces, so a plain wall counts as much as a poster in front of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from aick_ros.frames.depth import inverse_depth_sigma
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.surface import Surface, cell_of
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.median import median
from aick_ros.registration.refinement.residuals import SURFACE_NOISE
from aick_ros.settings import SensorSettings

_DEPTH_MISFIT = 4.0 * SURFACE_NOISE  # sigmas of one pixel's depth; derived: 4 of a surface
_ROW = 1024  # points sampled in one row, fewer than the 32767 that cv2.remap takes

# All below chosen on rendered rooms with boards that move through 10 to 60 % of the view.
_STRIDE = 2  # every second cell votes
_GREY_MISFIT = 3.0  # grey levels on a plain surface
_DISPLACEMENT = 2.0  # px by which a brightness may be displaced without a misfit
_SMOOTHING = 5  # px; side of the box filter of the images
_LEAD = 0.5  # difference of the misfits, 0 to 2, with which a cell votes for a pose
_BLOCK = 24  # px across a block of the view
_FILLED = 0.3  # share of its cells that must be seen for a block to count
_MAJORITY, _TURNOUT = 2.0, 0.1
"""Chosen: a block is for a pose with so many times the other's votes, by that share of cells."""


@dataclass(frozen=True)
class PoseVote:
    """
    Shares of a view that support each of two poses.

    :param first: share of the blocks of the view that clearly fit the first pose better.
    :param second: share of the blocks of the view that clearly fit the second pose better.
    :param seen: share of the surfaces that both poses put into view of the other frame.
    """

    first: float
    second: float
    seen: float

    @property
    def for_second(self) -> float:
        """Share of the second pose among the blocks that vote, 0 where none does."""
        return self.second / max(self.first + self.second, 1e-9)


def pose_vote(source: PreparedFrame, target: PreparedFrame, first: np.ndarray,
              second: np.ndarray, sensor: SensorSettings) -> PoseVote:
    """
    Let the blocks of the source's view vote on two poses.

    The misfit of a cell is bounded, so that objects that move do not outweigh the scene.

    :param first: ``T_target_source``, 4x4.
    :param second: another ``T_target_source``, 4x4.
    :raises ValueError: if a frame has no surface.
    """
    view, other = _Cells.of(source), _View.of(target)
    cells = view.indices
    misfits = [_misfits(view, other, pose, sensor) for pose in (first, second)]
    seen = np.isfinite(misfits[0]) & np.isfinite(misfits[1])
    lead = misfits[1][seen] - misfits[0][seen]
    width, side = _surface_of(source).grid.width, _BLOCK // cell_of(source.frame.camera)
    row, column = np.divmod(cells[seen], width)
    block = (row // side) * width + column // side
    count = np.bincount(block)
    counted = count >= _FILLED * side ** 2 / _STRIDE
    for_first, for_second = (np.bincount(block, votes) for votes in (lead > _LEAD, lead < -_LEAD))

    def share(votes: np.ndarray, others: np.ndarray) -> float:
        won = counted & (votes > _MAJORITY * others) & (votes > _TURNOUT * count)
        return float(np.count_nonzero(won) / max(int(np.count_nonzero(counted)), 1))

    return PoseVote(share(for_first, for_second), share(for_second, for_first),
                    float(np.count_nonzero(seen) / max(len(cells), 1)))


@dataclass(frozen=True, eq=False)
class _View:
    """
    The part of a frame that is voted on.

    :param grey: HxW float32, smoothed.
    """

    grey: np.ndarray
    surface: Surface
    camera: Camera

    @classmethod
    def of(cls, frame: PreparedFrame) -> _View:
        return cls(_smoothed(frame).astype(np.float32), _surface_of(frame), frame.frame.camera)

    def brightness(self, points: np.ndarray) -> np.ndarray:
        """Return the brightness at points of its optical frame, N."""
        return _sample(self.grey, self.camera, points)


@dataclass(frozen=True, eq=False)
class _Cells:
    """
    The cells of a frame that vote.

    :param indices: K, of the cells of its surface.
    :param points: Kx3 [m].
    :param brightness: K, smoothed.
    :param tolerance: K, difference of brightness that is a whole misfit.
    """

    indices: np.ndarray
    points: np.ndarray
    brightness: np.ndarray
    tolerance: np.ndarray

    @classmethod
    def of(cls, frame: PreparedFrame) -> _Cells:
        grey, surface, camera = _smoothed(frame), _surface_of(frame), frame.frame.camera
        indices = np.flatnonzero(surface.usable)[::_STRIDE]
        points = surface.points[indices].astype(np.float64)
        return cls(indices, points, _sample(grey.astype(np.float32), camera, points),
                   _sample(_grey_tolerance(grey), camera, points))


def _smoothed(frame: PreparedFrame) -> np.ndarray:
    """Return the smoothed image of a frame, HxW uint8."""
    return np.asarray(cv2.blur(frame.grey, (_SMOOTHING, _SMOOTHING)))


def _surface_of(frame: PreparedFrame) -> Surface:
    if frame.surface is None:
        raise ValueError('a vote on poses requires the surfaces of both frames')
    return frame.surface


def _sample(image: np.ndarray, camera: Camera, points: np.ndarray) -> np.ndarray:
    """Return the values of an image at points of its optical frame, N."""
    if not len(points):
        return np.empty(0, np.float32)
    pixels = np.zeros((-(-len(points) // _ROW) * _ROW, 2), np.float32)
    pixels[:len(points)] = camera.project(points)
    u, v = (pixels[:, axis].reshape(-1, _ROW) for axis in (0, 1))
    return np.asarray(cv2.remap(image, u, v, cv2.INTER_LINEAR,
                                borderMode=cv2.BORDER_REPLICATE)).ravel()[:len(points)]


def _misfits(source: _Cells, target: _View, pose: np.ndarray,
             sensor: SensorSettings) -> np.ndarray:
    """
    Return the misfit of each cell: of depth, 0 to 1, plus of brightness, 0 to 1; NaN if unseen.

    :param pose: ``T_target_source``, 4x4.
    """
    moved = se3.transform(pose, source.points)
    seen, partners = target.surface.cells_at(moved)
    misfits = np.full(len(moved), np.nan)
    misfits[seen] = (_depth_misfits(moved[seen], target.surface, partners, sensor)
                     + _grey_misfits(source.brightness[seen], target.brightness(moved[seen]),
                                     source.tolerance[seen]))
    return misfits


def _depth_misfits(moved: np.ndarray, target: Surface, partners: np.ndarray,
                   sensor: SensorSettings) -> np.ndarray:
    """Return the squared distances of points from the planes of the target, bounded by 1, N."""
    normals = target.normals[partners]
    z = moved[:, 2]
    slant = np.einsum('ij,ij->i', moved, normals)
    distances = np.einsum('ij,ij->i', moved - target.points[partners], normals)
    sigmas = inverse_depth_sigma(z, sensor) * z * slant
    misfits: np.ndarray = np.minimum((distances / (_DEPTH_MISFIT * sigmas)) ** 2, 1.0)
    return misfits


def _grey_misfits(before: np.ndarray, now: np.ndarray, tolerance: np.ndarray) -> np.ndarray:
    """Return the squared differences of brightness, bounded by 1, N."""
    if not len(now):
        return now
    gain = median(now / np.maximum(before, 1.0))  # the exposure may have changed
    misfits: np.ndarray = np.minimum(((now - gain * before) / tolerance) ** 2, 1.0)
    return misfits


def _grey_tolerance(grey: np.ndarray) -> np.ndarray:
    """
    Return the difference of brightness that is a whole misfit, larger near edges, HxW float32.

    :param grey: HxW uint8, smoothed.
    """
    slopes = np.abs(cv2.Scharr(grey, cv2.CV_16S, 1, 0))  # times 32
    slopes += np.abs(cv2.Scharr(grey, cv2.CV_16S, 0, 1))
    around = np.ones((2 * _SMOOTHING - 1, 2 * _SMOOTHING - 1), np.uint8)
    tolerance = cv2.dilate(slopes, around).astype(np.float32)
    tolerance *= np.float32(_DISPLACEMENT / 32)
    tolerance += np.float32(_GREY_MISFIT)
    return tolerance
