# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Missing images: counted from the stamps, against how many were removed."""

import numpy as np
import pytest

from aick_ros.messages.missing_images import MissingImages

SECOND = 10 ** 9
START = 1_700_000_000 * SECOND


@pytest.mark.parametrize('lost', [0.0, 0.2, 0.6, 0.8])
def test_the_share_of_images_lost_at_random(lost):
    """A camera of 30 Hz whose stamps jitter by 5 %."""
    rng = np.random.default_rng(1)
    stamps = START + np.cumsum(rng.normal(1, 0.05, 600) * SECOND / 30).astype(int)
    counter = MissingImages()
    arrived = stamps[rng.random(600) >= lost]
    for stamp in arrived:
        counter.add(int(stamp))
    assert counter.share == pytest.approx(lost, abs=0.1)
    assert counter.count == pytest.approx(600 - len(arrived), abs=60)


def test_a_few_images_are_too_few_to_count():
    counter = MissingImages()
    for stamp in (0, 1, 5, 6, 10):
        counter.add(START + stamp * SECOND // 30)
    assert counter.share == counter.count == 0


def missing(stamps):
    """Return how many of a stream's images are counted as missing, and their recent share."""
    counter = MissingImages()
    for stamp in stamps:
        counter.add(int(stamp))
    return counter.count, counter.share


def test_images_that_come_late_are_not_missing():
    """One in fifteen is stamped late by up to two periods, and the next in its wake."""
    rng = np.random.default_rng(2)
    ticks = START + np.arange(900) * SECOND / 30
    late = (rng.random(900) < 1 / 15) * rng.uniform(0.0, 2.0, 900) * SECOND / 30
    stamps = np.maximum.accumulate(ticks + late) + np.arange(900) * 10 ** 5
    count, share = missing(stamps)
    assert count <= 2
    assert share < 0.05
    # images that are missing besides are counted all the same
    arrived = rng.random(900) >= 0.3
    count, share = missing(stamps[arrived])
    assert count == pytest.approx(900 - arrived.sum(), rel=0.3)
    assert share == pytest.approx(0.3, abs=0.12)


@pytest.mark.parametrize('lost', [0.0, 0.3])
@pytest.mark.parametrize('seed', range(3))
def test_images_stamped_some_periods_late_are_not_missing(seed, lost):
    """One in ten is stamped late by up to four periods, and the next ones in its wake."""
    rng = np.random.default_rng(seed)
    late = (rng.random(900) < 0.1) * rng.uniform(0.0, 4.0, 900)
    stamps = np.maximum.accumulate(np.arange(900) + late) * SECOND / 30 + np.arange(900) * 10 ** 5
    arrived = rng.random(900) >= lost
    count, share = missing(START + stamps[arrived])
    # one that is late at the end is not made up for yet: up to 5 periods
    assert count == pytest.approx(900 - arrived.sum(), rel=0.25, abs=5)
    assert share == pytest.approx(lost, abs=0.12 if lost else 0.04)


@pytest.mark.parametrize('lost', [0.0, 0.3])
@pytest.mark.parametrize('seed', range(3))
def test_images_that_come_out_of_order_are_not_missing(seed, lost):
    """One in ten arrives up to four periods late, with the stamp it should have."""
    rng = np.random.default_rng(seed)
    ticks = np.arange(900) + rng.normal(0.0, 0.02, 900)
    arrivals = np.arange(900) + (rng.random(900) < 0.1) * rng.uniform(1.0, 4.0, 900)
    order = np.argsort(arrivals)
    order = order[rng.random(900) >= lost]
    count, share = missing(START + ticks[order] * SECOND / 30)
    assert count == pytest.approx(900 - len(order), rel=0.05, abs=1)
    assert share == pytest.approx(lost, abs=0.12 if lost else 0.02)


def test_an_image_that_comes_twice_does_not_make_up_for_a_missing_one():
    stamps = START + np.delete(np.arange(300), np.s_[5::10]) * SECOND // 30
    count, share = missing(np.repeat(stamps, 2))
    assert count == pytest.approx(30, abs=1)
    assert share == pytest.approx(0.1, abs=0.01)


def test_a_recording_that_loops_goes_on_counting():
    stamps = START + np.delete(np.arange(120), np.s_[5::10]) * SECOND // 30
    count, _ = missing(np.concatenate([stamps, stamps, stamps]))
    assert count == pytest.approx(36, abs=3)


@pytest.mark.parametrize('seed', range(5))
@pytest.mark.parametrize('jitter', [0.1, 0.2, 0.5])
def test_nothing_is_counted_between_stamps_that_jitter(jitter, seed):
    rng = np.random.default_rng(seed)
    ticks = START + np.arange(900) * SECOND / 30
    count, share = missing(np.sort(ticks + rng.normal(0.0, jitter, 900) * SECOND / 30))
    assert count <= 2
    assert share < 0.05


def test_images_are_not_missing_in_a_pause():
    ticks = np.arange(60) * SECOND // 30
    assert missing(np.concatenate([START + ticks, START + 7 * SECOND + ticks])) == (0, 0.0)


@pytest.mark.parametrize('late_by, counted', [(3, 0), (12, 1)])
def test_the_count_waits_for_late_images_and_never_decreases(late_by, counted):
    """The image at index 100 arrives after some of those that follow it."""
    order = np.insert(np.delete(np.arange(200), 100), 100 + late_by, 100)
    counter, counts = MissingImages(), []
    for index in order:
        counter.add(int(START + index * SECOND // 30))
        counts.append(counter.count)
    assert counts == sorted(counts)
    assert counts[-1] == counted


def test_nothing_is_counted_where_nearly_all_images_are_lost():
    """Bursts of 2 images of a camera of 200 Hz, 0.9 s apart: the period itself is in doubt."""
    ticks = np.concatenate([[index, index + 1] for index in range(0, 60 * 180, 180)])
    assert missing(START + ticks * SECOND // 200) == (0, 0.0)


def stamps_at(rates, count):
    """Return stamps at one rate [Hz] after the other."""
    return START + np.cumsum(np.repeat([SECOND / rate for rate in rates], count)).astype(int)


@pytest.mark.parametrize('rates', [(30, 5), (30, 15), (30, 12), (5, 30), (30, 5, 30), (30, 15, 5)])
def test_a_camera_that_changes_its_rate_loses_nothing(rates):
    """As by auto exposure; neither afterwards nor in between."""
    counter, shares = MissingImages(), []
    for stamp in stamps_at(rates, 150):
        counter.add(int(stamp))
        shares.append(counter.share)
    assert max(shares) <= 0.05
    assert counter.count <= 2


@pytest.mark.parametrize('rates', [(30, 15), (15, 30)])
def test_losses_at_both_rates_are_counted(rates):
    stamps = stamps_at(rates, 600)
    arrived = np.random.default_rng(3).random(len(stamps)) >= 0.3
    count, share = missing(stamps[arrived])
    assert count == pytest.approx(np.sum(~arrived), rel=0.3)
    assert share == pytest.approx(0.3, abs=0.12)


@pytest.mark.parametrize('pause, counted', [(38, True), (42, False)])
def test_beyond_a_mean_gap_of_ten_periods_nothing_is_counted(pause, counted):
    """Of 3 gaps of one period and one of 37, the mean is 10; of 200 Hz, it is below a second."""
    ticks = np.concatenate([np.arange(index, index + 4) for index in range(0, 60 * pause, pause)])
    mean = pause / 4
    count, share = missing(START + ticks * SECOND // 200)
    assert (count > 0) is (share > 0) is counted
    if counted:
        assert share == pytest.approx(1 - 1 / mean, abs=0.02)


def regular(count, gone=(), rate=32):
    """Return the stamps of a camera without jitter, some images of which are gone."""
    return [START + i * SECOND // rate for i in range(count) if i not in set(gone)]


@pytest.mark.parametrize('gaps, counted', [(19, 0), (20, 3)])
def test_twenty_gaps_show_the_period(gaps, counted):
    assert missing(regular(gaps + 4, gone=(2, 3, 4)))[0] == counted


@pytest.mark.parametrize('periods, counted', [(32, 31), (33, 0)])
def test_a_gap_of_more_than_a_second_is_a_pause(periods, counted):
    stamps = regular(40) + [START + (39 + periods + i) * SECOND // 32 for i in range(40)]
    assert missing(stamps)[0] == counted


@pytest.mark.parametrize('equal, counted', [(7, True), (8, False)])
def test_eight_equal_gaps_in_a_row_are_another_rate(equal, counted):
    """Gaps of two periods, in a stream of single ones."""
    stamps = regular(40) + [START + (39 + 2 * i) * SECOND // 32 for i in range(1, equal + 1)]
    stamps += [stamps[-1] + i * SECOND // 32 for i in range(1, 40)]
    assert missing(stamps)[0] == (equal if counted else 0)


@pytest.mark.parametrize('after, counted', [(8, 0), (9, 2)])
def test_the_eight_newest_gaps_are_not_settled(after, counted):
    stamps = regular(60, gone=(40, 41))
    end = stamps.index(START + 42 * SECOND // 32)  # the image after those that are gone
    assert missing(stamps[:end + after])[0] == counted


def test_the_share_is_that_of_the_last_hundred_settled_gaps():
    gone = (30, 31)
    counter, shares = MissingImages(), []
    for stamp in regular(200, gone):
        counter.add(stamp)
        shares.append(counter.share)
    found = np.array(shares)
    assert found[60] == pytest.approx(2 / (60 - 8 + 2))  # of 52 gaps, 54 periods
    assert counter.count == 2
    # the gap is the 30th of the stream: in view as long as not more than 100 settled ones follow
    assert found[29 + 8 + 100] == pytest.approx(2 / 102)
    assert found[29 + 8 + 101] == 0.0


@pytest.mark.parametrize('back, is_restart', [(32, False), (33, True)])
def test_up_to_a_second_back_is_late_and_more_is_a_restart(back, is_restart):
    """In a stream with a hole: a late image fills it, those of another recording do not."""
    gone = 80 - back
    stamps = regular(81, gone=(gone,))
    counter = MissingImages()
    for stamp in [*stamps, START + gone * SECOND // 32]:
        counter.add(stamp)
    assert counter.count == is_restart


@pytest.mark.parametrize('share, counted', [(0.19, True), (0.22, False)])
def test_unclear_ratios_up_to_a_fifth_are_rounded(share, counted):
    """Every third image is gone, and some gaps are of 2.4 periods instead of 2."""
    rng = np.random.default_rng(0)
    ratios = rng.permutation(np.repeat([1.0, 2.0], [200, 100]))[:150]
    unclear = np.zeros(150, bool)
    unclear[rng.choice(150, round(share * 150), replace=False)] = True
    ratios[unclear] = 1.4
    stamps = START + np.cumsum(ratios * SECOND / 32).astype(int)
    assert (missing(stamps)[0] > 20) == counted


@pytest.mark.parametrize('error, counted', [(0.24, True), (0.26, False)])
def test_a_ratio_is_unclear_beyond_a_quarter_of_a_period(error, counted):
    """Single gaps and those of about two periods, in no order that repeats."""
    is_long = np.random.default_rng(1).random(150) < 0.4
    ratios = np.where(is_long, 2.0 + error * (-1.0) ** np.arange(150), 1.0)
    stamps = START + np.cumsum(ratios * SECOND / 32).astype(int)
    assert (missing(stamps)[0] > 20) == counted


def test_at_a_restart_what_is_missing_among_the_newest_gaps_is_final():
    """No image of the first recording can come late any more."""
    counter = MissingImages()
    for stamp in [*regular(60, gone=(57,)), *regular(30)]:
        counter.add(stamp)
    assert counter.count == 1


def test_another_rate_that_is_no_part_of_the_first_leaves_its_losses_counted():
    """Gaps of two and a half periods are unclear, but steady."""
    counter = MissingImages()
    stamps = regular(60, gone=(20, 21))
    for stamp in stamps + [stamps[-1] + i * 5 * SECOND // 64 for i in range(1, 41)]:
        counter.add(stamp)
    assert counter.share == pytest.approx(2 / (57 + 40 - 8 + 2))
