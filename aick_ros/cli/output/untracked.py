# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The sentence about a recording of which no frame was tracked."""

from __future__ import annotations

from collections.abc import Sequence

from aick_ros.cli.output.console import say
from aick_ros.evaluation.scores.frame_record import FrameRecord


def say_if_untracked(recording: str, records: Sequence[FrameRecord]) -> bool:
    """
    Say why the odometry did not even begin, where it did not.

    :param recording: its name.
    :param records: of all frames that were read.
    :returns: whether it did not.
    """
    if not records or any(record.status.ok for record in records):
        return False
    last = records[-1]
    say(f'no frame of {recording} was tracked: {last.status.value}: {last.reason}')
    return True
