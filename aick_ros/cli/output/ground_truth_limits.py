# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The sentence about a ground truth that covers too few frames, or is sparse."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aick_ros.cli.output.console import say
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.ground_truth import (
    MAX_INTERPOLATION_GAP, MAX_SPARSE_GAP, longest_gap, true_pose)
from aick_ros.geometry.trajectory import Trajectory


def say_limits(recording: str, ground_truth: Trajectory | None,
               records: Sequence[FrameRecord]) -> None:
    """
    Say what the ground truth does not allow to measure, if there is such a thing.

    :param recording: its name.
    :param records: of all frames that were read.
    """
    if ground_truth is None or not records:
        return
    sentence = limits(recording, ground_truth, [record.stamp for record in records])
    if sentence is not None:
        say(sentence)


def limits(recording: str, ground_truth: Trajectory, frames: Sequence[int]) -> str | None:
    """
    Return the sentence; None where nothing is to be said.

    :param recording: its name.
    :param ground_truth: at least one pose.
    :param frames: stamps of all frames [ns], at least one.
    """
    stamps = np.array(frames, np.int64)
    covered = np.array([true_pose(ground_truth, stamp) is not None for stamp in frames])
    inside = (stamps >= ground_truth.stamps[0]) & (stamps <= ground_truth.stamps[-1])
    interval = ground_truth.median_interval
    if MAX_SPARSE_GAP < interval < np.inf and not covered[inside].all():
        return (f'poses of the ground truth of {recording} are {interval:.2g} s apart, and up to '
                f'{MAX_SPARSE_GAP:g} s are interpolated: {covered.sum()} of {len(frames)} frames '
                'have errors; record it at 10 Hz or more')
    if covered.sum() < 2 <= len(frames):
        remedy = (f'it has a gap of more than {longest_gap(ground_truth):.2g} s there'
                  if inside.sum() > 1 else 'check that both have the same clock')
        return (f'the ground truth of {recording} covers fewer than two of the frames that were '
                f'read, so there is no ATE: {remedy}')
    interpolated = covered & ~np.isin(stamps, ground_truth.stamps)
    if interval > MAX_INTERPOLATION_GAP and interpolated.any():
        return (f'poses of the ground truth of {recording} are {interval:.2g} s apart: errors and '
                'NEES include what interpolation between them adds')
    return None
