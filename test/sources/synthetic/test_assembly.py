# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Boxes, panels and round things: which way they face, how large, where."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.sources.synthetic.assembly import Assembly, Block
from aick_ros.sources.synthetic.surfaces import Disc

OUTWARD = {'front': (0, -1, 0), 'back': (0, 1, 0), 'left': (-1, 0, 0), 'right': (1, 0, 0),
           'top': (0, 0, 1), 'bottom': (0, 0, -1)}
SIZE = np.array([0.4, 0.6, 1.0])


@pytest.fixture
def assembly():
    return Assembly(np.random.default_rng(0))


def paint(number):
    def make(rng, width, height):
        make.sizes.append((width, height))
        return np.full((2, 2, 3), number, np.uint8)
    make.sizes = []
    return make


def facts(surface):
    """Return the centre, the normal, and the directions to the right and down."""
    s, t = np.array([0.0, surface.width, 0.0]), np.array([0.0, 0.0, surface.height])
    points, normals = surface.points(s, t)
    return surface.hull.mean(axis=0), normals[0], points[1] - points[0], points[2] - points[0]


def assert_faces(surface, centre, outward, area, upright=True):
    middle, normal, right, down = facts(surface)
    np.testing.assert_allclose(middle, centre, atol=1e-12)
    np.testing.assert_allclose(normal, outward, atol=1e-12)
    # to the right and down for who looks at it: against the normal
    np.testing.assert_allclose(np.cross(right, down), -area * np.asarray(outward), atol=1e-12)
    if upright:
        assert down[2] < 0 and right[2] == pytest.approx(0, abs=1e-12)


def test_a_box_stands_on_the_floor_and_is_seen_from_outside(assembly):
    every = {face: paint(i) for i, face in enumerate(OUTWARD)}
    assembly.box(SIZE, paint(9), every)
    surfaces = {list(OUTWARD)[s.image[0, 0, 0]]: s for s in assembly.surfaces}
    assert surfaces.keys() == OUTWARD.keys()
    for face, surface in surfaces.items():
        outward = np.array(OUTWARD[face])
        area = np.prod(SIZE[outward == 0])
        assert_faces(surface, (0, 0, 0.5) + outward * SIZE / 2, outward, area,
                     outward[2] == 0)
        assert every[face].sizes == [(surface.width, surface.height)]
    for face in ('top', 'bottom'):  # as who stands before it and bends over it, or under it
        assert facts(surfaces[face])[2][0] > 0
    assert facts(surfaces['top'])[3][1] < 0 < facts(surfaces['bottom'])[3][1]


@pytest.mark.parametrize('faces, open_faces, expected', [
    (None, (), {'front', 'left', 'right', 'top'}),
    (None, ('top',), {'front', 'left', 'right'}),
    (('back',), (), {'front', 'left', 'right', 'top', 'back'}),
    (('bottom', 'front'), ('left',), {'front', 'right', 'top', 'bottom'})])
def test_back_and_bottom_exist_where_they_are_named(assembly, faces, open_faces, expected):
    own = None if faces is None else dict.fromkeys(faces, paint(7))
    assembly.box(SIZE, paint(1), own, open_faces)
    found = {next(name for name, outward in OUTWARD.items()
                  if np.allclose(facts(s)[1], outward)): s.image[0, 0, 0]
             for s in assembly.surfaces}
    assert found.keys() == expected
    assert {name for name, colour in found.items() if colour == 7} == set(faces or ())
    [block] = assembly.blocks
    np.testing.assert_array_equal(block.size, SIZE)
    np.testing.assert_allclose(block.T_world_block[:3, 3], (0, 0, 0.5))


def test_a_place_is_given_by_steps_turns_and_tilts(assembly):
    turned = assembly.at(1.0, 2.0, 3.0, np.pi / 2)
    np.testing.assert_allclose(turned.to_world(np.array([[1.0, 0.0, 0.5]])), [[1, 3, 3.5]])
    np.testing.assert_allclose(turned.at(x=2.0).to_world(np.zeros((1, 3))), [[1, 4, 3]])
    np.testing.assert_allclose(assembly.to_world(np.ones((1, 3))), [[1, 1, 1]])
    # backwards: the upper end goes away, as y does
    tilted = assembly.at(z=1.0).tilted(0.3)
    np.testing.assert_allclose(tilted.to_world(np.array([[0.0, 0.0, 1.0]])),
                               [[0, np.sin(0.3), 1 + np.cos(0.3)]])
    turned.box(SIZE, paint(1))
    assert len(assembly.surfaces) == 4
    np.testing.assert_allclose(assembly.blocks[0].T_world_block,
                               se3.exp([0, 0, 0, 0, 0, np.pi / 2]) + np.array(
                                   [[0, 0, 0, 1], [0, 0, 0, 2], [0, 0, 0, 3.5], [0, 0, 0, 0]]),
                               atol=1e-12)


def test_a_room_is_seen_from_inside_and_has_no_gap(assembly):
    walls = [paint(i) for i in range(4)]
    assembly.room(SIZE, walls, paint(4), paint(5))
    inward = [(0, -1, 0), (-1, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1), (0, 0, -1)]
    for surface, expected in zip(sorted(assembly.surfaces, key=lambda s: s.image[0, 0, 0]),
                                 inward, strict=True):
        expected = np.array(expected)
        area = np.prod(SIZE[expected == 0] + 0.02)
        assert_faces(surface, (0, 0, 0.5) - expected * SIZE / 2, expected, area,
                     expected[2] == 0)
    assert assembly.blocks == []


def test_panels_stand_sheets_lie_and_lamps_hang(assembly):
    assembly.panel(0.4, 0.6, paint(0))
    assembly.panel(0.4, 0.6, paint(1), glows=True)
    assembly.sheet(0.4, 0.6, paint(2))
    assembly.lamp(0.4, 0.6, paint(3))
    panel, sheet = assembly.surfaces
    glowing, lamp = assembly.glowing
    for surface, image in ((panel, 0), (glowing, 1)):
        assert_faces(surface, (0, 0, 0.3), (0, -1, 0), 0.24)
        assert (surface.width, surface.height, surface.image[0, 0, 0]) == (0.4, 0.6, image)
    assert_faces(sheet, (0, 0, 0), (0, 0, 1), 0.24, upright=False)
    assert_faces(lamp, (0, 0, 0), (0, 0, -1), 0.24, upright=False)
    assert (sheet.width, sheet.height) == (lamp.width, lamp.height) == (0.4, 0.6)
    assert assembly.blocks == []


@pytest.mark.parametrize('top', [None, paint(8)])
def test_a_cone_has_its_radii_and_its_lid(assembly, top):
    clay = paint(1)
    assembly.at(1.0, 2.0, 3.0).cone(0.2, 0.5, 0.6, clay, top)
    cone, *lids = assembly.surfaces
    s = np.linspace(0, cone.width, 7)
    for t, radius, z in ((0.0, 0.5, 3.6), (0.3, 0.35, 3.3), (0.6, 0.2, 3.0)):
        points, normals = cone.points(s, np.full(7, t))
        np.testing.assert_allclose(np.linalg.norm(points[:, :2] - (1, 2), axis=1), radius)
        np.testing.assert_allclose(points[:, 2], z)
        assert (np.einsum('ni,ni->n', normals[:, :2], points[:, :2] - (1, 2)) > 0).all()
    assert clay.sizes == [(pytest.approx(2 * np.pi * 0.5), pytest.approx(0.6))]
    [block] = assembly.blocks
    np.testing.assert_allclose(block.size, (1.0, 1.0, 0.6))
    np.testing.assert_allclose(block.T_world_block[:3, 3], (1, 2, 3.3))
    assert len(lids) == (top is not None)
    for lid in lids:
        assert type(lid) is Disc
        assert_faces(lid, (1, 2, 3.6), (0, 0, 1), 1.0, upright=False)
        assert lid.image[0, 0, 0] == 8


def test_a_ball_lies_on_the_floor(assembly):
    assembly.at(1.0, 2.0, 3.0).ball(0.25, paint(1))
    [ball], [block] = assembly.surfaces, assembly.blocks
    rng = np.random.default_rng(1)
    points, normals = ball.points(rng.uniform(0, ball.width, 50), rng.uniform(0, 0.5, 50))
    np.testing.assert_allclose(np.linalg.norm(points - (1, 2, 3.25), axis=1), 0.25)
    np.testing.assert_allclose(normals, (points - (1, 2, 3.25)) / 0.25, atol=1e-9)
    np.testing.assert_allclose(block.size, 0.5)
    np.testing.assert_allclose(block.T_world_block[:3, 3], (1, 2, 3.25))


@pytest.mark.parametrize('point, distance', [
    ((0.3, 0, 0), 0.1), ((0, -0.5, 0), 0.2), ((0, 0, 0.8), 0.3), ((0.5, 0.7, 0), 0.5),
    ((0.5, 0.7, 1.7), 1.3), ((0, 0, 0), -0.2), ((0.15, 0, 0), -0.05), ((0, 0, 0.4), -0.1)])
def test_the_distance_of_a_block(point, distance):
    """Size 0.4, 0.6, 1.0: beyond one side, an edge, a corner; inside."""
    T_world_block = se3.exp([3, 1, 2, 0.3, -0.8, 0.5])
    points = se3.transform(T_world_block, np.array([point, point], float))
    np.testing.assert_allclose(Block(T_world_block, SIZE).distance(points), 2 * [distance])


def test_what_is_turned_leans_backwards_along_its_own_y(assembly):
    """Tilted after a turn: the upper end goes where the turned object's back is."""
    tilted = assembly.at(1.0, 0.0, 0.0, np.pi / 2).tilted(0.3)
    np.testing.assert_allclose(tilted.to_world(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])),
                               [[1 - np.sin(0.3), 0, np.cos(0.3)], [1, 1, 0]], atol=1e-12)
