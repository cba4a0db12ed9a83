# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The end of a command: last messages and exit code."""

from __future__ import annotations

from aick_ros.cli import exit_codes
from aick_ros.cli.input.damage_log import DamageLog
from aick_ros.cli.input.reading import COMPLETE, INTERRUPTED, Reading
from aick_ros.cli.output.console import say


def of_reading(reading: Reading, is_untracked: bool = False) -> int:
    """
    Report what was wrong with a source that has been read, and return the exit code.

    :param is_untracked: whether no frame of it was tracked, which has been said.
    """
    for remark in reading.remarks:
        say(remark)
    code = of_damage(reading.damage, is_untracked)
    if reading.ended == INTERRUPTED:
        return exit_codes.INTERRUPTED_BY_USER
    if reading.ended != COMPLETE:
        say(reading.ended)
        return exit_codes.UNUSABLE_INPUT
    return code


def of_damage(damage: DamageLog, is_untracked: bool = False) -> int:
    """
    Report the number of skipped images, and return the exit code.

    :param is_untracked: whether no frame was tracked, which has been said.
    """
    damage.close()
    return exit_codes.UNUSABLE_INPUT if damage.count or is_untracked else exit_codes.DONE
