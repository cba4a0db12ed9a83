# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The level of the odometry in ``/diagnostics``, and a sentence with the remedy."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum

from aick_ros.frames.depth import UNITS_OF_DEPTH
from aick_ros.registration.refinement.refined import CONTRADICTION
from aick_ros.registration.status import Status
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.frame_statistics import WINDOW, Snapshot
from aick_ros.ros.health.sentences import joined

_LOST_TOO_LONG = 2.0  # seconds; chosen
_SILENT_TOO_LONG = 5.0  # seconds; chosen, as long as the watchdog waits for a topic
_TOLERATED = 0.05  # share of frames lost, dropped or damaged; chosen

_SKIPPED = (Count.SKIPPED_WHILE_PAUSED, Count.DROPPED_BY_RESET, Count.SKIPPED_BY_RATE_LIMIT,
            Count.SKIPPED_TO_SHED_LOAD)  # as was asked for: they are not answered

_REMEDIES = {
    Status.TOO_FEW_KEYPOINTS: 'is the lens covered, the room dark, the wall blank, or everything '
                              'beyond sensor.max_depth?',
    Status.TOO_FEW_MATCHES: 'the view changed too much between two frames: a higher frame rate '
                            'or more features.max_keypoints help',
    Status.MOTION_GATE: 'raise odometry.max_speed and odometry.max_turn_rate if the robot is '
                        'that fast',
}

_REMEDIES_OF_REASONS = {
    CONTRADICTION: 'something that moves fills most of the view, or colour and depth are not of '
                   'the same moment: synchronize the two images in the driver',
}


class Level(Enum):
    """Levels of diagnostic_msgs/DiagnosticStatus that the node reports."""

    OK = b'\x00'
    WARN = b'\x01'
    ERROR = b'\x02'


def judge(frames: Snapshot, complaint: str, paused: bool,
          concern: str = '') -> tuple[Level, str]:
    """
    Return the level of the odometry and a sentence that explains it.

    :param complaint: what is missing at the inputs, '' where nothing is.
    :param paused: whether frames are skipped by request.
    :param concern: what the frames do not show, '' for nothing.
    """
    if paused:
        return Level.WARN, 'paused: call ~/resume_odom to continue'
    if frames.recent[Count.FAILED]:
        return Level.ERROR, (f'{frames.recent[Count.FAILED]} frames failed by a defect of this '
                             'node: see the log and report it')
    if complaint:
        return Level.ERROR if frames.silent_for > _SILENT_TOO_LONG else Level.WARN, complaint
    status = f'{frames.status.value}: {frames.reason}'
    if frames.silent_for > _SILENT_TOO_LONG and _unanswered(frames):
        silence = f'no odometry for {frames.silent_for:.0f} s: {status}'
        return Level.ERROR, joined(silence, concern)
    if frames.lost_for:
        sentence = joined(status, _remedy(frames), concern)
        if frames.lost_for > _LOST_TOO_LONG:
            return Level.ERROR, f'lost for {frames.lost_for:.0f} s: {sentence}'
        return Level.WARN, sentence
    concerns = joined(*_concerns(frames), concern)
    if concerns:
        return Level.WARN, concerns
    return (Level.WARN, status) if frames.status.is_lost else (Level.OK, frames.status.value)


def _remedy(frames: Snapshot) -> str:
    """Return what helps against a loss, '' where its reason says so itself."""
    if frames.reason.endswith(UNITS_OF_DEPTH):
        return ''
    return _REMEDIES_OF_REASONS.get(frames.reason) or _REMEDIES.get(frames.status, '')


def _unanswered(frames: Snapshot) -> bool:
    """Return whether frames in the window should have been answered and were not."""
    skipped = sum(frames.recent[count] for count in _SKIPPED)
    return frames.recent[Count.RECEIVED] - skipped > frames.recent[Count.ANSWERED]


def _concerns(frames: Snapshot) -> Iterator[str]:
    window = f'in the last {WINDOW:g} s'
    lost = frames.share(Count.LOST, Count.ANSWERED)
    if lost > _TOLERATED:
        yield f'{lost:.0%} of the frames {window} were lost'
    by_depth = frames.share(Count.BY_DEPTH_ALONE, Count.ANSWERED)
    if by_depth > _TOLERATED:
        yield (f'{by_depth:.0%} of the frames {window} were registered by depth alone: it is too '
               'dark, too bright or too blurred for keypoints, or the view is blank')
    by_colour = frames.share(Count.BY_COLOUR_ALONE, Count.ANSWERED)
    if by_colour > _TOLERATED:
        yield (f'{by_colour:.0%} of the frames {window} were registered by colour alone: their '
               'depth is missing, as too near, too far, in sunlight or behind glass')
    repeated = frames.share(Count.REPEATED, Count.ANSWERED)
    if repeated > _TOLERATED:
        yield (f'{repeated:.0%} of the frames {window} have an image that repeats: its driver '
               'sends it twice or hangs; or a simulated camera without noise stands still')
    damaged = frames.share(Count.DAMAGED, Count.RECEIVED)
    if damaged > _TOLERATED:
        yield f'{damaged:.0%} of the frames {window} could not be used, see the log'
    if frames.share(Count.DROPPED_UNDER_LOAD, Count.RECEIVED) > _TOLERATED:
        yield (f'{frames.rate(Count.ANSWERED):.3g} of {frames.rate(Count.RECEIVED):.3g} frames '
               'per second are answered: lower features.max_keypoints, or limit the rate evenly '
               'with max_update_rate')
