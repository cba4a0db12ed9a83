# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is printed of unusable images: the first ones and their number."""

import pytest

from aick_ros.cli.input import damage_log
from aick_ros.cli.input.damage_log import DamageCount, DamageLog
from aick_ros.errors import InputError

MORE = 'more images are skipped and counted; of each further reason one is listed'


@pytest.mark.parametrize('count, shown, more, last', [
    (0, 0, [], []),
    (1, 1, [], ['1 image was skipped, for the reasons above; all others were used']),
    (5, 5, [], ['5 images were skipped, for the reasons above; all others were used']),
    (6, 5, [MORE],
     ['6 images were skipped, for the reasons above; all others were used']),
    (100, 5, [MORE],
     ['100 images were skipped, for the reasons above; all others were used'])])
def test_the_first_are_named_and_all_are_counted(capfd, count, shown, more, last):
    log = DamageLog()
    for number in range(count):
        log(InputError(f'{number}.png is damaged'))
    assert log.count == count
    log.close()
    named = [f'skipped: {number}.png is damaged' for number in range(shown)]
    assert capfd.readouterr().err.splitlines() == [
        f'aick: {line}' for line in [*named, *more, *last]]


def test_the_first_image_of_each_reason_is_listed(capfd):
    """A reason that comes late is most of the images: names and stamps make no other one."""
    repeats, size = '{}: the stamp {} repeats', 'rgb/{}.png: {} x 240 pixels'
    log = DamageLog()
    for number in range(10):
        log(InputError(repeats.format(number, 1.5 + number)))
    for number in range(70):
        log(InputError(size.format(0.1 * number, number)))
    log(InputError(repeats.format(3, 2)))
    log.close()
    listed = [*(repeats.format(number, 1.5 + number) for number in range(5)),
              size.format(0.0, 0)]
    skipped = [f'skipped: {sentence}' for sentence in listed]
    assert capfd.readouterr().err.splitlines() == [f'aick: {line}' for line in [
        *skipped[:5], MORE, skipped[5],
        '81 images were skipped, for the reasons above; all others were used']]


def test_a_recording_with_a_reason_per_image_is_not_listed_to_its_end(capfd):
    log = DamageLog()
    for number in range(22):
        log(InputError(f'{chr(ord("a") + number)} is damaged'))
    log.close()
    *skipped, more, last = capfd.readouterr().err.splitlines()
    assert skipped == [f'aick: skipped: {name} is damaged' for name in 'abcdefghijklmnopqrst']
    assert more == f'aick: {MORE}'
    assert last == ('aick: 22 images were skipped, for the reasons above and others; all others '
                    'were used')


def test_what_is_damaged_throughout_is_not_read_to_its_end(monkeypatch):
    monkeypatch.setattr(damage_log, 'MAX_DAMAGED_IMAGES', 9)
    log = DamageLog()
    for _ in range(9):
        log(InputError('damaged'))
    with pytest.raises(InputError, match='^more than 9 images are unusable, .* not read: '
                       'correct what the first ones say, or record it again$'):
        log(InputError('damaged'))


def test_of_images_that_are_counted_the_first_one_of_each_reason_is_kept():
    count = DamageCount()
    assert (count.first, count.remarks) == (None, [])
    for number in range(40):
        count(InputError(f'{number}.png is damaged'))
        count(InputError(f'{number}.png has no depth'))
    assert (count.count, str(count.first)) == (80, '0.png is damaged')
    assert count.remarks == [
        '80 images skipped, the first of each reason: 0.png is damaged, 0.png has no depth']


def test_of_images_that_are_counted_a_few_reasons_are_kept():
    count = DamageCount()
    for reason in 'abcdef':
        count(InputError(reason))
    assert count.remarks == [
        '6 images skipped, the first of each reason: a, b, c, d, e, and for others']


def test_too_many_images_that_are_counted_end_the_reading(monkeypatch):
    monkeypatch.setattr(damage_log, 'MAX_DAMAGED_IMAGES', 2)
    count = DamageCount()
    for _ in range(2):
        count(InputError('damaged'))
    with pytest.raises(InputError, match='more than 2 images are unusable, .* is not read'):
        count(InputError('damaged'))
    assert count.count == 2
