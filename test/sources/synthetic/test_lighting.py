# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Light on a floor and behind a box, against the law of a small lamp."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.sources.synthetic.assembly import Block
from aick_ros.sources.synthetic.lighting import Lamp, illuminate
from aick_ros.sources.synthetic.surfaces import Rectangle

SIDE, CELLS = 1.4, 20  # m; a cell of the light for each texel
AROUND = np.array([0.54, 0.53, 0.52])
DOWN = np.array([0.0, 0.0, -1.0])


@pytest.fixture
def floor():
    """Return a floor with its centre at the origin, seen from above."""
    T_world_floor = np.array([[1.0, 0, 0, -SIDE / 2], [0, -1, 0, SIDE / 2], [0, 0, -1, 0],
                              [0, 0, 0, 1]])
    return Rectangle(T_world_floor, SIDE, SIDE, np.full((CELLS, CELLS, 3), 100, np.uint8))


def places():
    """Return the middles of the texels on the floor, rows x columns x 3."""
    ticks = (np.arange(CELLS) + 0.5) / CELLS * SIDE - SIDE / 2
    x, y = np.meshgrid(ticks, -ticks)
    return np.stack([x, y, np.full_like(x, 0.01)], axis=-1)


def light(floor, lamps, blocks=(), clearance=1.0):
    def room(points):
        assert np.allclose(points[:, 2], 0.15, atol=1e-6)
        return np.full(len(points), clearance)
    [lit] = illuminate([floor], blocks, lamps, room)
    assert lit.image.max() < 255
    return lit.image.astype(float) / 100


def law(source, power, direction=DOWN):
    """Return the light of a small lamp on the floor."""
    ray = source - places()
    length = np.linalg.norm(ray, axis=-1)
    received = ray[..., 2] / length
    sent = np.maximum(-(ray @ direction) / length, 0)
    light = np.where(received > 0, received * sent, 0) / np.maximum(length ** 2, 0.25)
    return light[..., None] * np.asarray(power)


@pytest.mark.parametrize('source, direction', [
    ((0.2, -0.1, 1.0), DOWN), ((-0.5, 0.3, 0.4), DOWN),
    ((0.3, 0.2, 0.8), np.array([-0.6, 0.0, -0.8]))])
def test_light_falls_off_with_the_distance_and_both_angles(floor, source, direction):
    """Nearer than half a metre it does not rise any more."""
    lamp = Lamp(np.array([source]), direction, np.array([0.4, 0.45, 0.2]))
    expected = AROUND + law(np.array(source), lamp.power, direction)
    np.testing.assert_allclose(light(floor, [lamp]), expected, atol=0.011)


def test_a_lamp_shares_its_power_among_its_points_and_lamps_add_up(floor):
    sources = np.array([[0.5, 0.0, 1.0], [-0.5, 0.3, 1.2], [0.0, -0.5, 0.9]])
    lamps = [Lamp(sources[:2], DOWN, np.ones(3)), Lamp(sources[2:], DOWN, np.full(3, 0.6))]
    expected = AROUND + law(sources[0], np.full(3, 0.5)) + law(sources[1], np.full(3, 0.5)) + (
        law(sources[2], np.full(3, 0.6)))
    np.testing.assert_allclose(light(floor, lamps), expected, atol=0.011)


@pytest.mark.parametrize('source, direction', [
    ((0.0, 0.0, 1.0), -DOWN), ((0.0, 0.0, -1.0), DOWN)])
def test_a_lamp_that_looks_away_or_is_behind_gives_nothing(floor, source, direction):
    lamp = Lamp(np.array([source]), direction, np.ones(3))
    np.testing.assert_allclose(light(floor, [lamp]), np.broadcast_to(AROUND, (20, 20, 3)),
                               atol=0.011)


@pytest.mark.parametrize('clearance, share', [
    (0.3, 1.0), (0.15, 1.0), (0.12, 0.8), (0.075, 0.5), (0.0, 0.45), (-1.0, 0.45)])
def test_corners_get_less_of_the_light_from_all_around(floor, clearance, share):
    np.testing.assert_allclose(light(floor, [], clearance=clearance)[0, 0], share * AROUND,
                               atol=0.011)


@pytest.mark.parametrize('size, shadows', [(0.26, True), (0.25, False)])
def test_a_block_shades_what_the_lamp_does_not_see(floor, size, shadows):
    """Its shadow, a central projection, is twice as large; small blocks throw none."""
    source = np.array([0.1, 0.05, 1.0])
    turn = se3.exp([0, 0, 0, 0, 0, 0.4])
    T_world_block = turn.copy()
    T_world_block[:3, 3] = 0.0, 0.0, 0.5
    block = Block(T_world_block, np.array([size, size, 0.002]))
    lamp = Lamp(source[None], DOWN, np.ones(3))
    lit = light(floor, [lamp], [block])
    expected = law(source, np.ones(3))
    # where the ray to the lamp passes the height of the block
    crossing = places() + (source - places()) * ((0.5 - 0.01) / (1.0 - 0.01))
    beyond = np.abs(crossing[..., :2] @ turn[:2, :2]).max(axis=-1) - size / 2
    clear, dark = beyond > 0.005, beyond < -0.005
    assert dark.sum() > 25
    np.testing.assert_allclose(lit[clear], (AROUND + expected)[clear], atol=0.011)
    np.testing.assert_allclose(
        lit[dark], (AROUND + (not shadows) * expected)[dark], atol=0.011)


@pytest.mark.parametrize('height', [-0.3, 1.4])
def test_what_is_below_the_floor_or_above_the_lamp_shades_nothing(floor, height):
    T_world_block = np.eye(4)
    T_world_block[2, 3] = height
    lamp = Lamp(np.array([[0.0, 0.0, 1.0]]), DOWN, np.ones(3))
    block = Block(T_world_block, np.array([0.5, 0.5, 0.5]))
    np.testing.assert_array_equal(light(floor, [lamp], [block]), light(floor, [lamp]))


def test_each_surface_gets_its_own_light(floor):
    """Of several, of other sizes and textures."""
    T_world_wall = np.array([[1.0, 0, 0, -0.7], [0, 0, 1, 0.7], [0, -1, 0, 2.1], [0, 0, 0, 1]])
    wall = Rectangle(T_world_wall, 1.4, 2.1, np.full((30, 20, 3), 100, np.uint8))
    lamp = Lamp(np.array([[0.0, 0.0, 1.5]]), DOWN, np.ones(3))
    for surfaces in ([floor, wall], [wall, floor]):
        lit = {s.height: s.image for s in illuminate(surfaces, (), [lamp],
                                                     lambda points: np.ones(len(points)))}
        np.testing.assert_allclose(lit[SIDE] / 100, AROUND + law(lamp.points[0], np.ones(3)),
                                   atol=0.011)
        # on the wall, lower than the lamp only, and the most obliquely at its height
        rows = lit[2.1][:, 10, 0] / 100 - AROUND[0]
        assert (rows[:8] < 0.011).all() and rows[12:].min() > 0.1
        z = 2.1 - 2.1 * (np.arange(30) + 0.5) / 30
        squared = 0.69 ** 2 + 0.035 ** 2 + (1.5 - z) ** 2
        expected = 0.69 * np.maximum(1.5 - z, 0) / squared ** 2
        np.testing.assert_allclose(rows, expected, atol=0.011)
