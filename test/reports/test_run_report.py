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

from aick_ros.evaluation.scores.run_summary import summarize
from aick_ros.reports import run_report
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


def test_lists_lost_frames_and_changed_settings(summary, records, ground_truth):
    page = Page(report(summary, records, ground_truth, STARTED))
    assert '3 of 90: 3 x too few matches' in page
    assert '1.333333333 5 matches, odometry.min_matches is <12>' in page
    defaults = values(Settings())
    assert f'features.max_keypoints 350 {defaults["features.max_keypoints"]}' in page
    assert 'odometry.max_speed' not in page


def test_says_why_a_run_is_not_complete(summary, records):
    torn = dataclasses.replace(summary, ended='the bag ends in a torn message')
    page = Page(report(torn, records, None, STARTED))
    assert 'not complete: the bag ends in a torn message' in page
    assert page.pictures == 3


def test_every_stage_has_its_time(summary, records):
    timing = {'features': 4.0, 'refinement': 3.25, 'total': 7.25}
    records = [dataclasses.replace(record, timing=timing) for record in records]
    source = SimpleNamespace(name='office', ground_truth=None)
    timed = summarize(source, records, Settings(), wall_time=1.5)
    text = report(timed, records, None, STARTED)
    assert 'refinement 3.2 3.2' in Page(text)
    assert [text.get_text() for text in timing_figure(records).axes[0].get_legend().get_texts()
            ] == ['features, median 4.0 ms', 'refinement, median 3.2 ms']


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
    assert page.pictures == 4
    assert f'{count} frames, {(count - 1) / 30:.1f} s' in page
    assert '100 % frames tracked' in page
    assert '0.0 cm ATE' in page


def test_times_of_the_stages_are_those_of_the_records(summary, records):
    """Median and 99th percentile, in the order of the head."""
    text = re.sub(r'<[^>]*>', ' ', ''.join(run_report._machine(summary)))
    assert text.index('median [ms]') < text.index('99th percentile [ms]')
    for stage in ('features', 'registration', 'total'):
        times = [record.timing[stage] for record in records]
        expected = rf'{stage}\s+{np.median(times):.1f}\s+{np.percentile(times, 99):.1f}\s'
        assert re.search(expected, text), text
