# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Content of the plot of a trajectory."""

import cv2
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.text import Text

from aick_ros.evaluation.scores.frame_record import trajectory_of
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.reports import canvas
from aick_ros.reports.path_plot import View, path_figure, plot_trajectory


def drawn(figure):
    """Return for each view the points of each line by its label."""
    return [{line.get_label(): np.column_stack(line.get_data()) for line in axes.lines}
            for axes in figure.axes]


def test_estimate_is_laid_over_the_ground_truth(records, ground_truth):
    figure = path_figure(trajectory_of(records), ground_truth)
    positions = ground_truth.poses[:, :3, 3]
    for view, axes in zip(drawn(figure), [(0, 1), (0, 2)]):
        np.testing.assert_allclose(view['estimate'], positions[:, axes], atol=1e-9)
        np.testing.assert_allclose(view['start'], positions[:1, axes], atol=1e-9)
        np.testing.assert_allclose(view['end'], positions[-1:, axes], atol=1e-9)
        np.testing.assert_allclose(view['ground truth'], positions[:-1, axes], atol=1e-9)


def test_without_ground_truth_it_is_drawn_as_it_is(records):
    estimate = trajectory_of(records)
    lost = np.arange(90) > 86
    view = drawn(path_figure(estimate, lost=lost))[1]
    np.testing.assert_array_equal(view['estimate'], estimate.poses[:, [0, 2], 3])
    np.testing.assert_array_equal(view['lost, pose held'], estimate.poses[lost][:, [0, 2], 3])
    assert 'ground truth' not in view


def test_metres_are_as_long_in_both_directions(records):
    figure = path_figure(trajectory_of(records))
    figure.canvas.draw()
    for axes in figure.axes:
        origin, right, up = axes.transData.transform([(0, 0), (1, 0), (0, 1)])
        assert right[0] - origin[0] == pytest.approx(up[1] - origin[1])


def test_labels_are_inside_though_numbers_beside_them_become_longer(monkeypatch):
    """With equal scales y reaches from .5 to .75, in steps of .05 that need more digits."""
    starts, draw = [], Text.draw

    def spy(text, renderer):
        draw(text, renderer)
        if text.get_text() == 'y [m]':
            starts.append(text.get_window_extent(renderer).x0)

    monkeypatch.setattr(Text, 'draw', spy)
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :3, 3] = (1.103, 0.617, 1.352), (1.343, 0.627, 1.658)
    canvas.to_svg(path_figure(Trajectory(np.arange(2), poses)))
    assert starts[-1] > 0


def test_writes_a_picture(records, ground_truth, tmp_path):
    file = tmp_path / 'path.png'
    plot_trajectory(file, trajectory_of(records), ground_truth, 'office')
    image = cv2.imread(str(file))
    assert image.shape[1] > 1000
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 50


@pytest.mark.parametrize('count', [1, 2])
@pytest.mark.parametrize('truth', ['none', 'present', 'later'])
def test_a_path_may_be_short(records, ground_truth, count, truth):
    """One or two poses are drawn, with their ground truth only where it covers them."""
    estimate = trajectory_of(records[:count])
    later = Trajectory(ground_truth.stamps + NANOSECONDS * 60, ground_truth.poses)
    known = {'none': None, 'present': ground_truth, 'later': later}[truth]
    positions = (ground_truth if truth == 'present' else estimate).poses[:count, :3, 3]
    for view, axes in zip(drawn(path_figure(estimate, known)), [(0, 1), (0, 2)]):
        np.testing.assert_allclose(view['estimate'], positions[:, axes], atol=1e-9)
        np.testing.assert_allclose(view['start'], positions[:1, axes], atol=1e-9)
        np.testing.assert_allclose(view['end'], positions[-1:, axes], atol=1e-9)
        assert ('ground truth' in view) == (truth == 'present')


def test_dollar_signs_in_names_are_drawn_as_they_are(records, ground_truth, tmp_path):
    content = canvas.figure(2, 2, lambda figure: figure.suptitle(r'a $\frac$ b'))
    canvas.write_png(content, tmp_path / 'plot.png')
    assert 'frac' in canvas.to_svg(content)


def test_titles_axes_and_legend_name_what_is_drawn(records, ground_truth):
    lost = np.arange(90) > 86
    figure = path_figure(trajectory_of(records), ground_truth, lost, title='office')
    above, side = figure.axes
    assert [(axes.get_title(loc='left'), axes.get_xlabel(), axes.get_ylabel())
            for axes in (above, side)] == [('From above', 'x [m]', 'y [m]'),
                                           ('From the side', 'x [m]', 'z [m]')]
    assert figure.get_suptitle() == 'office'
    [legend] = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        'ground truth', 'estimate', 'lost, pose held', 'start', 'end']
    colours = {line.get_label(): line.get_color() for line in above.lines}
    assert (colours['ground truth'], colours['estimate'], colours['lost, pose held']) == (
        canvas.TRUTH, canvas.ESTIMATE, canvas.LOST)


def test_images_are_beside_each_other_with_their_keypoints(records):
    views = [View(np.full((4, 6, 3), 40 * i, np.uint8), np.array([[i, 2.0], [3.0, 1.0]]))
             for i in range(3)]
    figure = path_figure(trajectory_of(records), views=views)
    shown = [axes for axes in figure.findobj(Axes) if axes.images]
    assert [axes.images[0].get_array()[0, 0, 0] for axes in shown] == [0, 40, 80]
    for i, axes in enumerate(shown):
        np.testing.assert_array_equal(axes.lines[0].get_data(), [[i, 3.0], [2.0, 1.0]])
        assert axes.lines[0].get_linestyle() == 'None' and not axes.axison


@pytest.mark.parametrize('title, views, height', [('', 0, 4.5), ('a', 0, 4.8), ('', 1, 6.5),
                                                  ('a', 1, 6.8)])
def test_a_figure_is_as_high_as_its_parts(records, title, views, height):
    image = View(np.zeros((4, 6), np.uint8), np.zeros((0, 2)))
    figure = path_figure(trajectory_of(records), title=title, views=views * [image])
    np.testing.assert_allclose(figure.get_size_inches(), (10.0, height))
