# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A run over a made-up path, with and without losses."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.evaluation.scores.frame_record import FrameRecord, trajectory_of
from aick_ros.evaluation.scores.run_summary import summarize
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.status import Status
from aick_ros.settings.presets import preset

T_WORLD_ODOM = se3.exp([0.5, 2.0, -1.0, 0.4, 1.0, -0.3])


class Stream:
    """Keeps the values that are logged, by entity, with their times [s]."""

    def __init__(self):
        self.logged = {}
        self._time = None

    def send_blueprint(self, blueprint):
        pass

    def set_time(self, timeline, duration):
        self._time = duration

    def log(self, entity, *parts, static=False):
        name = entity if isinstance(entity, str) else '/'.join(entity)
        self.logged.setdefault(name, []).append((None if static else self._time, *parts))

    def values(self, entity, field):
        """Return the times and the values of a field."""
        return [(time, getattr(part, field).as_arrow_array().to_pylist()[0])
                for time, part in self.logged.get(entity, []) if hasattr(part, field)]


@pytest.fixture
def stream():
    return Stream()


@pytest.fixture
def records():
    """Return the records of 90 frames around a bend, three of them lost."""
    records = []
    for i in range(90):
        lost = 40 <= i < 43
        pose = se3.exp([i / 50, (i / 60) ** 2, i / 200, 0.002 * i, 0.01 * i, 0])
        records.append(FrameRecord(
            stamp=i * NANOSECONDS // 30,
            status=Status.TOO_FEW_MATCHES if lost else Status.OK,
            reason='5 matches, odometry.min_matches is <12>' if lost else '',
            pose=PoseWithCovariance(pose, 1e-4 * np.eye(6)), keypoints=350,
            matches=0 if lost else 200 + i, increment=None if lost else Increment(
                PoseWithCovariance(np.eye(4), 1e-6 * np.eye(6)), 1 / 30),
            timing={'features': 4.0, 'registration': 2.0 + i % 7, 'total': 6.0 + i % 7}))
    return records


@pytest.fixture
def ground_truth(records):
    """Return the same path in another frame."""
    estimate = trajectory_of(records)
    return Trajectory(estimate.stamps, T_WORLD_ODOM @ estimate.poses)


@pytest.fixture
def summary(records, ground_truth):
    source = SimpleNamespace(name='office <1>', ground_truth=ground_truth)
    return summarize(source, records, preset('paper-fast'), wall_time=1.5, damaged_images=2)
