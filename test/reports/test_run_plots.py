# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is drawn of a run, read from the lines, bars and shades of the figures."""

import dataclasses

import numpy as np
import pytest

from aick_ros.evaluation.scores.frame_record import trajectory_of
from aick_ros.evaluation.scores.trajectory_errors import TrajectoryErrors, compare
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.stage_times import STAGES
from aick_ros.registration.status import Status

pytest.importorskip('matplotlib')
from matplotlib.colors import to_hex  # noqa: E402

from aick_ros.reports import canvas  # noqa: E402
from aick_ros.reports.run_plots import error_figure, timing_figure, tracking_figure  # noqa: E402


def with_status(records, lost):
    return [dataclasses.replace(record, status=Status.BAD_FRAME if i in lost else Status.OK)
            for i, record in enumerate(records)]


def shades(figure):
    """Return the intervals that are shaded [s]."""
    axes, = figure.axes
    return [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches]


def test_errors_are_in_centimetres_and_degrees_since_the_start(records):
    estimate = trajectory_of(records)
    sides = (-1.0) ** np.arange(len(estimate))
    moved = np.array([pose @ se3.exp([0, 0, 0, 0, 0, np.radians(2.0) * side])
                      for pose, side in zip(estimate.poses, sides)])
    moved[:, 2, 3] += 0.03 * sides
    errors = TrajectoryErrors(estimate, Trajectory(estimate.stamps, moved), np.eye(4))
    upper, lower = error_figure(errors, -NANOSECONDS).axes
    times, positions = upper.lines[0].get_data()
    np.testing.assert_allclose(times, 1.0 + np.arange(90) / 30, atol=1e-6)
    np.testing.assert_allclose(positions, 3.0)
    np.testing.assert_allclose(lower.lines[0].get_ydata(), 2.0, atol=1e-2)
    assert '[cm]' in upper.get_ylabel() and '[deg]' in lower.get_ylabel()


def test_keypoints_and_matches_are_lines_over_time(records):
    axes, = tracking_figure(records[10:]).axes
    lines = {line.get_label(): line.get_data() for line in axes.lines}
    for name, values in (('keypoints with depth', [record.keypoints for record in records[10:]]),
                         ('matches', [record.matches for record in records[10:]])):
        times, drawn = lines[name]
        np.testing.assert_allclose(times, np.arange(80) / 30, atol=1e-6)
        assert list(drawn) == values


@pytest.mark.parametrize('lost, intervals', [
    ([], []), ([40, 41, 42], [(40, 43)]), ([0, 5, 6], [(0, 1), (5, 7)]),
    ([87, 88, 89], [(87, 89)]), ([89], [(89, 89)])])
def test_lost_frames_are_shaded_up_to_the_frame_after_them(records, lost, intervals):
    found = shades(tracking_figure(with_status(records, lost)))
    np.testing.assert_allclose(np.array(found).reshape(-1, 2),
                               np.array(intervals).reshape(-1, 2) / 30, atol=1e-6)


def test_lost_is_in_the_legend_once(records):
    axes, = tracking_figure(with_status(records, [3, 7, 9])).axes
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    assert sorted(texts) == ['keypoints with depth', 'lost', 'matches']


def test_the_time_of_each_stage_is_the_share_of_frames_that_take_at_most_it(records):
    """One that is far beyond the axis counts, too; the total is no stage."""
    records = [*records[:-1], dataclasses.replace(
        records[-1], timing={'features': 900.0, 'registration': 5.0, 'total': 905.0})]
    axes, = timing_figure(records).axes
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == [line.get_label() for line in axes.lines] == ['features', 'registration']
    for line in axes.lines:
        times, shares = line.get_data()
        values = np.array([record.timing[line.get_label()] for record in records])
        assert (times[0], times[-1]) == (values.min(), values.max())
        below = [100 * np.mean(values <= time) for time in times]
        np.testing.assert_array_less(shares - 1e-9, np.add(below, 100 / len(values)))
    assert axes.lines[0].get_xdata()[-1] == 900.0
    assert axes.get_xlim()[1] < 900.0 and axes.get_ylim() == (0.0, 100.0)


def test_the_legend_of_the_times_is_beside_the_title(records):
    records = [dataclasses.replace(record, timing={**dict.fromkeys(STAGES, 12.0), 'total': 48.0})
               for record in records]
    figure = timing_figure(records)
    canvas.to_svg(figure)
    axes, = figure.axes
    assert axes._left_title.get_window_extent().x1 < axes.get_legend().get_window_extent().x0


def test_texts_and_colours_say_what_is_drawn(records, ground_truth):
    errors = compare(trajectory_of(records), ground_truth)
    upper, lower = error_figure(errors, 0).axes
    tracking, = tracking_figure(records).axes
    timing, = timing_figure(records).axes
    assert [(axes.get_title(loc='left'), axes.get_ylabel(), axes.get_xlabel())
            for axes in (upper, lower, tracking, timing)] == [
        ('Position error', 'error [cm]', ''), ('Rotation error', 'error [deg]', 'time [s]'),
        ('Keypoints and matches', 'number', 'time [s]'),
        ('Time per frame', 'frames [%]', 'time [ms]')]
    assert [axes.get_ylim()[0] for axes in (upper, lower, tracking, timing)] == [0.0] * 4
    assert [axes.lines[0].get_color() for axes in (upper, lower)] == [
        canvas.ESTIMATE, canvas.SECOND]
    assert [line.get_color() for line in tracking.lines] == [canvas.MUTED, canvas.ESTIMATE]
    assert to_hex(tracking.patches[0].get_facecolor()) == canvas.LOST
    assert [line.get_color() for line in timing.lines] == list(canvas.SERIES[:2])


@pytest.mark.parametrize('most, is_rasterised', [(90, False), (89, True)])
def test_lines_of_many_points_are_rasterised(monkeypatch, records, ground_truth, most,
                                             is_rasterised):
    monkeypatch.setattr(canvas, 'MANY', most)
    figures = (error_figure(compare(trajectory_of(records), ground_truth), 0),
               tracking_figure(records))
    lines = [line for figure in figures for axes in figure.axes for line in axes.lines]
    assert len(lines) == 4
    assert {bool(line.get_rasterized()) for line in lines} == {is_rasterised}


def test_the_axis_of_times_ends_after_nearly_all_of_them(records):
    times = np.r_[np.linspace(1.0, 10.0, 999), 500.0]
    timed = [dataclasses.replace(records[0], timing={'features': time, 'total': 0.0})
             for time in times]
    axes, = timing_figure(timed).axes
    assert axes.get_xlim() == (0.0, pytest.approx(1.05 * np.percentile(times, 99.5)))
    assert len(axes.lines[0].get_xdata()) == 401, 'however many frames there are'
