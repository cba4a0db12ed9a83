# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Space around things, against distances to many points of them."""

import numpy as np

from aick_ros.geometry import se3
from aick_ros.sources.synthetic.assembly import Assembly, Block
from aick_ros.sources.synthetic.lighting import Lamp
from aick_ros.sources.synthetic.scene import Scene, Zone

ZONE = Zone(np.array([-1.0, -2.0, 0.0]), np.array([3.0, 2.0, 2.5]))


def grey(rng, width, height):
    return np.full((4, 4, 3), 100, np.uint8)


def test_the_depth_in_a_zone_is_that_to_its_nearest_side():
    np.testing.assert_array_equal(ZONE.centre, [1.0, 0.0, 1.25])
    points = np.array([[1.0, 0.0, 1.25], [-0.9, 0, 1], [2.8, 0, 1], [1, -1.7, 1], [1, 1.6, 1],
                       [1, 0, 0.5], [1, 0, 1.9], [-1.5, 0, 1], [1, 0, 2.6], [1, 5, 4]])
    np.testing.assert_allclose(ZONE.depth(points), [
        1.25, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, -0.5, -0.1, -3.0])


def test_clearance_is_that_of_the_nearest_thing_or_wall():
    blocks = [Block(se3.exp([0.5, 0.3, 0.4, 0, 0, 0.7]), np.array([0.6, 0.4, 0.8])),
              Block(se3.exp([2.0, -1.0, 1.0, 0.2, 0.1, 0]), np.array([0.2, 0.9, 0.3]))]
    scene = Scene((), tuple(blocks), ZONE, ZONE)
    rng = np.random.default_rng(0)
    points = rng.uniform(ZONE.low, ZONE.high, (300, 3))
    inside = rng.uniform(-0.5, 0.5, (2, 60000, 3))
    things = np.concatenate([se3.transform(block.T_world_block, places * block.size)
                             for block, places in zip(blocks, inside)])
    to_things = np.array([np.linalg.norm(things - point, axis=1).min() for point in points])
    clearance = scene.clearance(points)
    outside = clearance > 0.05
    assert 200 < outside.sum() < 290
    expected = np.minimum(ZONE.depth(points), to_things)
    np.testing.assert_allclose(clearance[outside], expected[outside], atol=0.03)
    assert (clearance <= expected + 1e-9).all()
    assert 0.1 < np.mean(clearance < ZONE.depth(points) - 0.01) < 0.9


def test_what_glows_is_not_lit():
    hall = Assembly(np.random.default_rng(0))
    hall.sheet(1.0, 1.0, grey)
    hall.at(z=2.0).lamp(0.5, 0.5, grey)
    hall.at(0.2).box((0.1, 0.1, 0.1), grey)
    lamp = Lamp(np.array([[0.0, 0.0, 1.0]]), np.array([0.0, 0.0, -1.0]), np.full(3, 5.0))
    scene = Scene.assemble(hall, [lamp], ZONE, ZONE)
    assert len(scene.surfaces) == len(hall.surfaces) + 1
    assert scene.blocks == tuple(hall.blocks)
    assert (scene.surfaces[0].image > 150).all()
    np.testing.assert_array_equal(scene.surfaces[-1].image, 100)
    np.testing.assert_array_equal(hall.surfaces[0].image, 100)


def test_it_is_darker_beside_a_thing():
    """Light from all around does not reach corners, of walls and of what stands there."""
    def picture(rng, width, height):
        return np.full((40, 40, 3), 100, np.uint8)

    hall = Assembly(np.random.default_rng(0))
    hall.sheet(1.4, 1.4, picture)
    open_floor = Scene.assemble(hall, [], ZONE, ZONE).surfaces[0].image.astype(float)
    hall.at(0.35, 0.0).box((0.3, 0.3, 0.6), grey)
    floor = Scene.assemble(hall, [], ZONE, ZONE).surfaces[0].image.astype(float)
    np.testing.assert_allclose(open_floor[:, :30], open_floor[20, 10] * np.ones((40, 30, 3)))
    # seen from above: x is to the right
    assert floor[20, 29].max() < 0.6 * open_floor[20, 29].min()
    np.testing.assert_array_equal(floor[:, :12], open_floor[:, :12])
