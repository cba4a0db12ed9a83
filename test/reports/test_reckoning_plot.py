# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is drawn of points: where they are, and which of two hides the other."""

import cv2
import numpy as np
import pytest

from aick_ros.evaluation.benchmark.dead_reckoning import EndPoint, Reckoning
from aick_ros.reports import canvas, reckoning_plot
from aick_ros.reports.reckoning_plot import splat, write_reckoning

RED, GREEN, BLUE = np.eye(3, dtype=np.uint8) * 200


def test_points_are_where_their_coordinates_say():
    points = np.array([[0.0, 0.0, 0.0], [0.305, 0.0, 0.105]])
    picture, extent = splat(points, np.array([RED, GREEN]), 0, 2, -1.0)
    assert picture.shape == (11, 31, 3)
    assert extent == pytest.approx((0.0, 0.31, 0.0, 0.11))
    assert (picture[-1, 0] == RED).all()  # the lower left
    assert (picture[0, -1] == GREEN).all()
    assert (picture != 255).any(axis=2).sum() == 2


@pytest.mark.parametrize(('side', 'seen'), [(-1.0, BLUE), (1.0, RED)])
def test_the_nearer_hides_the_farther(side, seen):
    points = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    picture, _ = splat(points, np.array([RED, BLUE]), 0, 2, side)
    assert (picture == seen).all()


def test_it_is_a_picture(tmp_path):
    rng = np.random.default_rng(1)
    line = np.linspace([0, 0, 0], [3, 0, 0], 20)
    write_reckoning(Reckoning(EndPoint(20, 3.0, 0.1, 1.0, 0), line, line,
                              rng.uniform(0, 1, (500, 3)),
                              rng.integers(0, 255, (500, 3), np.uint8)), tmp_path / 'f.png')
    assert min(cv2.imread(str(tmp_path / 'f.png')).shape[:2]) > 1000


def test_each_panel_has_its_axes_its_points_and_both_paths(monkeypatch, tmp_path):
    """Points of a box of 3 by 2 by 1 m; who looks from above sees the upper ones."""
    kept = []
    monkeypatch.setattr(reckoning_plot.canvas, 'write_png',
                        lambda figure, path: kept.append(figure))
    rng = np.random.default_rng(1)
    points = rng.uniform(0, (3.0, 2.0, 1.0), (4000, 3))
    walked = np.linspace([0.1, 0.5, 0.2], [2.9, 0.7, 0.3], 20)
    true = walked + (0.0, 0.1, 0.2)
    colours = np.rint(200 * points / (3, 2, 1)).astype(np.uint8)
    write_reckoning(Reckoning(EndPoint(20, 2.8, 0.123, 4.56, 0), walked, true, points, colours),
                    tmp_path / 'f.png')
    figure, = kept
    assert figure.get_suptitle() == ('20 frames, 2.8 m by dead reckoning: error at the end 0.12 m '
                                     'and 4.6 deg')
    assert [axes.get_title(loc='left') for axes in figure.axes] == [
        'From above', 'From the front', 'Along the shelves']
    [legend] = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ['true path', 'dead reckoning']
    assert [line.get_color() for line in figure.axes[0].lines] == [canvas.TRUTH, canvas.ESTIMATE]
    for axes, (i, j) in zip(figure.axes, ((0, 1), (0, 2), (1, 2))):
        assert (axes.get_xlabel(), axes.get_ylabel()) == (f'{"xyz"[i]} [m]', f'{"xyz"[j]} [m]')
        lines = {line.get_label(): line.get_data() for line in axes.lines}
        np.testing.assert_allclose(lines['true path'], true[:, [i, j]].T)
        np.testing.assert_allclose(lines['dead reckoning'], walked[:, [i, j]].T)
        image, = axes.images
        left, right, bottom, top = image.get_extent()
        np.testing.assert_allclose((left, right, bottom, top), (
            0, (3, 2, 1)[i], 0, (3, 2, 1)[j]), atol=0.03)
        picture = np.asarray(image.get_array())
        seen = (picture != 255).any(axis=2)
        row, column = np.nonzero(seen)
        # its colours grow to the right and up, from the lower left
        shown = picture[row, column].astype(float)
        assert np.corrcoef(column, shown[:, i])[0, 1] > 0.95
        assert np.corrcoef(-row, shown[:, j])[0, 1] > 0.95


@pytest.mark.parametrize('panel, seen', [(0, (0.0, 0.0, 1.0)), (1, (0.0, -1.0, 0.0)),
                                         (2, (-1.0, 0.0, 0.0))])
def test_the_viewer_is_above_in_front_and_before_the_shelves(monkeypatch, tmp_path, panel, seen):
    """Two points in a line with the viewer: the one that is seen is nearer to him."""
    kept = []
    monkeypatch.setattr(reckoning_plot.canvas, 'write_png',
                        lambda figure, path: kept.append(figure))
    points, path = np.array([seen, -np.array(seen)]), np.zeros((2, 3))
    write_reckoning(Reckoning(EndPoint(2, 1.0, 0.1, 1.0, 0), path, path, points,
                              np.array([RED, BLUE])), tmp_path / 'f.png')
    assert (np.asarray(kept[0].axes[panel].images[0].get_array()) == RED).all()
