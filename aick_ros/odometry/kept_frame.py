# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A frame as it is kept for long: with what registrations need, in memory of its own."""

from __future__ import annotations

import contextlib
import ctypes
import mmap
import weakref
from collections.abc import Sequence

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.frames.depth_distortion import DepthDistortion
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.surface import Surface

_ALIGNMENT = 64  # bytes, of a cache line
_GRAIN = 1 << 16  # bytes; chosen: frames of one size differ by less, in their keypoints
_HUGE_PAGE = 1 << 21  # bytes; by definition of x86-64, and of ARM with pages of 4 KiB


class Mappings:
    """
    Mappings of memory, one for each frame that is kept.

    That of a frame which is dropped serves the next one. The system clears the memory that it
    gives, and finds it page by page, which takes longer than to fill it: where it has huge pages,
    a mapping consists of them as far as it fills them.
    """

    def __init__(self) -> None:
        self._spare: memoryview | None = None

    def take(self, size: int) -> memoryview:
        """Return memory of a size [bytes] or larger; it comes back with the last array in it."""
        memory, self._spare = self._spare, None
        if memory is None or not size <= len(memory) < 2 * (size + _GRAIN):
            memory = _mapped((size // _GRAIN + 1) * _GRAIN)
        owner = (ctypes.c_char * len(memory)).from_buffer(memory)  # lives as long as its views
        weakref.finalize(owner, self._give_back, memory).atexit = False
        return memoryview(owner)

    def _give_back(self, memory: memoryview) -> None:
        self._spare = memory


def _mapped(size: int) -> memoryview:
    """Return memory of a size [bytes] in a mapping of its own."""
    mapping = mmap.mmap(-1, size + _HUGE_PAGE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    start = -ctypes.addressof(ctypes.c_char.from_buffer(mapping)) % _HUGE_PAGE
    if hasattr(mmap, 'MADV_HUGEPAGE'):
        with contextlib.suppress(OSError):  # of a system without them
            mapping.madvise(mmap.MADV_NOHUGEPAGE)  # not even one that is used in part
            mapping.madvise(mmap.MADV_HUGEPAGE, start, size // _HUGE_PAGE * _HUGE_PAGE)
    return memoryview(mapping)[start:start + size]


def compact(prepared: PreparedFrame, mappings: Mappings) -> PreparedFrame:
    """
    Return a frame with the images that registrations need alone: grey, and depth corrected.

    They are copied to a mapping of their own, which is released as a whole: among the images of
    other frames, which come and go, they would keep the heap from shrinking. The distortion is a
    copy without the image of it that was made for the frame.
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
        distortion=DepthDistortion(prepared.distortion.nodes),
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
