# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Reading in a thread gives what reading without one gives."""

import sys
import threading
import time

import numpy as np
import pytest

from aick_ros.cli.input.read_ahead import read_ahead
from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.sources import raise_damage

OTHERS: set[threading.Thread] = set()


@pytest.fixture
def frames():
    camera = Camera(4, 3, 4, 4, 1.5, 1)
    depth = np.ones((3, 4), np.float32)
    return [RgbdFrame(i + 1, np.zeros((3, 4), np.uint8), depth, camera) for i in range(40)]


@pytest.fixture(autouse=True)
def readers_of_others(monkeypatch):
    """Remember the threads that tests before left to end by themselves."""
    monkeypatch.setattr(sys.modules[__name__], 'OTHERS', set(threading.enumerate()))


def readers():
    return [thread for thread in threading.enumerate()
            if thread.name == 'read_ahead' and thread not in OTHERS]


def test_frames_and_damage_come_in_order(frames, in_memory):
    def damaged(index, on_damaged):
        if index in (0, 7, 8):
            on_damaged(InputError(f'torn before {index}'))

    events = []
    for frame in read_ahead(in_memory(frames, on_frame=damaged),
                            lambda error: events.append(str(error))):
        assert threading.current_thread() is threading.main_thread()
        events.append(frame)
    expected = list(frames)
    for index in (8, 7, 0):
        expected.insert(index, f'torn before {index}')
    assert events == expected
    assert not readers()


@pytest.mark.parametrize('error', [InputError('the bag ends here'), RuntimeError('a defect'),
                                   MemoryError()])
def test_errors_come_after_the_frames_before_them(frames, in_memory, error):
    def broken(index, on_damaged):
        if index == 30:
            raise error

    seen = []
    with pytest.raises(type(error)) as caught:
        for frame in read_ahead(in_memory(frames, on_frame=broken), raise_damage):
            seen.append(frame)
    assert caught.value is error
    assert seen == frames[:30]
    assert not readers()


def test_stops_when_the_caller_stops_reading(frames, in_memory):
    begun = []
    ahead = read_ahead(in_memory(frames, on_frame=lambda index, _: begun.append(index)),
                       raise_damage)
    assert next(ahead) is frames[0]
    ahead.close()
    assert not readers()
    # it never was far ahead, so a long recording does not fill the memory
    assert len(begun) < 20


def test_stops_when_damage_is_not_accepted(frames, in_memory):
    def damaged(index, on_damaged):
        on_damaged(InputError('torn'))

    with pytest.raises(InputError, match='torn'):
        list(read_ahead(in_memory(frames, on_frame=damaged), raise_damage))
    assert not readers()


def test_reads_while_the_caller_works(frames, in_memory):
    reads, both = [], threading.Barrier(2, timeout=120)

    def wait(index, on_damaged):
        reads.append(index)
        if index == 3:
            both.wait()  # passes only if the caller works meanwhile

    for frame in read_ahead(in_memory(frames[:6], on_frame=wait), raise_damage):
        if frame is frames[0]:
            while 3 not in reads:
                time.sleep(0.001)
            both.wait()
    assert reads == list(range(6))
