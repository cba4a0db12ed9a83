# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is printed of unusable images: the first ones and their number."""

import pytest

from aick_ros.cli.input import damage_log
from aick_ros.cli.input.damage_log import DamageLog
from aick_ros.errors import InputError


@pytest.mark.parametrize('count, shown, more, last', [
    (0, 0, [], []),
    (1, 1, [], ['1 image was skipped, for the reasons above; all others were used']),
    (5, 5, [], ['5 images were skipped, for the reasons above; all others were used']),
    (6, 5, ['more images are skipped; they are counted, not listed'],
     ['6 images were skipped, for the reasons above; all others were used']),
    (100, 5, ['more images are skipped; they are counted, not listed'],
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


def test_what_is_damaged_throughout_is_not_read_to_its_end(monkeypatch):
    monkeypatch.setattr(damage_log, 'MAX_DAMAGED_IMAGES', 9)
    log = DamageLog()
    for _ in range(9):
        log(InputError('damaged'))
    with pytest.raises(InputError, match='^more than 9 images are unusable, .* not read: '
                       'correct what the first ones say, or record it again$'):
        log(InputError('damaged'))
