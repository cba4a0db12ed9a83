# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The level and the sentence for what happened to the frames."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.frames.depth import shortage
from aick_ros.frames.repetition import Repeat
from aick_ros.registration.refinement.refined import CONTRADICTION
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.frame_statistics import Snapshot
from aick_ros.ros.health.levels import Level, judge
from aick_ros.settings.algorithm import SensorSettings


def test_tracked_frames_are_ok(frames):
    frames.answer(300)
    assert frames.judged() == (Level.OK, 'registered')


def test_less_than_everything_is_a_warning_after_what_the_frames_show(frames):
    frames.answer(30)
    assert frames.judged(concern='half is left out') == (Level.WARN, 'half is left out')
    frames.damage(30)
    level, sentence = frames.judged(concern='half is left out')
    assert level is Level.WARN
    assert sentence.endswith('could not be used, see the log; half is left out')


def test_before_the_first_frame_it_waits(frames):
    assert frames.judged() == (Level.WARN, 'no frame yet: waiting for images')


def test_a_missing_input_is_an_error_once_the_output_is_silent(frames):
    frames.answer(30)
    assert frames.judged('no camera_info') == (Level.WARN, 'no camera_info')
    frames.now += 6
    assert frames.judged('no camera_info') == (Level.ERROR, 'no camera_info')


def test_a_long_loss_is_an_error_with_a_remedy(frames):
    frames.answer(30)
    frames.answer(10, Status.TOO_FEW_KEYPOINTS, matches=0)
    level, sentence = frames.judged()
    assert level is Level.WARN
    assert sentence.startswith('too few keypoints with depth: 0 matches; is the lens covered')
    frames.answer(80, Status.TOO_FEW_KEYPOINTS, matches=0)
    level, sentence = frames.judged()
    assert level is Level.ERROR
    assert sentence.startswith('lost for 3 s: too few keypoints')


def test_one_damaged_frame_does_not_lower_the_level_of_a_loss(frames):
    frames.answer(30)
    frames.answer(900, Status.TOO_FEW_MATCHES)
    frames.damage(1)
    level, sentence = frames.judged()
    assert level is Level.ERROR
    assert sentence.startswith('lost for 30 s')


def test_where_every_frame_is_damaged_silence_becomes_an_error(frames):
    frames.answer(30)
    frames.damage(60)
    assert frames.judged()[0] is Level.WARN
    frames.damage(120)
    level, sentence = frames.judged()
    assert level is Level.ERROR
    assert sentence.startswith('no odometry for 6 s: ')
    assert 'wrong size' in sentence
    frames.answer(1)
    assert frames.judged()[0] is Level.WARN


def test_where_the_first_frames_are_damaged_silence_becomes_an_error(frames):
    frames.damage(180)
    assert frames.judged()[0] is Level.ERROR


@pytest.mark.parametrize('reason', [Count.SKIPPED_BY_RATE_LIMIT, Count.SKIPPED_WHILE_PAUSED,
                                    Count.DROPPED_BY_RESET, Count.SKIPPED_TO_SHED_LOAD])
def test_frames_skipped_on_request_are_no_silence(frames, reason):
    """As with a max_update_rate of one frame in 10 s, or right after a pause."""
    frames.answer(1)
    frames.skip(270, reason)
    assert frames.snapshot().silent_for > 5
    assert frames.judged() == (Level.OK, 'registered')


def test_a_loss_warns_until_it_leaves_the_window(frames):
    frames.answer(100, Status.TOO_FEW_MATCHES)
    frames.damaged('wrong size')
    frames.answer(200)
    assert frames.judged() == (Level.WARN, '33% of the frames in the last 10 s were lost')
    frames.answer(300)
    assert frames.judged()[0] is Level.OK


@pytest.mark.parametrize('lost, level', [(12, Level.OK), (18, Level.WARN)])
def test_five_percent_of_lost_frames_are_tolerated(frames, lost, level):
    """Of 300 frames, 4 % or 6 %."""
    frames.answer(lost, Status.TOO_FEW_MATCHES)
    frames.answer(300 - lost)
    assert frames.judged()[0] is level


@pytest.mark.parametrize('damaged, level', [(12, Level.OK), (18, Level.WARN)])
def test_five_percent_of_damaged_frames_are_tolerated(frames, damaged, level):
    frames.damage(damaged)
    frames.answer(300 - damaged)
    assert frames.judged()[0] is level


@pytest.mark.parametrize('dropped, level', [(12, Level.OK), (18, Level.WARN)])
def test_five_percent_of_dropped_frames_are_tolerated(frames, dropped, level):
    frames.answer(300)
    frames.count(Count.DROPPED_UNDER_LOAD, dropped)
    assert frames.judged()[0] is level


def test_damaged_and_dropped_frames_are_both_named(frames):
    frames.answer(150)
    frames.damage(50)
    frames.answer(100)
    frames.count(Count.DROPPED_UNDER_LOAD, 100)
    level, sentence = frames.judged()
    assert level is Level.WARN
    assert '17% of the frames in the last 10 s could not be used' in sentence
    assert '25 of 30 frames per second are answered: lower features.max_keypoints' in sentence


def test_an_internal_error_is_an_error(frames):
    frames.answer(30)
    frames.damaged('internal error, see the log', Count.FAILED)
    frames.answer(30)
    level, sentence = frames.judged()
    assert level is Level.ERROR
    assert 'report it' in sentence


def test_a_pause_is_named_before_all_else(frames):
    assert frames.judged('nobody publishes', paused=True) == (
        Level.WARN, 'paused: call ~/resume_odom to continue')


def test_frames_by_depth_alone_are_counted_and_explained(frames):
    frames.answer(280)
    frames.answer(10, evidence=Evidence.DEPTH_ALONE)
    assert frames.judged()[0] is Level.OK
    frames.answer(10, evidence=Evidence.DEPTH_ALONE)
    level, sentence = frames.judged()
    assert frames.snapshot().totals[Count.BY_DEPTH_ALONE] == 20
    assert level is Level.WARN
    assert sentence.startswith('7% of the frames in the last 10 s were registered by depth alone')


def test_images_that_repeat_are_counted_and_explained(frames):
    repeated = SimpleNamespace(keypoints=(), repeat=Repeat.BOTH)
    frames.answer(290)
    frames.answer(10, Status.REPEATED, frame=repeated)
    assert frames.snapshot().totals[Count.REPEATED] == 10
    assert frames.snapshot().totals[Count.LOST] == 0
    assert frames.judged()[0] is Level.OK  # now and then
    frames.answer(10, frame=SimpleNamespace(keypoints=(), repeat=Repeat.DEPTH))
    level, sentence = frames.judged()
    assert level is Level.WARN
    assert 'of the frames in the last 10 s have an image that repeats' in sentence


def test_rates_that_differ_are_different_numbers(frames):
    frames.answer(300)
    frames.count(Count.RECEIVED, 4)
    frames.count(Count.DROPPED_UNDER_LOAD, 18)
    assert '30 of 30.4 frames per second are answered' in frames.judged()[1]


def snapshot(status=Status.OK, lost_for=0.0, silent_for=0.1, reason='the reason', **recent):
    """Return 1000 frames of the last ten seconds, all answered, and other counts of them."""
    counts = Counter({Count.RECEIVED: 1000, Count.ANSWERED: 1000}
                     | {Count[name]: number for name, number in recent.items()})
    return Snapshot(counts, counts, 10.0, status, reason, lost_for, silent_for,
                    np.zeros(0), np.zeros(0), 0.0, {})


@pytest.mark.parametrize('lost_for, level', [(2.0, Level.WARN), (2.01, Level.ERROR)])
@pytest.mark.parametrize('status', [status for status in Status if status.is_lost])
def test_a_loss_is_an_error_after_two_seconds_with_the_remedy_of_its_status(
        lost_for, level, status):
    found, sentence = judge(snapshot(status, lost_for), '', False)
    assert found is level
    assert sentence.startswith('lost for 2 s: ') is (level is Level.ERROR)
    assert f'{status.value}: the reason' in sentence
    remedies = {Status.TOO_FEW_KEYPOINTS: 'the lens covered',
                Status.TOO_FEW_MATCHES: 'a higher frame rate',
                Status.MOTION_GATE: 'raise odometry.max_speed and odometry.max_turn_rate'}
    assert [each for each, words in remedies.items() if words in sentence] == (
        [status] if status in remedies else [])


@pytest.mark.parametrize('silent_for, level', [(5.0, Level.WARN), (5.01, Level.ERROR)])
def test_a_missing_input_is_an_error_after_five_seconds(silent_for, level):
    frames = snapshot(silent_for=silent_for)
    assert judge(frames, 'no camera_info', False) == (level, 'no camera_info')
    unanswered = snapshot(silent_for=silent_for, ANSWERED=999, SKIPPED_WHILE_PAUSED=0)
    assert (judge(unanswered, '', False)[0] is Level.ERROR) is (level is Level.ERROR)


@pytest.mark.parametrize('skipped, level', [(10, Level.OK), (9, Level.ERROR)])
@pytest.mark.parametrize('name', ['SKIPPED_WHILE_PAUSED', 'SKIPPED_BY_RATE_LIMIT',
                                  'DROPPED_BY_RESET', 'SKIPPED_TO_SHED_LOAD'])
def test_silence_is_an_error_unless_all_others_were_skipped(name, skipped, level):
    frames = snapshot(silent_for=6.0, ANSWERED=990, **{name: skipped})
    assert judge(frames, '', False)[0] is level


@pytest.mark.parametrize('name, total, words', [
    ('LOST', 'ANSWERED', 'were lost'), ('BY_DEPTH_ALONE', 'ANSWERED', 'by depth alone'),
    ('BY_COLOUR_ALONE', 'ANSWERED', 'by colour alone'),
    ('REPEATED', 'ANSWERED', 'image that repeats'), ('DAMAGED', 'RECEIVED', 'could not be used'),
    ('DROPPED_UNDER_LOAD', 'RECEIVED', 'frames per second are answered')])
def test_a_twentieth_is_tolerated_and_more_is_not(name, total, words):
    """Of those that it is a share of: the other count is ten times as large."""
    others = {'ANSWERED': 10_000, 'RECEIVED': 10_000, total: 1000}
    assert judge(snapshot(**others, **{name: 50}), '', False) == (Level.OK, 'registered')
    level, sentence = judge(snapshot(**others, **{name: 51}), '', False)
    assert level is Level.WARN
    assert words in sentence
    assert name == 'DROPPED_UNDER_LOAD' or sentence.startswith('5% of the frames in the last 10 s')


def test_internal_errors_are_counted_in_the_sentence():
    level, sentence = judge(snapshot(FAILED=7), 'no camera_info', False)
    assert level is Level.ERROR
    assert sentence.startswith('7 frames failed by a defect of this node')


def test_a_reason_that_says_what_helps_gets_no_other_remedy():
    """Of depth in a wrong unit, the lens is not covered."""
    far = np.full((48, 64), 1500.0, np.float32)
    reason = f'0 keypoints with depth, at least 12 are required: {shortage(far, SensorSettings())}'
    _, sentence = judge(snapshot(Status.TOO_FEW_KEYPOINTS, 9.0, reason=reason), '', False)
    assert sentence.endswith('images of 32FC1 must be in metres, of 16UC1 in millimetres')
    reason = f'0 keypoints with depth: {shortage(np.full_like(far, np.nan), SensorSettings())}'
    _, sentence = judge(snapshot(Status.TOO_FEW_KEYPOINTS, 9.0, reason=reason), '', False)
    assert sentence.endswith('has depth; is the lens covered, the room dark, the wall blank, or '
                             'everything beyond sensor.max_depth?')


def test_frames_whose_depths_contradict_each_other_have_a_remedy_of_their_own():
    _, sentence = judge(snapshot(Status.TOO_FEW_MATCHES, 9.0, reason=CONTRADICTION), '', False)
    assert 'synchronize the two images' in sentence
    assert 'frame rate' not in sentence


def test_a_loss_hides_no_other_trouble():
    level, sentence = judge(snapshot(Status.TOO_FEW_KEYPOINTS, 1.0), '', False, '/tf is late')
    assert level is Level.WARN
    assert sentence.endswith('sensor.max_depth?; /tf is late')


def test_the_remedy_of_a_loss_ends_where_no_frame_is_answered_any_more():
    """They are dropped, as transforms are late: the lens may be free again."""
    frames = snapshot(Status.TOO_FEW_KEYPOINTS, lost_for=40.0, silent_for=30.0, ANSWERED=0)
    level, sentence = judge(frames, '', False, '/tf is late')
    assert level is Level.ERROR
    assert sentence == ('no odometry for 30 s: too few keypoints with depth: the reason; '
                        '/tf is late')
