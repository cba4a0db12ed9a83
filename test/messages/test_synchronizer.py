# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairing of stamped images: against the classical association, in any order of arrival."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aick_ros.geometry.stamps import RESTART_AFTER
from aick_ros.messages.synchronizer import Pair, Synchronizer

MS = 1_000_000


def greedy(colour, depth, limit):
    """The association of the TUM tools: smallest differences first, each used once."""
    candidates = sorted((abs(c - d), c, d) for c in colour for d in depth if abs(c - d) <= limit)
    free_colour, free_depth, pairs = set(colour), set(depth), []
    for _, c, d in candidates:
        if c in free_colour and d in free_depth:
            free_colour.remove(c)
            free_depth.remove(d)
            pairs.append((c, d))
    return sorted(pairs)


def arrivals(colour, depth):
    return sorted([(stamp, 'colour') for stamp in colour] + [(stamp, 'depth') for stamp in depth])


def run(events, flush=True, **options):
    synchronizer = Synchronizer(**options)
    pairs = []
    for stamp, kind in events:
        add = synchronizer.add_colour if kind == 'colour' else synchronizer.add_depth
        pairs += add(int(stamp), f'{kind} {stamp}')
    if flush:
        pairs += synchronizer.flush()
    for pair in pairs:
        assert pair.colour == f'colour {pair.colour_stamp}'
        assert pair.depth == f'depth {pair.depth_stamp}'
    return [(pair.colour_stamp, pair.depth_stamp) for pair in pairs], synchronizer


def camera(rng, count, offset_ms, jitter_ms, loss, period_ms=33.3):
    times = np.arange(count) * period_ms
    streams = []
    for shift in (0.0, offset_ms):
        stamps = np.round((times + shift + rng.uniform(-jitter_ms, jitter_ms, count)) * 1000)
        streams.append([int(s) * 1000 + 10 ** 12 for s in stamps[rng.random(count) >= loss]])
    return streams


@pytest.mark.parametrize('offset_ms, jitter_ms, loss', [
    (0, 0, 0), (3, 1, 0), (-8, 2, 0.1), (12, 2, 0), (5, 1, 0.3), (-13, 1, 0.05)])
def test_pairs_are_those_of_the_classical_association(offset_ms, jitter_ms, loss):
    rng = np.random.default_rng(1)
    colour, depth = camera(rng, 300, offset_ms, jitter_ms, loss)
    pairs, synchronizer = run(arrivals(colour, depth))
    assert pairs == greedy(colour, depth, 20 * MS)
    assert synchronizer.unpaired['colour'] >= len(colour) - len(pairs) - 1


def test_near_half_a_period_the_pairs_are_as_many_and_as_good():
    """There the best choice depends on much later images; nearly all pairs are the same."""
    rng = np.random.default_rng(2)
    colour, depth = camera(rng, 600, 16.0, 2.0, 0.02)
    pairs, _ = run(arrivals(colour, depth))
    expected = greedy(colour, depth, 20 * MS)
    assert len(set(pairs) & set(expected)) > 0.9 * len(expected)
    assert len(pairs) > 0.97 * len(expected)


@pytest.mark.parametrize('offset_ms', [0, 5, -12])
def test_pairs_do_not_depend_on_the_order_of_arrival(offset_ms):
    rng = np.random.default_rng(3)
    colour, depth = camera(rng, 100, offset_ms, 1.0, 0.1)
    expected, _ = run(arrivals(colour, depth))
    late_colour = sorted(arrivals(colour, depth),
                         key=lambda event: event[0] + (30 * MS if event[1] == 'colour' else 0))
    late_depth = sorted(arrivals(colour, depth),
                        key=lambda event: event[0] + (30 * MS if event[1] == 'depth' else 0))
    assert run(late_colour)[0] == run(late_depth)[0] == expected


def test_a_pair_that_cannot_be_beaten_does_not_wait():
    """From the third frame on the period is known: a pair is returned with its second image."""
    synchronizer = Synchronizer()
    for i in range(20):
        stamp = i * 33 * MS
        synchronizer.add_colour(stamp, None)
        pairs = synchronizer.add_depth(stamp + 5 * MS, None)
        if i > 2:
            assert [pair.colour_stamp for pair in pairs] == [stamp]


def test_equal_stamps_are_paired_at_once():
    synchronizer = Synchronizer(max_interval=0.0)
    assert synchronizer.add_colour(10, 'c') == []
    assert synchronizer.add_depth(10, 'd') == [(10, 'c', 10, 'd')]


def test_exact_pairs_equal_stamps_only():
    events = [(s, kind) for s in (10, 20, 30) for kind in ('colour', 'depth')]
    events[2] = (21, 'colour')
    assert run(events, max_interval=0.0)[0] == [(10, 10), (30, 30)]


def test_repeated_and_late_stamps_are_rejected_and_counted():
    events = [(s * MS, kind) for s in (100, 133, 133, 120, 166) for kind in ('colour', 'depth')]
    pairs, synchronizer = run(events)
    assert pairs == [(s * MS, s * MS) for s in (100, 133, 166)]
    assert synchronizer.late == 4


def test_a_recording_that_starts_again_is_followed():
    once = [(s * 33 * MS + 10 ** 10, kind) for s in range(90) for kind in ('colour', 'depth')]
    pairs, synchronizer = run(once + once)
    assert pairs == 2 * [(stamp, stamp) for stamp, kind in once if kind == 'colour']
    assert synchronizer.late == 0


def test_the_images_of_a_pair_are_not_used_again():
    synchronizer = Synchronizer()
    pair = Pair(10 * MS, 'c', 12 * MS, 'd')
    assert synchronizer.add_pair(pair) == [pair]
    assert synchronizer.add_pair(pair) == []
    assert synchronizer.add_depth(12 * MS, 'd') == []
    assert synchronizer.late == 2


@pytest.mark.parametrize('beyond, is_late', [(0, True), (1, False)])
def test_up_to_a_second_back_is_late_and_more_is_a_restart(beyond, is_late):
    synchronizer = Synchronizer()
    synchronizer.add_colour(10 ** 10, None)
    synchronizer.add_colour(10 ** 10 - RESTART_AFTER - beyond, None)
    assert synchronizer.late == is_late
    assert synchronizer.unpaired['colour'] == (not is_late)


@pytest.mark.parametrize('shift_ms', [2_000, 60_000])
def test_after_a_restart_pairs_come_at_once(shift_ms):
    """The gap back to the start is none of the stream: the period stays known."""
    synchronizer = Synchronizer()
    for start in (shift_ms * MS, 0):
        for i in range(20):
            stamp = start + i * 33 * MS
            synchronizer.add_colour(stamp, None)
            pairs = synchronizer.add_depth(stamp + 5 * MS, None)
            if start == 0 or i > 2:
                assert [pair.colour_stamp for pair in pairs] == [stamp]


def test_images_that_wait_at_a_restart_are_counted_as_unpaired():
    synchronizer = Synchronizer()
    for stamp in (60_000, 60_033, 0):
        synchronizer.add_colour(stamp * MS, None)
    assert synchronizer.unpaired == {'colour': 2, 'depth': 0}


def test_a_restart_is_found_by_either_stream_once():
    """Depth restarts first, at a stamp just after that of its colour image."""
    before = [(60_000 * MS, 'colour'), (60_000 * MS, 'depth')]
    pairs, synchronizer = run([*before, (5 * MS, 'depth'), (0, 'colour')])
    assert pairs == [(60_000 * MS, 60_000 * MS), (0, 5 * MS)]
    assert synchronizer.unpaired == {'colour': 0, 'depth': 0}


def test_of_two_equally_near_images_the_earlier_one_is_paired():
    events = [(0, 'depth'), (5 * MS, 'colour'), (10 * MS, 'depth')]
    assert run(events)[0] == [(5 * MS, 0)]


def test_a_camera_that_becomes_slower_is_followed():
    """After a second at the new rate the pairs do not wait for another image."""
    synchronizer, stamp = Synchronizer(), 0
    for period in [11] * 60 + [33] * 60:
        stamp += period * MS
        synchronizer.add_colour(stamp, None)
        pairs = synchronizer.add_depth(stamp + 12 * MS, None)
    assert [pair.colour_stamp for pair in pairs] == [stamp]


def test_the_queue_is_bounded():
    synchronizer = Synchronizer(queue_size=5)
    for stamp in range(1000):
        assert synchronizer.add_colour(stamp * 33 * MS, None) == []
    assert synchronizer.unpaired['colour'] == 995
    assert [p.colour_stamp for p in synchronizer.add_depth(999 * 33 * MS, None)] == [999 * 33 * MS]


def test_each_image_is_used_once():
    rng = np.random.default_rng(4)
    for offset in (0, 7, 16):
        pairs, _ = run(arrivals(*camera(rng, 200, offset, 5, 0.2)))
        for stamps in zip(*pairs):
            assert all(a < b for a, b in itertools.pairwise(stamps))


@pytest.mark.parametrize('offset_ms', [0, 8, -14])
def test_without_a_limit_the_nearest_are_still_paired(offset_ms):
    """Also past lost images, whose partners pair with nothing else."""
    rng = np.random.default_rng(1)
    colour, depth = camera(rng, 300, offset_ms, 1, 0.1)
    pairs, _ = run(arrivals(colour, depth), max_interval=math.inf)
    nearby = greedy(colour, depth, 16 * MS)
    assert len(set(nearby) - set(pairs)) <= 0.02 * len(nearby)


def test_without_a_limit_any_distance_will_do():
    assert run([(0, 'colour'), (10 ** 11, 'depth')], max_interval=math.inf)[0] == [(0, 10 ** 11)]
    assert run([(0, 'colour'), (10 ** 11, 'depth')], max_interval=1e308)[0] == [(0, 10 ** 11)]


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 200)), max_size=60),
       st.integers(0, 20), st.sampled_from([None, 1, 5]))
def test_each_image_is_paired_once_in_order_and_within_the_interval(steps, interval, queue_size):
    """Of two streams with increasing stamps that arrive in any order."""
    synchronizer = Synchronizer(interval * 1e-3, queue_size)
    stamps, pairs = [0, 0], []
    for is_depth, step in steps:
        stamps[is_depth] += step * 1_000_000
        add = synchronizer.add_depth if is_depth else synchronizer.add_colour
        pairs += add(stamps[is_depth], (is_depth, stamps[is_depth]))
    pairs += synchronizer.flush()
    assert all(abs(pair.colour_stamp - pair.depth_stamp) <= interval * 1_000_000
               for pair in pairs)
    assert all(pair.colour == (False, pair.colour_stamp) and pair.depth == (True, pair.depth_stamp)
               for pair in pairs)
    for kind in ('colour_stamp', 'depth_stamp'):
        paired = [getattr(pair, kind) for pair in pairs]
        assert paired == sorted(set(paired))


@pytest.mark.parametrize('beyond, is_paired', [(0, True), (1, False)])
def test_the_longest_interval_is_within(beyond, is_paired):
    events = [(0, 'colour'), (20 * MS + beyond, 'depth')]
    assert bool(run(events)[0]) is is_paired  # by default 20 ms
    assert bool(run([(5, 'depth'), (7 + beyond, 'colour')], max_interval=2e-9)[0]) is is_paired


@pytest.mark.parametrize('offset_ms, at_once', [(39, True), (41, False)])
@pytest.mark.parametrize('first', ['colour', 'depth'])
def test_within_two_fifths_of_the_period_a_pair_is_certain(offset_ms, at_once, first):
    """The next image of the earlier stream may come after four fifths of its shortest gap."""
    events = []
    for i in range(20):
        events += [(i * 100 * MS, first),
                   (i * 100 * MS + offset_ms * MS, 'depth' if first == 'colour' else 'colour')]
    pairs, _ = run(events, flush=False, max_interval=0.06)
    assert len(pairs) == (20 if at_once else 19)
    assert len(run(events, max_interval=0.06)[0]) == 20


@pytest.mark.parametrize('offset_ms, at_once', [(61, True), (59, False)])
@pytest.mark.parametrize('first', ['colour', 'depth'])
def test_beyond_three_fifths_of_the_period_the_next_image_is_certain(offset_ms, at_once, first):
    """
    It is 39 ms away, of which twice is less than four fifths of the other stream's gap.

    So it is where an image is lost, and another one waits for the partner that it would have had.
    """
    synchronizer = Synchronizer(max_interval=0.07)
    add_first, add_second = synchronizer.add_colour, synchronizer.add_depth
    if first == 'depth':
        add_first, add_second = add_second, add_first
    for i in range(20):
        pairs = add_first(i * 100 * MS, None)
        if i > 3 and i != 13:
            assert bool(pairs) is at_once
        if i != 12:
            pairs += add_second((i * 100 + offset_ms) * MS, None)
        if i > 3 and i not in (12, 13):
            assert [abs(pair.colour_stamp - pair.depth_stamp) for pair in pairs] == [
                (100 - offset_ms) * MS]


def test_the_period_is_that_of_the_last_thirty_gaps():
    """A camera becomes slower: until its short gaps are forgotten a pair waits for one more."""
    synchronizer, stamp, waited = Synchronizer(max_interval=0.05), 0, []
    for index in range(60):
        stamp += (10 if index < 20 else 100) * MS
        synchronizer.add_colour(stamp, None)
        pairs = synchronizer.add_depth(stamp + 30 * MS * (index >= 20), None)
        if index >= 20:
            waited.append(stamp not in [pair.colour_stamp for pair in pairs])
    # after the first slow image there is one slow gap, and 29 others in view
    assert waited == [True] * 29 + [False] * 11


def test_the_queue_drops_the_oldest_image():
    synchronizer = Synchronizer(queue_size=2)
    for stamp in (0, 100, 200):
        synchronizer.add_colour(stamp * MS, stamp)
    assert synchronizer.unpaired == {'colour': 1, 'depth': 0}
    synchronizer.add_depth(0, None)
    assert synchronizer.unpaired == {'colour': 1, 'depth': 1}
    assert [pair.colour for pair in synchronizer.add_depth(100 * MS, None)] == [100]


def test_images_of_a_pair_set_the_stamps_of_both_streams():
    synchronizer = Synchronizer()
    synchronizer.add_pair(Pair(10 * MS, 'c', 12 * MS, 'd'))
    assert synchronizer.add_depth(11 * MS, 'd') == [] and synchronizer.late == 1
    assert synchronizer.add_colour(11 * MS, 'c') == [] and synchronizer.late == 1
    assert synchronizer.unpaired == {'colour': 0, 'depth': 0}


def test_the_stream_that_is_not_far_ahead_keeps_its_images():
    """One stray stamp of colour; depth waits meanwhile, and is near what follows."""
    synchronizer = Synchronizer(max_interval=math.inf)
    assert synchronizer.add_depth(1_000 * MS, 'd') == []
    assert synchronizer.add_colour(60_000 * MS, 'stray') == []
    synchronizer.add_colour(990 * MS, 'c')
    assert synchronizer.unpaired == {'colour': 1, 'depth': 0}
    assert synchronizer.flush() == [(990 * MS, 'c', 1_000 * MS, 'd')]


@given(st.integers(1, 10_000_000))
def test_an_interval_in_seconds_is_the_nearest_number_of_nanoseconds(microseconds):
    """A product of decimal seconds may lie just below a whole number."""
    for beyond in (0, 1):
        pairs, _ = run([(7, 'colour'), (7 + 1_000 * microseconds + beyond, 'depth')],
                       max_interval=microseconds / 1e6)
        assert len(pairs) == 1 - beyond


def test_of_pairs_that_come_together_the_stamp_of_colour_increases():
    """It is that of the frame; a depth image may come twice, with another colour image."""
    synchronizer = Synchronizer()
    for colour, depth, is_taken in ((100, 90, True), (133, 90, True), (133, 140, False),
                                    (120, 150, False), (166, 160, True)):
        pair = Pair(colour * MS, 'c', depth * MS, 'd')
        assert synchronizer.add_pair(pair) == ([pair] if is_taken else [])
    assert synchronizer.late == 2
