# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A frame as it is kept for long: with what registrations need, in memory of its own."""

from __future__ import annotations

import ctypes
import mmap
import weakref
from collections.abc import Sequence

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.surface import Surface

_ALIGNMENT = 64  # bytes, of a cache line
_GRAIN = 1 << 16  # bytes; chosen: frames of one size differ by less, in their keypoints


class Mappings:
    """
    Mappings of memory, one for each frame that is kept.

    That of a frame which is dropped serves the next one. The system clears the memory that it
    gives, which takes longer than to fill it.
    """

    def __init__(self) -> None:
        self._spare: mmap.mmap | None = None

    def take(self, size: int) -> memoryview:
        """Return memory of a size [bytes] or larger; it comes back with the last array in it."""
        memory, self._spare = self._spare, None
        if memory is None or not size <= len(memory) < 2 * (size + _GRAIN):
            flags = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
            flags |= getattr(mmap, 'MAP_POPULATE', 0)  # of Linux: all is written, so all at once
            memory = mmap.mmap(-1, (size // _GRAIN + 1) * _GRAIN, flags=flags)
        owner = (ctypes.c_char * len(memory)).from_buffer(memory)  # lives as long as its views
        weakref.finalize(owner, self._give_back, memory).atexit = False
        return memoryview(owner)

    def _give_back(self, memory: mmap.mmap) -> None:
        self._spare = memory


def compact(prepared: PreparedFrame, mappings: Mappings) -> PreparedFrame:
    """
    Return a frame with the images that registrations need alone: grey, and depth corrected.

    They are copied to a mapping of their own, which is released as a whole: among the images of
    other frames, which come and go, they would keep the heap from shrinking.
    """
    surface, keypoints = prepared.surface, prepared.keypoints
    of_surface = [] if surface is None else [
        surface.points, surface.normals, surface.usable, surface.chosen, surface.roughness]
    own = _moved([prepared.grey, prepared.corrected.depth, keypoints.positions,
                  keypoints.descriptors, keypoints.covariances, keypoints.pixels, *of_surface],
                 mappings)
    grey, depth, positions, descriptors, covariances, pixels = own[:6]
    return replaced(
        prepared, grey=grey, undistorted=None,
        frame=replaced(prepared.corrected, colour=grey, depth=depth),
        keypoints=replaced(
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


def _moved(arrays: Sequence[np.ndarray], mappings: Mappings) -> list[np.ndarray]:
    """Return copies of arrays that nobody can change, in a mapping."""
    sizes = [-(-array.nbytes // _ALIGNMENT) * _ALIGNMENT for array in arrays]
    memory = mappings.take(sum(sizes))
    moved, begin = [], 0
    for array, taken in zip(arrays, sizes):
        copy = np.frombuffer(memory, array.dtype, array.size, begin).reshape(array.shape)
        copy[...] = array
        copy.flags.writeable = False
        moved.append(copy)
        begin += taken
    return moved
