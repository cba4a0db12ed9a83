# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Packed data of any size unpacks to a limited number of bytes."""

import bz2
import io
import random
import tracemalloc

import lz4.frame
import pytest
from rosbags.rosbag1 import reader as ros1
from rosbags.rosbag2 import reader as ros2
from rosbags.rosbag2 import storage_mcap

from aick_ros.borders import unpacking
from aick_ros.borders.limits import MAX_PACKED_FRAMES
from aick_ros.borders.unpacking import limit_unpacking, unpack
from aick_ros.errors import InputError

try:
    from compression import zstd
except ModuleNotFoundError:  # before Python 3.14
    from backports import zstd

FORMATS = {'bz2': (bz2.BZ2Decompressor, bz2.compress),
           'lz4': (lz4.frame.LZ4FrameDecompressor, lz4.frame.compress),
           'zstd': (zstd.ZstdDecompressor, zstd.compress)}
LIMIT = 1_000_000


@pytest.mark.parametrize('make, pack', FORMATS.values(), ids=FORMATS)
class TestUnpack:

    @pytest.mark.parametrize('content', [b'', b'a', bytes(LIMIT), bytes(range(256)) * 100])
    def test_returns_what_was_packed(self, make, pack, content):
        assert unpack(make, pack(content), LIMIT) == content
        assert unpack(make, pack(content[:9]) + pack(content[9:]), LIMIT) == content

    @pytest.mark.parametrize('sizes', [(LIMIT + 1,), (100 * LIMIT,), (LIMIT, 1), (600_000,) * 3])
    def test_what_is_too_large_is_rejected_before_it_takes_memory(self, make, pack, sizes):
        packed = b''.join(pack(bytes(size)) for size in sizes)
        tracemalloc.start()
        try:
            with pytest.raises(InputError, match='unpacks to more than 1000000 bytes'):
                unpack(make, packed, LIMIT)
            assert tracemalloc.get_traced_memory()[1] < 10 * LIMIT
        finally:
            tracemalloc.stop()

    def test_what_breaks_off_is_rejected(self, make, pack):
        packed = pack(bytes(range(256)) * 100)
        for cut in (len(packed) // 2, len(packed) - 1):
            with pytest.raises(InputError, match='^its packed data breaks off$'):
                unpack(make, packed[:cut], LIMIT)

    def test_frames_are_limited(self, make, pack):
        """All the data that is left is copied after each."""
        assert unpack(make, pack(b'a') * MAX_PACKED_FRAMES) == b'a' * MAX_PACKED_FRAMES
        with pytest.raises(InputError, match=f'^its packed data has more than {MAX_PACKED_FRAMES} '
                                             'frames$'):
            unpack(make, pack(b'') * (MAX_PACKED_FRAMES + 1))


@pytest.fixture
def small_limit(monkeypatch):
    limit_unpacking()
    monkeypatch.setattr(unpack, '__defaults__', (LIMIT,))
    monkeypatch.setattr(unpacking, 'MAX_MESSAGE_BYTES', LIMIT)


@pytest.mark.parametrize('size', [LIMIT, LIMIT + 1])
@pytest.mark.parametrize('use', [
    lambda data: ros1.decompressors['bz2'](bz2.compress(data)),
    lambda data: ros1.decompressors['lz4'](lz4.frame.compress(data)),
    lambda data: storage_mcap.DECOMPRESSORS['lz4'](lz4.frame.compress(data), 1),
    lambda data: storage_mcap.DECOMPRESSORS['zstd'](zstd.compress(data), 1),
    lambda data: ros2.zstd.decompress(zstd.compress(data)),
    lambda data: ros2.zstd.open(io.BytesIO(zstd.compress(data)), 'rb').read()])
def test_rosbags_unpacks_no_more_than_the_limit(small_limit, use, size):
    if size == LIMIT:
        assert use(bytes(size)) == bytes(size)
    else:
        with pytest.raises(InputError, match='unpacks to more than'):
            use(bytes(size))


def test_files_may_unpack_to_more_where_they_are_large_themselves(small_limit):
    content = random.Random(0).randbytes(LIMIT) + bytes(9 * LIMIT)
    packed = io.BytesIO(zstd.compress(content))
    assert ros2.zstd.open(packed, 'rb').read() == content


@pytest.mark.parametrize('size, is_large', [(100, False), (101, True)])
def test_a_file_unpacks_to_a_hundred_times_its_size_where_that_is_more(small_limit, monkeypatch,
                                                                       size, is_large):
    """A file that says of itself how much of it was read."""
    monkeypatch.setattr(unpacking, 'MAX_MESSAGE_BYTES', 50 * 1000)

    packed = io.BytesIO(bytes(1000))
    packed.seek(1000)
    unpacked = unpacking._Unpacked(packed, io.BytesIO(bytes(1000 * size)))
    if is_large:
        with pytest.raises(InputError) as raised:
            io.BufferedReader(unpacked).read()
        assert str(raised.value) == 'it unpacks to more than 100 times its size'
    else:
        assert io.BufferedReader(unpacked).read() == bytes(1000 * size)


def test_other_modes_are_those_of_the_library(small_limit):
    file = io.BytesIO()
    with ros2.zstd.open(file, 'wb') as packed:
        packed.write(b'abc' * 100)
    assert zstd.decompress(file.getvalue()) == b'abc' * 100
