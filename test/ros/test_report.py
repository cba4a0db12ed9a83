# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The report of the node's state: what is logged, each for itself, and what is published."""

from types import SimpleNamespace

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.logging import LoggingSeverity

from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.report import Report
from aick_ros.settings import NodeSettings


def test_what_is_missing_and_what_is_late_are_logged_both_and_published_as_one(
        graph, monkeypatch):
    """The log counts the time between two lines of one place: neither hides the other."""
    node = graph.node()
    diagnostics = Diagnostics(node)
    report = Report(
        node, NodeSettings(), diagnostics, SimpleNamespace(complaint='tf is late'),
        SimpleNamespace(backlog=2, backlog_bytes=3_000_000),
        SimpleNamespace(complaint='no IMU', concern='no guess', findings={'gyroscope': 'none'}),
        SimpleNamespace(dropped='nothing', sentence='less is computed'))
    published = graph.listen(DiagnosticArray, '/diagnostics')
    images = SimpleNamespace(complaint=lambda: 'no depth', counts={Count.DEPTH_MISSING: 4})
    differences = []
    monkeypatch.setattr(report, '_expectations', SimpleNamespace(
        complaint=lambda: 'somebody waits', report_differences=lambda: differences.append(1)))
    for _ in range(3):
        report.publish(images, dropped=5, paused=False)
    assert differences == [1, 1, 1]
    assert graph.log(node) == [(LoggingSeverity.WARN, 'no depth; somebody waits; no IMU'),
                               (LoggingSeverity.WARN, 'tf is late; no guess')]
    graph.wait_until(lambda: len(published) == 3, 'the reports')
    [status] = published[-1].status
    assert status.message == 'no depth; somebody waits; no IMU'
    values = {value.key: value.value for value in status.values}
    assert {key: values[key] for key in (
        'backlog', 'backlog in MB', 'gyroscope', 'dropped to shed load')} == {
            'backlog': '2', 'backlog in MB': '3.0', 'gyroscope': 'none',
            'dropped to shed load': 'nothing'}
    totals = diagnostics.snapshot().totals
    assert (totals[Count.DEPTH_MISSING], totals[Count.DROPPED_WHILE_WAITING]) == (4, 5)
