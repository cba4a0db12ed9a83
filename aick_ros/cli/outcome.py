# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How a command ends: its last words and its exit code."""

from aick_ros.cli.input.reading import COMPLETE, INTERRUPTED, Reading
from aick_ros.cli.output.console import say

DONE = 0
DEFECT = 1
UNUSABLE_INPUT = 2
INTERRUPTED_BY_USER = 130
PIPE_CLOSED = 141


def of_reading(reading: Reading) -> int:
    """Say what was wrong with a source that has been read; return the exit code."""
    reading.damage.close()
    if reading.ended == INTERRUPTED:
        say('interrupted; what is written is complete up to there')
        return INTERRUPTED_BY_USER
    if reading.ended != COMPLETE:
        say(reading.ended)
        return UNUSABLE_INPUT
    return UNUSABLE_INPUT if reading.damage.count else DONE
