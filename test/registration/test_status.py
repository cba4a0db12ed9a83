# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which outcomes measured a pose, and which have lost it."""

from aick_ros.registration.status import Status


def test_a_pose_is_measured_held_or_lost():
    measured = {Status.OK, Status.FIRST_FRAME}
    assert {status for status in Status if status.ok} == measured
    assert {status for status in Status if status.is_lost} == \
        set(Status) - measured - {Status.REPEATED}


def test_no_two_are_described_alike():
    """Two names with one value would be one status."""
    assert len(Status.__members__) == len({status.value for status in Status})


def test_each_is_described_for_people():
    assert {status.name: status.value for status in Status} == {
        'NO_FRAME': 'no frame yet', 'OK': 'registered',
        'FIRST_FRAME': 'first frame, nothing to register it to',
        'TOO_FEW_KEYPOINTS': 'too few keypoints with depth', 'TOO_FEW_MATCHES': 'too few matches',
        'DEGENERATE_GEOMETRY': 'matches lie on a line or in a point',
        'MOTION_GATE': 'motion faster than the gate allows',
        'REPEATED': 'images are those of the frame before',
        'BAD_STAMP': 'stamp repeats or goes back', 'BAD_FRAME': 'frame cannot be used'}
