# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which histograms of the NEES are written, and of what."""

import re
from types import SimpleNamespace

import cv2
import pytest

from aick_ros.cli.output.consistency_plots import write_plots
from aick_ros.errors import InputError
from aick_ros.reports import canvas

NEES = {'odometry': [3.0, 5.0, 8.0], '1': [6.0], '5': [], '20': [1.0, 2.0]}


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """Return a function that draws and returns name of the file -> title and label."""
    def draw(nees):
        figures = {}
        write = canvas.write_png

        def keep(figure, path):
            axes = figure.axes[0]
            figures[path.name] = axes.get_title(loc='left'), axes.get_xlabel()
            write(figure, path)
        monkeypatch.setattr(canvas, 'write_png', keep)
        write_plots(tmp_path, SimpleNamespace(source='office', nees=nees))
        return figures
    return draw


def test_each_kind_of_pairs_has_a_file_and_its_values(drawn, tmp_path, capfd):
    figures = drawn(NEES)
    assert {name: title for name, (title, _) in figures.items()} == {
        'nees_odometry.png': 'office: odometry',
        'nees_gap_1.png': 'office: pairs of consecutive frames',
        'nees_gap_20.png': 'office: pairs of frames 20 apart'}
    counts = {name: re.search(r'\d+ \w+(?=, mean)', label)[0]
              for name, (_, label) in figures.items()}
    assert counts == {'nees_odometry.png': '3 increments', 'nees_gap_1.png': '1 pairs',
                      'nees_gap_20.png': '2 pairs'}
    assert all(cv2.imread(str(tmp_path / name)).std() > 5 for name in figures)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(figures)
    assert capfd.readouterr().err == ''


def test_without_errors_to_compare_with_nothing_is_written(drawn, tmp_path, capfd):
    assert drawn({'odometry': [], '1': []}) == {}
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr().err == (
        'aick: no plots: office has no covariance with an error to compare it with\n')


def test_what_cannot_be_written_is_named(drawn, tmp_path):
    (tmp_path / 'nees_gap_1.png').mkdir()
    with pytest.raises(InputError, match=f'^cannot write {tmp_path}/nees_gap_1.png: Is a dir'):
        drawn(NEES)
