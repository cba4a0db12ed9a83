# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The sentence about gaps at which a recording has no pair of frames."""

from __future__ import annotations

from collections.abc import Sequence

from aick_ros.borders.names import counted


def without_pairs(recording: str, frames: int, gaps: Sequence[int]) -> str:
    """
    Return the sentence about gaps at which no pair counts (:func:`.countable_pairs`).

    :param recording: its name.
    :param frames: number of its frames that were read.
    :param gaps: in frames, at least one.
    """
    if frames < 2:
        remedy = 'a pair requires two frames'
    elif min(gaps) >= frames:
        remedy = f'name gaps below {frames}, or read more frames'
    else:
        remedy = ('name others; a pair counts where the ground truth covers both of its frames '
                  'and none is missing between them')
    return (f'{recording} ({counted(frames, "frame")}) has no pair at --gaps '
            f'{",".join(map(str, gaps))}: {remedy}')
