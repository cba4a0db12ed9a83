# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Distances between edges that are drawn, against the motion between them."""

import numpy as np
import pytest

from aick_ros.frames.depth_cells import Grid
from aick_ros.frames.depth_edges import DepthEdges
from aick_ros.geometry import se3
from aick_ros.registration.edge_distances import edge_distances
from aick_ros.registration.refinement.residuals import NormalEquations

GRID = Grid(320, 240, 260.0, 260.0, 159.5, 119.5)


def outline(points, across):
    """Return edges at the cells that points project to."""
    cells = np.rint(points[:, :2] / points[:, 2:] * (GRID.fx, GRID.fy) + (GRID.cx, GRID.cy))
    return DepthEdges(GRID, cells.astype(np.int64), points, across)


def frame(near=1.5, shift=(0.0, 0.0, 0.0)):
    """Return the edges of a door frame, moved by a shift."""
    rows = np.arange(40, 200)
    sides = [np.column_stack([np.full(len(rows), column), rows]) for column in (100, 220)]
    columns = np.arange(101, 220)
    cells = np.vstack([*sides, np.column_stack([columns, np.full(len(columns), 40)])])
    across = np.repeat([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]],
                       [len(rows), len(rows), len(columns)], axis=0)
    rays = np.column_stack([(cells - (GRID.cx, GRID.cy)) / (GRID.fx, GRID.fy),
                            np.ones(len(cells))])
    return outline(near * rays + shift, across)


def test_the_steps_by_distances_lead_to_the_motion():
    """All but what the cells are rounded to; a frame shows no turn that looks as a shift."""
    motion = np.array([0.012, -0.01, 0.0, 0.0, 0.0, 0.01])
    truth = se3.exp(motion)
    source = frame()
    target = outline(se3.transform(truth, source.points),
                     source.across @ se3.exp_rotation(motion[3:])[:2, :2].T)
    pose, prior = np.eye(4), np.diag([1e-6, 1e-6, 1e6, 1e6, 1e6, 1e-6])
    for _ in range(10):
        equations = NormalEquations.of([edge_distances(source, target, pose)], prior)
        pose = se3.perturbed(pose, -np.linalg.solve(equations.information, equations.gradient))
    np.testing.assert_allclose(se3.difference(pose, truth), 0.0, atol=2e-3)


def test_the_jacobian_is_the_derivative_by_the_error_of_the_pose():
    source, target, pose = frame(), frame(), se3.exp(np.repeat([0.001, 2e-4], 3))
    found = edge_distances(source, target, pose)
    count = len(found.values)
    assert count > 200
    for axis, step in enumerate(1e-7 * np.eye(6)):
        moved = edge_distances(source, target, se3.perturbed(pose, step))
        np.testing.assert_allclose((moved.values - found.values) / 1e-7, found.jacobian[:, axis],
                                   atol=1e-3)


def test_large_distances_have_little_weight():
    source, target = frame(), frame()
    moved = source.points.copy()
    moved[::10, :2] += 4.0 * 1.5 / GRID.fx  # by four cells
    found = edge_distances(outline(moved, source.across), target, np.eye(4))
    assert np.median(found.weights) == 1.0
    assert found.weights.min() < 0.1


@pytest.mark.parametrize('shift', [(0.08, 0.0, 0.0), (0.0, 0.0, 0.4)])
def test_what_is_far_away_or_of_another_depth_is_another_edge(shift):
    assert len(edge_distances(frame(), frame(shift=shift), np.eye(4)).values) < 130


def test_an_edge_that_hides_the_other_side_is_another_one():
    other = frame()
    other = DepthEdges(GRID, other.cells, other.points, -other.across)
    assert len(edge_distances(frame(), other, np.eye(4)).values) == 0


def test_edges_that_are_not_seen_say_nothing():
    nothing = DepthEdges(GRID, np.empty((0, 2), np.int64), np.empty((0, 3)), np.empty((0, 2)))
    behind = se3.exp([0.0, 0.0, -3.0, 0.0, 0.0, 0.0])
    aside = se3.exp([9.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    for source, target, pose in ((frame(), nothing, np.eye(4)), (nothing, frame(), np.eye(4)),
                                 (frame(), frame(), behind), (frame(), frame(), aside)):
        found = edge_distances(source, target, pose)
        assert len(found.values) == 0 and found.jacobian.shape == (0, 6)


@pytest.mark.parametrize('wrong', [-1, 439, np.iinfo(np.int64).max])
def test_what_is_nearest_has_to_be_an_edge(wrong):
    edges = frame()
    edges.__dict__['nearest'] = np.full((GRID.height, GRID.width), wrong, np.int64)
    assert len(edges.cells) == 439
    assert len(edge_distances(frame(), edges, np.eye(4)).values) == 0


def test_poses_that_are_no_numbers_see_no_edge():
    assert len(edge_distances(frame(), frame(), np.full((4, 4), np.nan)).values) == 0
