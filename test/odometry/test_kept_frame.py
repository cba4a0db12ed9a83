# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames that are kept for long, in memory of their own."""

import copy
import ctypes
import dataclasses
import errno
import gc
import mmap
import pickle
import weakref

import numpy as np
import pytest

from aick_ros.frames.depth_distortion import COLUMNS, ROWS, DepthDistortion
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import Surface
from aick_ros.geometry.camera import Camera
from aick_ros.odometry import kept_frame
from aick_ros.odometry.kept_frame import Mappings, compact, size
from aick_ros.settings import SensorSettings

mapping = kept_frame._mapping

CAMERA = Camera(64, 48, 50.0, 50.0, 31.5, 23.5)
KEYPOINTS = 7


@pytest.fixture(params=[True, False], ids=['surface', 'no surface'])
def prepared(request):
    rng = np.random.default_rng(3)
    depth = rng.uniform(1.0, 1.01, (48, 64)).astype(np.float32)
    colour = rng.integers(0, 256, (48, 64, 3), np.uint8)
    frame = RgbdFrame(5, colour, depth, CAMERA)
    surface = Surface.of(depth, CAMERA, SensorSettings(), 50) if request.param else None
    keypoints = KeypointFrame(5, *(rng.uniform(1, 2, shape).astype(kind) for shape, kind in (
        ((KEYPOINTS, 3), np.float32), ((KEYPOINTS, 32), np.uint8), ((KEYPOINTS, 3, 3), np.float32),
        ((KEYPOINTS, 2), np.float32))))
    distortion = DepthDistortion(np.full((ROWS, COLUMNS), 0.01))
    return PreparedFrame(frame, keypoints, frame.grey, surface, 0.01, 0.002, twist=np.arange(6.0),
                         distortion=distortion)


def arrays_of(prepared):
    """Return all images and lists of a frame, by their names."""
    found = {'grey': prepared.grey, 'depth': prepared.frame.depth}
    for part in (prepared.keypoints, prepared.surface):
        found.update({name: value for name, value in vars(part or prepared).items()
                      if part is not None and isinstance(value, np.ndarray)})
    return found


def memory_of(array):
    """Return what owns the memory that an array lies in."""
    while isinstance(array, np.ndarray):
        array = array.base
    return array.obj if isinstance(array, memoryview) else array


def test_a_kept_frame_is_the_frame_without_colours(prepared):
    kept, before = compact(prepared, Mappings(1)), arrays_of(prepared)
    after = arrays_of(kept)
    assert after.keys() == before.keys() and len(after) == (11 if prepared.surface else 6)
    for name, array in after.items():
        assert array.dtype == before[name].dtype and not array.flags.writeable
        np.testing.assert_array_equal(array, before[name])
    assert kept.frame.colour is kept.grey
    assert (kept.stamp, kept.depth_lag, kept.stamp_jitter) == (5, 0.01, 0.002)
    assert kept.distortion == prepared.distortion and kept.twist is prepared.twist


def test_its_arrays_have_one_mapping_for_themselves_until_the_last_is_gone(prepared):
    """So that the allocator has no holes between them, and what they take is released at once."""
    mappings = Mappings(1)
    kept = compact(prepared, mappings)
    memory, = {id(memory_of(array)): memory_of(array)
               for array in arrays_of(kept).values()}.values()
    needed = sum(array.nbytes for array in arrays_of(kept).values())
    assert needed <= len(memory) <= 1.06 * needed + 64 * len(arrays_of(kept)) + (1 << 16)
    gone = weakref.ref(memory)
    depth = kept.frame.depth
    del memory, kept
    gc.collect()
    assert gone() is not None and depth.min() > 0.9
    assert not np.shares_memory(compact(prepared, mappings).frame.depth, depth)
    del depth
    gc.collect()
    assert gone() is None


def test_the_memory_of_a_frame_that_is_dropped_serves_the_next_one(prepared):
    mappings = Mappings(1)
    addresses = [compact(prepared, mappings).grey.ctypes.data for _ in range(5)]
    assert len(set(addresses)) == 1
    # but not one of another size
    few, many = mappings.take(1 << 10), mappings.take(1 << 20)
    first, second = (ctypes.addressof(memory.obj) for memory in (few, many))
    few = None
    assert ctypes.addressof(mappings.take(1 << 19).obj) != first
    few = mappings.take(1 << 10)
    many = None
    assert ctypes.addressof(mappings.take(1 << 10).obj) != second
    assert len(few) < 1 << 17


def mapping_of(kept):
    """Return the mapping that a frame lies in."""
    return memory_of(kept.grey)._objects['ffffffff'].obj


def test_memory_is_taken_for_all_frames_with_the_first_one(prepared, monkeypatch):
    """The system clears what it gives: later, that would be time of the frames."""
    taken = []
    monkeypatch.setattr(kept_frame, '_mapping', lambda size: taken.append(size) or mapping(size))
    mappings = Mappings(3)
    assert not taken
    frames = [compact(prepared, mappings)]
    assert len(taken) == 3
    frames += [compact(prepared, mappings) for _ in range(2)]
    assert len(taken) == 3 and len({id(mapping_of(frame)) for frame in frames}) == 3
    frames.append(compact(prepared, mappings))  # one more than was expected
    assert len(taken) == 4
    frames.clear()
    gc.collect()
    compact(prepared, mappings)
    assert len(taken) == 4


def test_where_memory_is_short_it_is_taken_when_it_is_needed(prepared, monkeypatch):
    left, mapped = [4], mmap.mmap

    def limited(*arguments, **options):
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOMEM, 'Cannot allocate memory')
        return mapped(*arguments, **options)

    monkeypatch.setattr(mmap, 'mmap', limited)
    mappings = Mappings(9)
    frames = [compact(prepared, mappings) for _ in range(4)]
    with pytest.raises(MemoryError, match='a frame of [0-9]+ bytes'):
        compact(prepared, mappings)
    del frames[0]
    gc.collect()
    compact(prepared, mappings)


def test_a_frame_with_some_more_keypoints_has_room_in_the_memory_of_another():
    mappings = Mappings(2)
    assert len(mappings.take(1 << 20)) >= 1.06 * (1 << 20)
    first = mappings.take(int(1.06 * (1 << 20)))
    assert len(first) < 1.2 * (1 << 20)


def test_as_many_mappings_stay_as_frames_are_kept_and_end_with_their_taker(prepared):
    mappings = Mappings(2)
    frames = [compact(prepared, mappings) for _ in range(3)]
    mapped = [weakref.ref(mapping_of(frame)) for frame in frames]
    frames.clear()
    gc.collect()
    assert sum(memory() is not None for memory in mapped) == 2
    del mappings
    gc.collect()
    assert not any(memory() for memory in mapped)


@pytest.mark.parametrize('copied', [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))],
                         ids=['copy', 'pickle'])
def test_a_copy_has_memory_of_its_own(prepared, copied):
    mappings = Mappings(2)
    kept = compact(prepared, mappings)
    others = [compact(prepared, copied(mappings)) for _ in range(2)]
    assert not any(np.shares_memory(kept.grey, other.grey) for other in others)


def test_mappings_for_frames_of_another_size_end(prepared):
    mappings = Mappings(2)
    kept = compact(prepared, mappings)
    mapped = weakref.ref(mapping_of(kept))
    del kept
    gc.collect()
    assert mapped() is not None
    large = mappings.take(1 << 22)
    assert mapped() is None and len(large) >= 1 << 22


def test_two_frames_share_no_memory(prepared):
    mappings = Mappings(1)
    first, second = compact(prepared, mappings), compact(prepared, mappings)
    assert not np.shares_memory(first.grey, second.grey)
    assert not np.shares_memory(first.grey, prepared.grey)


def test_it_keeps_its_distortion_which_has_no_image(prepared):
    """Each distortion that was known for a while would take as much as a depth image."""
    kept = compact(prepared, Mappings(1)).distortion
    assert kept == prepared.distortion and not kept.is_none
    assert len(pickle.dumps(kept)) < prepared.grey.size * 4 / 4


def test_a_frame_without_keypoints_can_be_kept(prepared):
    kept = compact(dataclasses.replace(prepared, keypoints=KeypointFrame.none(5)),
                   Mappings(1))
    assert len(kept.keypoints) == 0 and kept.keypoints.descriptors.shape == (0, 32)


def test_its_size_is_that_of_its_images_and_surface(prepared):
    kept = compact(prepared, Mappings(1))
    cells = 64 * 48 if prepared.surface else 0  # of one pixel each in so small an image
    images = 64 * 48 * (1 + 4) + cells * (12 + 12 + 1 + 4)
    assert 1.06 * images < size(kept) <= 1.06 * images + 2 ** 16
