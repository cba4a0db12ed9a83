# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a person should look after the odometry, and the sentence that helps."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum

from aick_ros.registration.status import Status
from aick_ros.ros.health.frame_statistics import (
    ANSWERED, DAMAGED, FAILED, LOST, RECEIVED, UNDER_LOAD, WINDOW, Snapshot)

_LOST_TOO_LONG = 2.0  # seconds
_SILENT_TOO_LONG = 5.0  # seconds
_TOLERATED = 0.05  # share of frames lost, dropped or damaged

_REMEDIES = {
    Status.TOO_FEW_KEYPOINTS: 'is the lens covered, the room dark, the wall blank, or everything '
                              'beyond sensor.max_depth?',
    Status.TOO_FEW_MATCHES: 'the view changed too much between two frames: more frames a second '
                            'or more features.max_keypoints help',
    Status.MOTION_GATE: 'raise odometry.max_speed and odometry.max_turn_rate if the robot is '
                        'that fast',
}


class Level(Enum):
    """Levels of diagnostic_msgs/DiagnosticStatus that the node gives."""

    OK = b'\x00'
    WARN = b'\x01'
    ERROR = b'\x02'


def judge(frames: Snapshot, complaint: str, paused: bool) -> tuple[Level, str]:
    """
    Return how the odometry is, in one word and in one sentence.

    :param complaint: what the inputs miss, '' where they miss nothing.
    """
    if paused:
        return Level.WARN, 'paused: call ~/resume_odom to go on'
    if frames.recent[FAILED]:
        return Level.ERROR, (f'{frames.recent[FAILED]} frames failed by a defect of ours: see the '
                             'log and report it')
    if complaint:
        return Level.ERROR if frames.silent_for > _SILENT_TOO_LONG else Level.WARN, complaint
    status = f'{frames.status.value}: {frames.reason}'
    if frames.lost_for:
        remedy = _REMEDIES.get(frames.status)
        sentence = f'{status}; {remedy}' if remedy else status
        if frames.lost_for > _LOST_TOO_LONG:
            return Level.ERROR, f'lost for {frames.lost_for:.0f} s: {sentence}'
        return Level.WARN, sentence
    concerns = list(_concerns(frames))
    if concerns:
        return Level.WARN, '; '.join(concerns)
    return (Level.OK, frames.status.value) if frames.status.ok else (Level.WARN, status)


def _concerns(frames: Snapshot) -> Iterator[str]:
    lately = f'of the last {WINDOW:g} s'
    if frames.share(LOST, ANSWERED) > _TOLERATED:
        yield f'{frames.share(LOST, ANSWERED):.0%} of the frames {lately} were lost'
    if frames.share(DAMAGED, RECEIVED) > _TOLERATED:
        yield (f'{frames.share(DAMAGED, RECEIVED):.0%} of the frames {lately} could not be used, '
               'see the log')
    if frames.share(UNDER_LOAD, RECEIVED) > _TOLERATED:
        yield (f'{frames.rate(ANSWERED):.0f} of {frames.rate(RECEIVED):.0f} frames a second are '
               'answered: lower features.max_keypoints, or let max_update_rate leave frames out '
               'evenly')
