# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Statistics and table of a live run whose times and errors are given."""


import numpy as np
import pytest

from aick_ros.cli.output.demo_report import live_statistics, plot_path, table_rows
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.ros.playback.answers import Answer, LiveRun

LOST = np.diag(np.full(6, 9999.0))


@pytest.fixture
def run():
    """Return a run of six images, five of them answered after 10, 20 .. 50 ms, one as lost."""
    return LiveRun({i: float(i) for i in range(6)}, [
        Answer(i, np.eye(4), LOST if i == 2 else 1e-6 * np.eye(6), np.zeros(6),
               i + 0.01 * (i + 1)) for i in range(5)])


class Errors:
    """Errors whose root mean squares are 5 mm, 2 degrees and 7 mm."""

    def relative(self, interval):
        assert interval == 1.0
        return np.array([0.003, 0.004]) * np.sqrt(2), np.radians([2.0, -2.0])

    def positions(self):
        return np.array([0.007, -0.007])


def test_images_answers_and_delays_are_counted(run):
    statistics = live_statistics('office', run, None)
    assert statistics['source'] == 'office'
    assert [statistics[f'frames_{what}'] for what in ('played', 'answered', 'not_tracked')] == [
        6, 5, 1]
    assert statistics['rate_hz'] == pytest.approx(4 / 4.04)
    assert statistics['delay_ms'] == {'p50': pytest.approx(30), 'p99': pytest.approx(49.6)}
    assert set(statistics['trajectory'].values()) == {None}


def test_errors_are_root_mean_squares_in_metres_and_degrees(run):
    trajectory = live_statistics('office', run, Errors())['trajectory']
    assert trajectory == {'rpe_1s_translation_rmse_m': pytest.approx(0.005),
                          'rpe_1s_rotation_rmse_deg': pytest.approx(2.0),
                          'ate_rmse_m': pytest.approx(0.007)}


def test_rows_have_the_numbers_with_their_units(run):
    rows = dict(table_rows(live_statistics('office', run, Errors())))
    assert list(rows.values()) == ['6 / 5', '1', '0.99 Hz', '30.0 / 49.6 ms', '0.0050 m',
                                   '2.00 deg', '0.0070 m']
    assert rows['ATE'] == '0.0070 m'


def test_no_answers_have_dashes():
    rows = dict(table_rows(live_statistics('office', LiveRun({1: 0.0}), None)))
    assert list(rows.values()) == ['1 / 0', '0', '0.00 Hz', '- / -', '-', '-', '-']


@pytest.mark.parametrize('count, shown', [(10, [0, 3, 6, 9]), (4, [0, 1, 2, 3]), (2, [0, 1]),
                                          (1, [0])])
@pytest.mark.parametrize('truth', [None, 'truth'])
def test_images_from_the_first_to_the_last_are_above_the_path(tmp_path, monkeypatch, count, shown,
                                                              truth):
    path_plot, drawn = pytest.importorskip('aick_ros.reports.path_plot'), []
    monkeypatch.setattr(path_plot, 'plot_trajectory', lambda *parts: drawn.append(parts))

    class Recorded:

        def __len__(self):
            return count

        def frames(self, on_damaged):
            on_damaged('an image')
            for i in range(count):
                yield RgbdFrame(i + 1, np.full((60, 80), i, np.uint8),
                                np.ones((60, 80), np.float32), Camera(80, 60, 70, 70, 40, 30))

    path = tmp_path / 'path.png'
    assert plot_path(path, 'office', 'estimate', truth, Recorded()) == str(path)
    (where, estimate, true, title, views), = drawn
    assert (where, estimate, true) == (path, 'estimate', truth)
    assert [view.image[0, 0] for view in views] == shown
    assert title == 'odom_node on office: images, and the published path' + (
        ', aligned to the ground truth' if truth else '')
