# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Distortion of depth images: an error of the inverse depth that differs over the image.

What a depth camera with triangulation measures is a disparity. An error of it that stays where it
is in the image, as the optics and the pattern of structured light cause it, is one of the inverse
depth, the same at all distances (Teichman, Miller and Thrun 2013 measured such maps).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

import numpy as np

from aick_ros import kernels
from aick_ros.geometry.camera import Camera

ROWS, COLUMNS = 5, 6
"""Nodes of the grid; chosen on two excerpts of real recordings: more have more noise."""

_SAME_PLACE = 0.1  # of the distance between nodes; chosen: more than focusing moves them
_SMALLEST_SCALE = 1e-3  # chosen: depths that would be enlarged by more are beyond all ranges


@dataclass(frozen=True, eq=False)
class DepthDistortion:
    """
    What is missing in the inverse depth, linear between nodes that cover the image.

    It equals another one with the same nodes: copies and pickles of it are the same distortion.

    :param nodes: ROWSxCOLUMNS, at the nodes: the first and last ones lie on the borders of the
        image [1/m].
    """

    nodes: np.ndarray = field(default_factory=lambda: np.zeros((ROWS, COLUMNS)))

    def __eq__(self, other: object) -> bool:
        """Return whether another one has the same nodes."""
        return self is other or (isinstance(other, DepthDistortion)
                                 and np.array_equal(self.nodes, other.nodes))

    def __hash__(self) -> int:
        """Return a number that equal ones have in common."""
        return hash(tuple(self.nodes.ravel().tolist()))

    @functools.cached_property
    def is_none(self) -> bool:
        """Absence of a distortion."""
        return not self.nodes.any()

    @property
    def rms(self) -> float:
        """Root mean square over the nodes [1/m]."""
        return float(np.sqrt(np.mean(np.square(self.nodes))))

    @property
    def description(self) -> str:
        """The distortion in words, with its size; '' where there is none."""
        if self.is_none:
            return ''
        return ('depth images are distorted: over the image their error differs by '
                f'{1e3 * self.rms:.1f} mm (root mean square) at 1 m, and grows with the square '
                'of the depth')

    def undistorted(self, depth: np.ndarray) -> np.ndarray:
        """Return a depth image without the distortion, HxW float32 [m]; that one if it is none."""
        if self.is_none:
            return depth
        undistorted = np.empty(depth.shape, np.float32)
        kernels.undistort_depth(depth, self.nodes, _SMALLEST_SCALE, undistorted)
        undistorted.flags.writeable = False
        return undistorted

    def at(self, points: np.ndarray, camera: Camera) -> np.ndarray:
        """Return the distortion where points project to, N [1/m]."""
        nodes, weights = nodes_around(points, camera)
        values: np.ndarray = np.einsum('ij,ij->i', self.nodes.ravel()[nodes], weights)
        return values

    def moved(self, points: np.ndarray, camera: Camera) -> np.ndarray:
        """Return points of the depth image where they are without it, Nx3 of the same type [m]."""
        scale = 1.0 + points[:, 2].astype(np.float64) * self.at(points, camera)
        scale = np.maximum(scale, _SMALLEST_SCALE)
        return np.asarray(points / scale[:, None], points.dtype)


NO_DISTORTION = DepthDistortion()


def have_same_nodes(camera: Camera, other: Camera) -> bool:
    """
    Return whether the nodes of two cameras lie on the same rays, to a fraction of their distance.

    They do after a change of the resolution alone; not after one of the field of view, as by
    another crop, or of the lens distortion, as by a rectification.
    """
    if camera == other:
        return True
    rows, columns = np.indices((ROWS, COLUMNS)).reshape(2, -1)
    places = np.column_stack([columns, rows])
    rays = camera.normalize(places * _node_distances(camera))
    seen = other.project(np.column_stack([rays, np.ones(len(rays))])) / _node_distances(other)
    return bool((np.abs(seen - places) < _SAME_PLACE).all())


def _node_distances(camera: Camera) -> np.ndarray:
    """Return the distances between nodes in the image, 2 [px]."""
    width, height = max(camera.width - 1, 1), max(camera.height - 1, 1)
    return np.array([width / (COLUMNS - 1), height / (ROWS - 1)])


def nodes_around(points: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """
    Return the nodes around where points project to, and their weights, Nx4 each.

    The weights are those of a bilinear interpolation.

    :param points: Nx3 in the optical frame, in front of the camera [m]; outside of the image the
        nearest pixel counts.
    """
    nodes, weights = np.empty((len(points), 4), np.int64), np.empty((len(points), 4))
    kernels.nodes_around(points, camera.model, ROWS, COLUMNS, nodes, weights)
    return nodes, weights
