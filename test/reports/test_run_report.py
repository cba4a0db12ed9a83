# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The report: whole, on its own, and with what the run came to."""

import dataclasses
import re
from datetime import datetime
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.evaluation.scores.frame_record import trajectory_of
from aick_ros.evaluation.scores.run_summary import summarize
from aick_ros.evaluation.scores.trajectory_score import TrajectoryScore
from aick_ros.registration.status import Status
from aick_ros.reports import run_report
from aick_ros.reports.path_plot import path_figure
from aick_ros.reports.run_plots import timing_figure
from aick_ros.reports.run_report import report
from aick_ros.settings import Settings
from aick_ros.settings.parameter import values

STARTED = datetime(2026, 3, 4, 5, 6)
EMPTY_ELEMENTS = {'meta', 'br', 'link', 'img'}


class Page(HTMLParser):
    """Reads a page; fails where elements are not closed in order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.text, self.links, self.pictures = [], [], [], 0
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.pictures += tag == 'svg'
        self.links += [value for name, value in attributes
                       if name in ('src', 'href', 'xlink:href') and not value.startswith('#')]
        if tag not in EMPTY_ELEMENTS:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if 'style' not in self.open:
            self.text.append(data.strip())

    def __contains__(self, text):
        return text in ' '.join(self.text)


def test_has_the_figures_and_needs_nothing_else(summary, records, ground_truth):
    text = report(summary, records, ground_truth, STARTED)
    page = Page(text)
    assert page.links == []
    assert '<script' not in text
    assert '@import' not in text
    assert page.pictures == 4
    assert 'office <1>' in page
    assert '04 March 2026 at 05:06' in page
    assert f'{summary.path_length_m:.2f} m' in page
    assert f'{100 * summary.tracked / summary.frames:.4g} %' in page
    assert '2 images could not be used' in page
    assert 'not complete' not in page


@pytest.mark.usefixtures('undrawn')
def test_lists_lost_frames_and_changed_settings(summary, records, ground_truth):
    page = Page(report(summary, records, ground_truth, STARTED))
    assert '3 of 90: 3 x too few matches' in page
    assert '1.333333333 5 matches, odometry.min_matches is <12>' in page
    defaults = values(Settings())
    assert f'features.max_keypoints 350 {defaults["features.max_keypoints"]}' in page
    assert 'odometry.max_speed' not in page


@pytest.mark.usefixtures('undrawn')
def test_says_why_a_run_is_not_complete(summary, records):
    torn = dataclasses.replace(summary, ended='the bag ends in a torn message')
    page = Page(report(torn, records, None, STARTED))
    assert 'not complete: the bag ends in a torn message' in page
    assert page.pictures == 3


@pytest.mark.usefixtures('undrawn')
def test_every_stage_has_its_time(summary, records):
    timing = {'features': 4.0, 'refinement': 3.25, 'total': 7.25}
    records = [dataclasses.replace(record, timing=timing) for record in records]
    source = SimpleNamespace(name='office', ground_truth=None)
    timed = summarize(source, records, Settings(), wall_time=1.5)
    text = report(timed, records, None, STARTED)
    assert 'refinement 3.2 3.2' in Page(text)
    assert [text.get_text() for text in timing_figure(records).axes[0].get_legend().get_texts()
            ] == ['features', 'refinement']


def test_ids_in_the_pictures_lead_somewhere(summary, records, ground_truth):
    text = report(summary, records, ground_truth, STARTED)
    ids = set(re.findall(r'id="([^"]+)"', text))
    used = set(re.findall(r'(?:url\(|href=")#([^")]+)', text))
    assert used
    assert used <= ids


@pytest.mark.parametrize('count', [1, 2])
def test_a_run_may_be_short(summary, records, ground_truth, count):
    source = SimpleNamespace(name='office', ground_truth=ground_truth)
    short = summarize(source, records[:count], Settings(), wall_time=1.5)
    page = Page(report(short, records[:count], ground_truth, STARTED))
    assert page.pictures == (4 if count == 2 else 2)  # of one frame there is nothing over time
    assert ('Errors' in page) is ('Tracking' in page) is (count == 2)
    assert f'{"1 frame" if count == 1 else "2 frames"}, {(count - 1) / 30:.1f} s' in page
    assert '100 % frames tracked' in page
    assert ('0.00 cm ATE' in page) == (count == 2)  # one pose is aligned to any other


def test_times_of_the_stages_are_those_of_the_records(summary, records):
    """Median and 99th percentile, in the order of the head."""
    text = re.sub(r'<[^>]*>', ' ', ''.join(run_report._machine(summary)))
    assert text.index('median [ms]') < text.index('99th percentile [ms]')
    for stage in ('features', 'registration', 'total'):
        times = [record.timing[stage] for record in records]
        expected = rf'{stage}\s+{np.median(times):.1f}\s+{np.percentile(times, 99):.1f}\s'
        assert re.search(expected, text), text


def sections(text):
    """Return heading -> text below it, without elements."""
    parts = re.split(r'<h\d>(.*?)</h\d>', text.partition('<body>')[2])
    return {head: re.sub(r'<svg.*?</svg>|<[^>]*>', ' ', below, flags=re.DOTALL)
            for head, below in zip(parts[1::2], parts[2::2])}


@pytest.mark.usefixtures('undrawn')
def test_sections_are_in_order_with_or_without_truth_and_losses(summary, records, ground_truth):
    found = sections(report(summary, records, ground_truth, STARTED))
    assert list(found) == [
        'office &lt;1&gt;', 'Path of the camera', 'Errors', 'Tracking', 'Speed', 'Lost frames',
        'Settings that differ from the defaults', 'Machine']
    assert 'In the frame of the ground truth' in found['Path of the camera']
    tracked = dataclasses.replace(summary, settings=values(Settings()))
    found = sections(report(tracked, records[:40], None, STARTED))
    assert list(found) == ['office &lt;1&gt;', 'Path of the camera', 'Tracking', 'Speed',
                           'Settings that differ from the defaults', 'Machine']
    assert 'x forward, y to the left, z up' in found['Path of the camera']
    assert found['Settings that differ from the defaults'].split() == ['None.']


def test_a_tile_has_each_figure_in_the_unit_of_its_label(summary):
    text = ''.join(run_report._head(dataclasses.replace(
        summary, tracked=87, frames=90, path_length_m=12.345, end_distance_m=0.678,
        frames_per_second=59.6, trajectory=TrajectoryScore(0.0123, 1.234, 0.0456, 0.9)), STARTED))
    tiles = [(label, value) for value, label in re.findall(
        r'<b>(.*?)</b><span>(.*?)</span>', text)]
    assert tiles == [('frames tracked', '96.67 %'), ('path length', '12.35 m'),
                     ('start to end', '0.68 m'), ('frames per second', '60'), ('ATE', '4.56 cm'),
                     ('RPE over 1 s', '1.23 cm'), ('RPE over 1 s', '1.23°')]


@pytest.mark.parametrize('covered, is_said', [(None, False), (90, False), (6, True), (0, True)])
def test_frames_without_ground_truth_are_counted(summary, covered, is_said):
    text = ''.join(run_report._head(dataclasses.replace(
        summary, frames=90, trajectory=TrajectoryScore(0.1, 1.0, 0.1, 0.9, covered)), STARTED))
    assert (f'The ground truth covers {covered} of 90 frames: errors are of these alone.'
            in text) is is_said


@pytest.mark.usefixtures('undrawn')
def test_pictures_are_of_this_run(monkeypatch, summary, records, ground_truth):
    asked = {}
    for name in ('path_figure', 'error_figure', 'tracking_figure', 'timing_figure'):
        monkeypatch.setattr(run_report, name,
                            lambda *given, name=name: asked.update({name: given}))
    report(summary, records, ground_truth, STARTED)
    estimate, truth, lost = asked['path_figure']
    np.testing.assert_array_equal(estimate.poses, trajectory_of(records).poses)
    assert truth is ground_truth
    assert np.flatnonzero(lost).tolist() == [40, 41, 42]
    errors, start = asked['error_figure']
    assert start == records[0].stamp and errors.positions().max() < 1e-6
    assert asked['tracking_figure'] == asked['timing_figure'] == (records,)


@pytest.mark.usefixtures('undrawn')
def test_without_truth_the_camera_looks_along_x(monkeypatch, summary, records):
    """Forward is z of the camera, left is against its x, up against its y."""
    drawn = []
    monkeypatch.setattr(run_report, 'path_figure', lambda estimate, lost: (
        drawn.append((estimate, lost)), path_figure(estimate, lost=lost))[1])
    report(summary, records, None, STARTED)
    [(estimate, lost)] = drawn
    x, y, z = trajectory_of(records).poses[:, :3, 3].T
    np.testing.assert_allclose(estimate.poses[:, :3, 3], np.column_stack([z, -x, -y]))
    assert lost.sum() == 3


@pytest.mark.usefixtures('undrawn')
def test_a_level_path_is_drawn_as_it_is(monkeypatch, summary, level_records):
    """Its axes are those of the plot already, however the camera was held."""
    drawn = []
    monkeypatch.setattr(run_report, 'path_figure', lambda estimate, lost: (
        drawn.append(estimate), path_figure(estimate, lost=lost))[1])
    text = report(summary, level_records, None, STARTED)
    [estimate] = drawn
    np.testing.assert_array_equal(estimate.poses, trajectory_of(level_records).poses)
    assert 'In a level frame, by the accelerometer: x forward at the start' in text
    assert 'frame of the camera' not in text


@pytest.mark.parametrize('count, more', [(20, None), (21, '1 more are in frames.csv.')])
def test_of_many_lost_frames_the_first_are_listed(summary, records, count, more):
    lost = [dataclasses.replace(records[40], stamp=i * 10 ** 9) for i in range(count)]
    below = ''.join(run_report._losses(dataclasses.replace(
        summary, frames=99, status={'OK': 5, 'MOTION_GATE': 2, 'TOO_FEW_MATCHES': 7}), lost))
    assert re.findall(r'<tr><td>(\d+)', below) == [str(i) for i in range(20)]
    assert f'{count} of 99: 2 x {Status.MOTION_GATE.value}, 7 x too few matches. Their' in below
    assert '<th>stamp</th><th>reason</th>' in below
    assert (more in below) if more else 'more are' not in below
