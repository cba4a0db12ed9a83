# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Figures of a run that can be computed by hand."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.evaluation.scores import run_summary
from aick_ros.evaluation.scores.frame_record import FrameRecord, stages_of, trajectory_of
from aick_ros.evaluation.scores.machine import machine_facts
from aick_ros.evaluation.scores.run_summary import summarize
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import values, with_values


def record(index, position, status=Status.OK, matches=100):
    pose = np.eye(4)
    pose[:3, 3] = position
    return FrameRecord(
        stamp=index * NANOSECONDS // 10, status=status, reason='',
        pose=PoseWithCovariance(pose), keypoints=300 + index, matches=matches,
        increment=Increment(PoseWithCovariance.identity(), 0.1) if status is Status.OK else None,
        timing={'features': 4.0 + index, 'registration': 2.0, 'total': 6.0 + index})


@pytest.fixture
def records():
    """Return a walk around a square of 1 m, twelve frames a side, two of them lost."""
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0)]
    positions = [np.array(a) + share * (np.array(b) - np.array(a))
                 for a, b in zip(corners, corners[1:]) for share in np.arange(12) / 12]
    states = [Status.FIRST_FRAME] + 59 * [Status.OK]
    states[20] = states[21] = Status.TOO_FEW_MATCHES
    return [record(i, position, status, matches=100 if status is Status.OK else 7)
            for i, (position, status) in enumerate(zip(positions, states))]


def test_figures(records):
    source = SimpleNamespace(name='a square', ground_truth=None)
    summary = summarize(source, records, Settings(), wall_time=0.5, damaged_images=3)
    count = len(records)
    assert (summary.frames, summary.tracked, summary.damaged_images) == (count, count - 2, 3)
    assert summary.status == {'FIRST_FRAME': 1, 'OK': count - 3, 'TOO_FEW_MATCHES': 2}
    assert summary.duration_s == pytest.approx((count - 1) / 10)
    assert summary.frames_per_second == pytest.approx(2 * count)
    assert summary.path_length_m == pytest.approx(4 - 1 / 12)
    assert summary.end_distance_m == pytest.approx(1 / 12)
    assert summary.keypoints_mean == pytest.approx(300 + (count - 1) / 2)
    assert summary.matches_mean == 100
    assert summary.timing_ms['features'].p50 == pytest.approx(4 + (count - 1) / 2)
    assert summary.trajectory.tracked_fraction == pytest.approx((count - 2) / count)
    assert summary.trajectory.ate_rmse_m is None
    assert json.loads(json.dumps(summary.to_json(), allow_nan=False))['frames'] == count


def test_stages_are_those_of_the_frames(records):
    timed = [{'total': 4.0, 'features': 4.0}, {'features': 4.0, 'refinement': 3.0, 'total': 7.0},
             {'features': 4.0, 'refinement': 5.0, 'total': 9.0}]
    records = [FrameRecord(**{**vars(r), 'timing': timing}) for r, timing in zip(records, timed)]
    assert stages_of(records) == ['features', 'refinement', 'total']
    summary = summarize(SimpleNamespace(name='', ground_truth=None), records, Settings(), 1.0)
    assert {name: times.p50 for name, times in summary.timing_ms.items()} == {
        'features': 4.0, 'refinement': 4.0, 'total': 7.0}


def test_held_poses_count_in_the_errors(records):
    truth = trajectory_of(records)
    poses = truth.poses.copy()
    poses[20:22, 2, 3] += 0.5
    held = [FrameRecord(**{**vars(r), 'pose': PoseWithCovariance(pose)})
            for r, pose in zip(records, poses)]
    source = SimpleNamespace(name='', ground_truth=densely(truth))
    right = summarize(source, records, Settings(), 1.0).trajectory
    off = summarize(source, held, Settings(), 1.0).trajectory
    assert right.ate_rmse_m < 1e-9
    assert off.ate_rmse_m == pytest.approx(0.5 * (2 / len(held)) ** 0.5, rel=0.1)


def densely(trajectory):
    """Return the path with poses 0.02 s apart, as ground truth has them."""
    stamps = np.arange(trajectory.stamps[0], trajectory.stamps[-1] + 1, NANOSECONDS // 50)
    return Trajectory(stamps, np.array([trajectory.at(int(stamp)) for stamp in stamps]))


def test_a_summary_says_of_what_how_and_where(records, monkeypatch):
    monkeypatch.setattr(run_summary, 'peak_memory_mb', lambda: 123.5)
    settings = with_values(Settings(), {'aick.iterations': 7})
    source = SimpleNamespace(name='a square', ground_truth=None)
    content = summarize(source, records, settings, 2.0).to_json()
    assert (content['source'], content['ended'], content['damaged_images']) == (
        'a square', 'complete', 0)
    assert (content['wall_time_s'], content['peak_memory_mb']) == (2.0, 123.5)
    assert content['settings'] == values(settings)
    assert content['machine'] == machine_facts()
    assert summarize(source, records, settings, 2.0, 'it broke').ended == 'it broke'


def test_a_stage_that_was_not_timed_in_a_frame_does_not_count_there(records):
    records = [FrameRecord(**{**vars(record), 'timing': {'total': 1.0} if i else {
        'features': 4.0, 'total': 9.0}}) for i, record in enumerate(records)]
    times = run_summary.stage_times(records)
    assert list(times) == ['features', 'total']
    assert (times['features'].p50, times['features'].p99, times['total'].p50) == (4.0, 4.0, 1.0)
