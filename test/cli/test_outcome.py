# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The last message and the exit code of a reading, by how it ended and what was damaged."""

from types import SimpleNamespace

import pytest

from aick_ros.cli import outcome
from aick_ros.cli.input.damage_log import DamageLog
from aick_ros.cli.input.reading import COMPLETE, INTERRUPTED
from aick_ros.errors import InputError

SKIPPED = '1 image was skipped'


@pytest.mark.parametrize('ended, damaged, code, messages', [
    (COMPLETE, 0, 0, []), (COMPLETE, 1, 2, [SKIPPED]),
    (INTERRUPTED, 0, 130, []), (INTERRUPTED, 1, 130, [SKIPPED]),
    ('the index is broken', 0, 2, ['the index is broken']),
    ('the index is broken', 1, 2, [SKIPPED, 'the index is broken'])])
def test_the_end_of_a_reading(capfd, ended, damaged, code, messages):
    damage = DamageLog()
    for _ in range(damaged):
        damage(InputError('1.png is damaged'))
    capfd.readouterr()
    assert outcome.of_reading(SimpleNamespace(ended=ended, damage=damage, remarks=())) == code
    lines = capfd.readouterr().err.splitlines()
    assert len(lines) == len(messages)
    assert all(line.startswith(f'aick: {message}') for line, message in zip(lines, messages))


@pytest.mark.parametrize('ended, code', [(COMPLETE, 2), (INTERRUPTED, 130), ('broken', 2)])
def test_a_reading_of_which_nothing_was_tracked(ended, code):
    reading = SimpleNamespace(ended=ended, damage=DamageLog(), remarks=())
    assert outcome.of_reading(reading, is_untracked=True) == code


def test_what_was_not_used_is_said_and_is_no_error(capfd):
    reading = SimpleNamespace(ended=COMPLETE, damage=DamageLog(), remarks=[
        '6 of 150 images have no partner', 'the IMU is not used'])
    assert outcome.of_reading(reading) == 0
    assert capfd.readouterr().err == (
        'aick: 6 of 150 images have no partner\naick: the IMU is not used\n')
