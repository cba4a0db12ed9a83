# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Furnished rooms: closed, lit, with the furniture at the walls and the middle free."""

import numpy as np
import pytest

from aick_ros.sources.synthetic.assembly import Assembly
from aick_ros.sources.synthetic.room import furnished_room
from aick_ros.sources.synthetic.surfaces import Disc, Rectangle, Round

SEEDS = (0, 1)


@pytest.fixture(scope='module', params=SEEDS)
def scene(request, room):
    return room(request.param)


def test_the_space_is_that_of_a_living_room(scene):
    size = scene.interior.high - scene.interior.low
    assert ((4.5, 3.9, 2.5) <= size).all() and (size <= (5.1, 4.5, 2.7)).all()
    np.testing.assert_allclose(scene.interior.centre[:2], 0, atol=1e-12)
    assert scene.interior.low[2] == 0.0
    assert (scene.free.low >= scene.interior.low + 0.9).all()
    assert (scene.free.high <= scene.interior.high - 0.9).all()
    np.testing.assert_allclose(scene.free.high[:2], size[:2] / 2 - 0.95 - 0.35)
    np.testing.assert_allclose(scene.free.low[:2], -scene.free.high[:2])


def test_all_that_stands_there_is_inside_and_keeps_off_where_the_camera_is(scene):
    for block in scene.blocks:
        middle = block.T_world_block[:3, 3]
        assert scene.interior.depth(middle[None])[0] > 0
    low, high = scene.free.low, scene.free.high
    points = np.random.default_rng(0).uniform(low, high, (2000, 3))
    assert scene.clearance(points).min() > 0.3


def test_each_wall_has_its_furniture(scene):
    """By the size that no other piece has: a sofa, a door, a window, a desk."""
    widths = {(round(s.width, 2), round(s.height, 2)): s for s in scene.surfaces[::-1]
              if isinstance(s, Rectangle)}
    places = {}
    for name, size in {'sofa': (1.9, 0.28), 'door': (0.85, 2.0), 'window': (1.4, 1.2),
                       'desk': (1.4, 0.04)}.items():
        places[name] = widths[size].T_world_surface[:3, 2]  # into the wall
    assert sorted(tuple(place[:2].round().astype(int)) for place in places.values()) == [
        (-1, 0), (0, -1), (0, 1), (1, 0)]


def test_walls_meet_and_what_hangs_on_them_is_in_front(scene):
    size = scene.interior.high - scene.interior.low
    shell = scene.surfaces[:6]
    inward = np.array([surface.points(*np.zeros((2, 1)))[1][0] for surface in shell])
    np.testing.assert_allclose(np.abs(inward).sum(axis=0), 2, atol=1e-9)
    for surface, normal in zip(shell, inward):
        middle = surface.hull.mean(axis=0) - scene.interior.centre
        np.testing.assert_allclose(middle @ normal, -(size @ np.abs(normal)) / 2)
    doors = [s for s in scene.surfaces if round(s.width, 2) == 0.85 and round(s.height, 1) == 2.0]
    assert len(doors) == 1
    depth = scene.interior.depth(doors[0].hull[:, :] + (0, 0, 0.5))
    assert 0.005 < depth.max() < 0.05


def test_the_light_is_neither_dark_nor_glaring(scene):
    floor = next(s for s in scene.surfaces if s.points(*np.zeros((2, 1)))[1][0, 2] > 0.9)
    assert 15 < np.median(floor.image) < 200
    means = np.array([surface.image.mean() for surface in scene.surfaces])
    assert 30 < np.median(means) < 150
    saturated = np.mean([(surface.image == 255).mean() for surface in scene.surfaces])
    assert saturated < 0.03
    # somewhere on the floor there is shade, and light
    shares = floor.image.astype(float).mean(axis=2)
    cells = shares[:shares.shape[0] // 40 * 40, :shares.shape[1] // 40 * 40]
    cells = cells.reshape(cells.shape[0] // 40, 40, -1, 40).mean(axis=(1, 3))
    assert cells.max() > 2.0 * cells.min()


def test_rooms_of_other_seeds_are_furnished_otherwise(room):
    one, other = (room(seed) for seed in SEEDS)
    assert not np.allclose(one.interior.high, other.interior.high)
    assert len(one.surfaces) != len(other.surfaces)


def test_large_pieces_stand_beside_each_other(scene):
    """The middle of none is inside another one."""
    large = [block for block in scene.blocks if block.size.max() > 0.6]
    middles = np.array([block.T_world_block[:3, 3] for block in large])
    for number, block in enumerate(large):
        others = np.delete(middles, number, axis=0)
        assert block.distance(others).min() > -0.03


@pytest.fixture
def unlit(monkeypatch):
    """Return the function that builds a room without pictures and light, and gives its lamps."""
    def plain(self, shape, rotation, corner, width, height, material, where):
        add(self, shape, rotation, corner, width, height, grey, where)

    def grey(rng, width, height):
        return np.full((1, 1, 3), 100, np.uint8)

    add = Assembly._add
    monkeypatch.setattr(Assembly, '_add', plain)
    found = []
    monkeypatch.setattr('aick_ros.sources.synthetic.scene.illuminate',
                        lambda surfaces, blocks, lamps, clearance: found.append(lamps) or surfaces)

    def built(seed):
        return furnished_room(seed), found[-1]
    return built


@pytest.mark.parametrize('seed', [0, 1, 2])
def test_light_comes_from_where_something_glows(unlit, seed):
    """From the ceiling, from the window into the room, and from the lamp beside the sofa."""
    scene, lamps = unlit(seed)
    assert len(lamps) == 3
    middles = {(round(s.width, 2), round(s.height, 2)): s.hull.mean(axis=0)
               for s in scene.surfaces if isinstance(s, Rectangle)}
    [ceiling] = [lamp for lamp in lamps if len(lamp.points) == 6 and lamp.direction[2] == -1]
    np.testing.assert_allclose(ceiling.points.mean(axis=0)[:2], 0, atol=1e-12)
    assert (scene.interior.high[2] - ceiling.points[:, 2] == pytest.approx(0.05))
    assert np.ptp(ceiling.points, axis=0) == pytest.approx((0.6, 0.4, 0))
    [window] = [lamp for lamp in lamps if len(lamp.points) == 6 and lamp is not ceiling]
    inwards = -middles[1.4, 1.2][:2] / np.linalg.norm(middles[1.4, 1.2][:2])
    np.testing.assert_allclose(window.direction, [*inwards, 0], atol=1e-9)
    offset = window.points.mean(axis=0) - middles[1.4, 1.2]
    np.testing.assert_allclose(offset, [*(0.24 * inwards), 0], atol=1e-9)
    assert np.sort(np.ptp(window.points, axis=0)) == pytest.approx([0, 0.6, 0.9])
    [bulb] = [lamp for lamp in lamps if len(lamp.points) == 1]
    shades = [s for s in scene.surfaces if isinstance(s, Round) and s.height == 0.3
              and s.width == pytest.approx(2 * np.pi * 0.22)]
    np.testing.assert_allclose(bulb.points[0, :2], shades[0].T_world_surface[:2, 3])
    assert shades[0].T_world_surface[2, 3] - bulb.points[0, 2] == pytest.approx(0.03)
    assert bulb.direction.tolist() == [0, 0, -1]
    assert all((scene.interior.depth(lamp.points) > 0).all() for lamp in lamps)
    # red is strongest but at the window
    assert [(np.diff(lamp.power) < 0).all() for lamp in (ceiling, bulb)] == [True, True]
    assert (np.diff(window.power) > 0).all()


@pytest.mark.parametrize('seed', [0, 1, 2])
def test_what_is_on_a_wall_or_the_floor_is_at_its_height(unlit, seed):
    scene, _ = unlit(seed)
    flat = [s for s in scene.surfaces if isinstance(s, Rectangle)]
    width, depth, _ = scene.interior.high - scene.interior.low
    skirtings = [s for s in flat if s.height == pytest.approx(0.09)]
    assert sorted(s.width for s in skirtings) == pytest.approx(sorted([width, width,
                                                                       depth, depth]))
    for skirting in skirtings:
        assert skirting.hull[:, 2] == pytest.approx([0.09, 0.09, 0, 0])
        assert scene.interior.depth(skirting.hull.mean(axis=0)[None]) == pytest.approx(0.012)
    [carpet] = [s for s in flat if np.allclose(s.hull[:, 2], 0.004)]
    assert 1.9 <= carpet.width <= 2.3 and 1.3 <= carpet.height <= 1.6
    np.testing.assert_allclose(carpet.hull.mean(axis=0), (0, 0, 0.004), atol=1e-12)
    # the table and a stool stand there: the one in the middle, the other beside it
    [table] = [b for b in scene.blocks if b.size.tolist() == [1.0, 0.6, 0.04]]
    [stool] = [b for b in scene.blocks if b.size == pytest.approx([0.4, 0.4, 0.42])]
    # along the carpet, which is turned a little
    places = [block.T_world_block[:3, 3] @ carpet.T_world_surface[:3, :2]
              for block in (table, stool)]
    assert np.abs(places[0]).max() <= 0.2
    assert abs(places[1][0]) == pytest.approx(0.8) and abs(places[1][1]) <= 0.3
    [clock] = [s for s in scene.surfaces if type(s) is Disc and s.width == 0.3]
    assert clock.hull[:, 2].min() == pytest.approx(1.6)
    assert scene.interior.depth(clock.hull + (0, 0, -0.5)) == pytest.approx([0.02] * 4)
