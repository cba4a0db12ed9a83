# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Edges of depth images that are drawn."""

import numpy as np
import pytest

from aick_ros.frames.depth_edges import DepthEdges
from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings

CAMERA = Camera(160, 120, 130.0, 130.0, 79.5, 59.5)
SENSOR = SensorSettings()


def image(far=2.0):
    return np.full((CAMERA.height, CAMERA.width), far, np.float32)


def box(depth, near=1.0):
    """Draw a box of 40 x 30 pixels, that is 20 x 15 cells from column 30 and row 20 on."""
    depth[40:70, 60:100] = near
    return depth


def test_an_edge_is_the_last_cells_of_what_is_near():
    edges = DepthEdges.of(box(image()), CAMERA, SENSOR)
    border = {(column, row) for column in range(30, 50) for row in range(20, 35)
              if column in (30, 49) or row in (20, 34)}
    assert set(map(tuple, edges.cells)) == border
    np.testing.assert_allclose(edges.points[:, 2], 1.0, rtol=1e-6)
    # the middle of a cell is between its two pixels
    pixels = 2 * edges.cells + 0.5
    np.testing.assert_allclose(CAMERA.project(edges.points), pixels, atol=1e-4)


def test_its_direction_is_to_the_near_side():
    edges = DepthEdges.of(box(image()), CAMERA, SENSOR)
    for column, direction in ((30, 1.0), (49, -1.0)):
        is_side = (edges.cells[:, 0] == column) & (abs(edges.cells[:, 1] - 27) < 3)
        np.testing.assert_allclose(edges.across[is_side], [[direction, 0.0]] * is_side.sum(),
                                   atol=0.05)


@pytest.mark.parametrize('gap, is_edge', [(0, True), (6, True), (14, False)])
def test_a_shadow_beside_it_may_be_some_cells_wide(gap, is_edge):
    depth = box(image())
    depth[:, 60 - gap:60] = np.nan
    cells = DepthEdges.of(depth, CAMERA, SENSOR).cells
    assert (30 in cells[:, 0][abs(cells[:, 1] - 27) < 4]) is is_edge


@pytest.mark.parametrize('step, is_edge', [(0.04, False), (0.2, True)])
def test_a_small_step_is_none(step, is_edge):
    assert bool(len(DepthEdges.of(box(image(), 2.0 - step), CAMERA, SENSOR).cells)) is is_edge


def test_slopes_holes_and_noise_are_none():
    depth = image() * np.linspace(0.5, 1.5, CAMERA.width, dtype=np.float32)
    depth[30:60, 20:50] = np.nan
    depth[90, ::20] = 0.5  # single pixels
    noise = np.random.default_rng(0).normal(size=depth.shape)
    depth = (depth * (1 + SENSOR.depth_sigma * depth * noise)).astype(np.float32)
    assert len(DepthEdges.of(depth, CAMERA, SENSOR).cells) == 0


def test_nothing_is_known_beyond_the_image():
    depth = image()
    depth[:, :80] = 1.0  # its upper and lower end are those of the image
    cells = DepthEdges.of(depth, CAMERA, SENSOR).cells
    assert set(cells[:, 0]) == {39} and cells[:, 1].min() == 2 and cells[:, 1].max() == 57


def test_of_each_cell_the_nearest_point_is_known():
    edges = DepthEdges.of(box(image()), CAMERA, SENSOR)
    for column, row in ((0, 27), (79, 27), (40, 0), (40, 59), (31, 27), (30, 20)):
        distances = np.linalg.norm(edges.cells - (column, row), axis=1)
        assert distances[edges.nearest[row, column]] <= distances.min() + 0.3


def test_without_edges_there_are_no_points():
    for depth in (image(), image(np.nan)):
        edges = DepthEdges.of(depth, CAMERA, SENSOR)
        assert edges.cells.shape == edges.across.shape == (0, 2) and len(edges.chosen) == 0
