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
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.surface import Surface

_ALIGNMENT = 64  # bytes, of a cache line
_GRAIN = 1 << 16  # bytes; chosen: sizes of mappings are multiples of it
_ROOM = 1.06  # chosen: frames of one resolution differ by less, in their keypoints


class Mappings:
    """
    Mappings of memory, one for each frame that is kept.

    The system clears the memory that it gives, which takes longer than to fill it. So it is taken
    for all frames with the first one, and that of a frame which is dropped serves the next one.

    :param count: of frames that are kept at once; there can be more, whose mappings are added.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._spares: list[mmap.mmap] = []
        self._has_begun = False

    def __reduce__(self) -> tuple[type[Mappings], tuple[int]]:
        """Return how to make a copy: it has memory of its own, once it needs some."""
        return Mappings, (self._count,)

    def take(self, size: int) -> memoryview:
        """Return memory of a size [bytes] or larger; it comes back with the last array in it."""
        self._spares = [memory for memory in self._spares
                        if size <= len(memory) < 2 * (size + _GRAIN)]
        if not self._spares:
            self._spares = _mappings(size, 1 if self._has_begun else self._count)
            self._has_begun = True
        memory = self._spares.pop()
        owner = (ctypes.c_char * len(memory)).from_buffer(memory)  # lives as long as its views
        weakref.finalize(owner, self._give_back, memory).atexit = False
        return memoryview(owner)

    def _give_back(self, memory: mmap.mmap) -> None:
        if len(self._spares) < self._count:
            self._spares.append(memory)


def _mappings(size: int, count: int) -> list[mmap.mmap]:
    """
    Return memory for frames: for fewer, but at least one, where there is no more.

    :raises MemoryError: where there is none for one frame.
    """
    found = [_mapping(size)]
    with contextlib.suppress(MemoryError):
        while len(found) < count:
            found.append(_mapping(size))
    return found


def _mapping(size: int) -> mmap.mmap:
    """Return memory for a frame of a size [bytes], or one with some more keypoints."""
    flags = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
    flags |= getattr(mmap, 'MAP_POPULATE', 0)  # of Linux: all is written, so all at once
    try:
        return mmap.mmap(-1, _mapped(size), flags=flags)
    except OSError as error:  # which is none of a file
        raise MemoryError(f'there is none for a frame of {size} bytes') from error


def _mapped(size: int) -> int:
    return (int(_ROOM * size) // _GRAIN + 1) * _GRAIN


def compact(prepared: PreparedFrame, mappings: Mappings) -> PreparedFrame:
    """
    Return a frame with the images that registrations need alone: grey, and depth corrected.

    They are copied to a mapping of their own, which is released as a whole: among the images of
    other frames, which come and go, they would keep the heap from shrinking.
    """
    prepared = prepared.bare()
    surface, keypoints = prepared.surface, prepared.keypoints
    of_surface = [] if surface is None else [
        surface.points, surface.normals, surface.usable, surface.chosen, surface.roughness]
    own = _moved([prepared.grey, prepared.frame.depth, keypoints.positions,
                  keypoints.descriptors, keypoints.covariances, keypoints.pixels, *of_surface],
                 mappings)
    grey, depth, positions, descriptors, covariances, pixels = own[:6]
    return replaced(
        prepared, grey=grey, frame=replaced(prepared.frame, colour=grey, depth=depth),
        keypoints=replaced(
            keypoints, positions=positions, descriptors=descriptors, covariances=covariances,
            pixels=pixels),
        surface=None if surface is None else Surface(surface.grid, *own[6:]))


def size(prepared: PreparedFrame) -> int:
    """Return how many bytes a frame takes as it is kept, whatever keypoints it has."""
    count = prepared.grey.nbytes + prepared.frame.depth.nbytes
    if prepared.surface is not None:
        surface = prepared.surface
        count += sum(array.nbytes for array in (
            surface.points, surface.normals, surface.usable, surface.roughness))
    return _mapped(count)


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
