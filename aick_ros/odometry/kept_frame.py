# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A frame as it is kept for long: with what registrations need, in memory of its own."""

from __future__ import annotations

import dataclasses
import mmap
from collections.abc import Sequence

import numpy as np

from aick_ros.frames.depth_distortion import DepthDistortion
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.surface import Surface

_ALIGNMENT = 64  # bytes, of a cache line


def compact(prepared: PreparedFrame) -> PreparedFrame:
    """
    Return a frame with the images that registrations need alone: grey, and depth corrected.

    They are copied to a mapping of their own, which is given back as a whole: among the images of
    other frames, which come and go, they would keep the heap from shrinking. The distortion is a
    copy without the image of it that was made for the frame.
    """
    surface, keypoints = prepared.surface, prepared.keypoints
    of_surface = [] if surface is None else [
        surface.points, surface.normals, surface.usable, surface.chosen, surface.roughness]
    own = _moved([prepared.grey, prepared.corrected.depth, keypoints.positions,
                  keypoints.descriptors, keypoints.covariances, keypoints.pixels, *of_surface])
    grey, depth, positions, descriptors, covariances, pixels = own[:6]
    return dataclasses.replace(
        prepared, grey=grey, undistorted=None,
        frame=dataclasses.replace(prepared.corrected, colour=grey, depth=depth),
        distortion=DepthDistortion(prepared.distortion.nodes),
        keypoints=dataclasses.replace(
            keypoints, positions=positions, descriptors=descriptors, covariances=covariances,
            pixels=pixels),
        surface=None if surface is None else Surface(surface.grid, *own[6:]))


def size(prepared: PreparedFrame) -> int:
    """Return how many bytes a frame takes, all but its keypoints."""
    count = prepared.grey.nbytes + prepared.frame.depth.nbytes
    if prepared.surface is not None:
        surface = prepared.surface
        count += sum(array.nbytes for array in (
            surface.points, surface.normals, surface.usable, surface.roughness))
    return count


def _moved(arrays: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return copies of arrays that nobody can change, in a mapping that ends with the last."""
    sizes = [-(-array.nbytes // _ALIGNMENT) * _ALIGNMENT for array in arrays]
    flags = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
    flags |= getattr(mmap, 'MAP_POPULATE', 0)  # of Linux: all pages are written, so all at once
    memory = mmap.mmap(-1, max(sum(sizes), 1), flags=flags)
    moved, begin = [], 0
    for array, taken in zip(arrays, sizes):
        copy = np.frombuffer(memory, array.dtype, array.size, begin).reshape(array.shape)
        copy[...] = array
        copy.flags.writeable = False
        moved.append(copy)
        begin += taken
    return moved
