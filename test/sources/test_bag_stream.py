# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which images of a topic are handed on, and when: stamps one by one."""

import pytest

from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.sources.bag_stream import BagStream, StampedMessage


class Reader:
    """Adds images by their stamps [s], recorded a tenth of a second apart."""

    def __init__(self):
        self.dropped, self._log_time = [], 500 * NANOSECONDS
        self._stream = BagStream(lambda stamp, reason: self.dropped.append((stamp, reason)))

    def add(self, *seconds, after=0.1):
        """Return the stamps [s] that became certain with each image."""
        certain = []
        for stamp in seconds:
            self._log_time += round(after * NANOSECONDS)
            image = StampedMessage(round(stamp * NANOSECONDS), object())
            certain.append(self._stamps(self._stream.add(image, self._log_time)))
        return certain

    def flush(self):
        return self._stamps(self._stream.flush())

    @property
    def dropped_stamps(self):
        return [stamp / NANOSECONDS for stamp, _ in self.dropped]

    @staticmethod
    def _stamps(images):
        return [image.stamp / NANOSECONDS for image in images]


@pytest.fixture
def reader():
    return Reader()


def test_the_first_image_waits_for_the_second_and_then_none_waits(reader):
    assert reader.add(100, 100.1, 100.2) == [[], [100, 100.1], [100.2]]
    assert reader.flush() == [] and reader.dropped == []


def test_an_image_alone_comes_at_the_end_and_once(reader):
    assert reader.add(100) == [[]]
    assert (reader.flush(), reader.flush()) == ([100], [])


def test_what_is_handed_on_is_the_image_itself():
    images = [StampedMessage((i + 5) * NANOSECONDS // 10, object()) for i in range(3)]
    stream = BagStream(lambda *_: None)
    assert [each for image in images for each in stream.add(image, image.stamp)] == images


def test_the_image_after_a_gap_waits_too(reader):
    reader.add(100, 100.1)
    assert reader.add(103, 103.1, 103.2) == [[], [103, 103.1], [103.2]]


@pytest.mark.parametrize('gap, waits', [(1.0, False), (1.000000001, True)])
def test_a_gap_is_longer_than_a_second(reader, gap, waits):
    reader.add(100, 100.5)
    assert reader.add(100.5 + gap) == [[] if waits else [100.5 + gap]]


@pytest.mark.parametrize('first, stray, after', [
    ([100, 100.1], 105, 100.2), ([100, 100.1], 105, 103.999999999), ([], 105, 100)])
def test_a_jump_ahead_that_goes_back_is_dropped(reader, first, stray, after):
    reader.add(*first)
    assert reader.add(stray) == [[]]
    handed, = reader.add(after)
    assert reader.dropped_stamps == [stray]
    [(_, reason)] = reader.dropped
    assert reason == f'the stamp is far ahead of {after:.9f}, which follows'
    assert handed + reader.flush() == [after]


def test_what_goes_back_by_a_second_or_less_is_late_itself(reader):
    reader.add(100, 100.1, 105)
    assert reader.add(104, 105.1) == [[], [105, 105.1]]
    assert reader.dropped_stamps == [104]
    assert 'repeats or goes back from 105' in reader.dropped[0][1]


def test_behind_what_was_handed_on_the_kept_one_stays(reader):
    """A jump back of the whole recording is no proof against the image before it."""
    reader.add(100, 100.1, 105)
    assert reader.add(100.1, 99, 105.1) == [[], [], [105, 105.1]]
    assert reader.dropped_stamps == [100.1, 99]


@pytest.mark.parametrize('late', [100.2, 100.1, 99.0])
def test_stamps_increase_strictly(reader, late):
    reader.add(100, 100.1, 100.2)
    assert reader.add(late, 100.3) == [[], [100.3]]
    assert reader.dropped_stamps == [late]
    assert 'from 100.2' in reader.dropped[0][1]


def test_after_a_flush_the_stamp_handed_on_counts(reader):
    reader.add(100)
    reader.flush()
    assert reader.add(100, 99.5, 100.5) == [[], [], [100.5]]
    assert reader.dropped_stamps == [100, 99.5]


def test_stamps_are_compared_with_the_time_of_recording(reader):
    """As those of live images are: more than ten seconds ahead of it."""
    reader.add(100, 100.1)
    assert reader.add(112) == [[]] and reader.dropped_stamps == [112]
    assert 'far ahead of those before' in reader.dropped[0][1]
    assert reader.add(112.0, after=12) == [[]]  # kept, after the pause
    assert reader.add(112.1) == [[112, 112.1]]


def test_no_stamp_is_not_used(reader):
    assert reader.add(0, 100, 100.1) == [[], [], [100, 100.1]]
    assert reader.dropped_stamps == [0]
