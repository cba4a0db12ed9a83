# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A run over a made-up path, with and without losses."""

from dataclasses import replace
from functools import cached_property
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.evaluation.scores.frame_record import FrameRecord, trajectory_of
from aick_ros.evaluation.scores.run_summary import summarize
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry.inertial.level import level_orientation
from aick_ros.registration.status import Status
from aick_ros.reports import canvas
from aick_ros.settings.presets import preset

T_WORLD_ODOM = se3.exp([0.5, 2.0, -1.0, 0.4, 1.0, -0.3])


def rows_of(path):
    """Return (entity, component) -> time [s], None for ever, and value of each row of a file."""
    from rerun.chunk import RrdReader
    found = []
    for chunk in RrdReader(str(path)).stream().to_chunks():
        columns = {field.name: (field.type, column) for field, column in zip(
            chunk.to_record_batch().schema, chunk.to_record_batch().columns)}
        order = columns['rerun.controls.RowId'][1].to_pylist()
        [times] = [column.cast('int64').to_pylist() for kind, column in columns.values()
                   if str(kind) == 'duration[ns]'] or [[None] * len(order)]
        entity = str(chunk.entity_path).lstrip('/').replace('\\', '')
        found += [(row, (entity, name.partition(':')[2]),
                   None if time is None else time / NANOSECONDS, value)
                  for name, (_, column) in columns.items() if ':' in name
                  for row, time, value in zip(order, times, column.to_pylist())
                  if value is not None]
    rows = {}
    for _, key, time, value in sorted(found, key=lambda each: each[0]):
        rows.setdefault(key, []).append((time, value))
    return rows


@pytest.fixture
def undrawn(monkeypatch):
    """Let pictures of pages be empty: to draw them takes most of the time of a page."""
    monkeypatch.setattr(canvas, 'to_svg', lambda figure: '<svg></svg>')


@pytest.fixture
def stream(tmp_path):
    """Return a stream of Rerun to a file, which is read with its ``rows`` once it has all."""
    import rerun

    class Stream(rerun.RecordingStream):
        @cached_property
        def _rows(self):
            self.disconnect()
            return rows_of(tmp_path / 'view.rrd')

        @property
        def entities(self):
            return {entity for entity, _ in self._rows if not entity.startswith('__')}

        def rows(self, entity, component):
            """Return times [s], None for ever, and the values of a component, a list each."""
            return self._rows.get((entity, component), [])

        def values(self, entity, component):
            """Return times [s], None for ever, and the first value of each list."""
            return [(time, values[0]) for time, values in self.rows(entity, component)]

    made = Stream('test')
    made.save(tmp_path / 'view.rrd')
    return made


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
def level_records(records):
    """Return the same run in a level frame, after two frames that were lost before the start."""
    level = np.eye(4)
    level[:3, :3] = level_orientation(np.array([0.1, -0.9, -0.4]) / np.sqrt(0.98))
    bad = [replace(records[0], stamp=stamp, status=Status.BAD_FRAME) for stamp in (-2, -1)]
    return bad + [replace(record, pose=PoseWithCovariance(
        level @ record.pose.matrix, record.pose.covariance)) for record in records]


@pytest.fixture
def ground_truth(records):
    """Return the same path in another frame."""
    estimate = trajectory_of(records)
    return Trajectory(estimate.stamps, T_WORLD_ODOM @ estimate.poses)


@pytest.fixture
def summary(records, ground_truth):
    source = SimpleNamespace(name='office <1>', ground_truth=ground_truth)
    return summarize(source, records, preset('paper-fast'), wall_time=1.5, damaged_images=2)
