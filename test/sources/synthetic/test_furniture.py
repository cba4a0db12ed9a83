# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Furniture keeps the size it says, stands on something, and goes through no wall or floor."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.sources.synthetic import furniture, prints
from aick_ros.sources.synthetic.assembly import Assembly

COLOUR = (150.0, 106.0, 66.0)
PIECES = {  # how to add it, extent in x, depth to the front, top; at a wall or in the middle
    'bookshelf': (lambda a: furniture.bookshelf(a, 1.0, 2.0, COLOUR), 1.0, 0.3, 2.0, True),
    'desk': (lambda a: furniture.desk(a, COLOUR), 1.4, 1.0, 1.3, True),
    'sofa': (lambda a: furniture.sofa(a, COLOUR), 1.9, 0.91, 0.85, True),
    'cabinet': (lambda a: furniture.cabinet(a, 1.3, COLOUR, furniture.CLUTTER), 1.34, 0.47, 1.25,
                True),
    'coffee table': (lambda a: furniture.coffee_table(a, COLOUR), 1.0, 0.6, 0.56, False),
    'chair': (lambda a: furniture.chair(a, COLOUR), 0.44, 0.44, 0.92, False),
    'stool': (lambda a: furniture.stool(a, COLOUR), 0.4, 0.4, 0.42, False),
    'floor lamp': (furniture.floor_lamp, 0.44, 0.44, 1.63, False),
    'plant': (furniture.plant, 0.48, 0.48, 1.32, False),
    'cartons': (furniture.cartons, 0.6, 0.52, 0.86, False),
    'screen': (furniture.screen, 0.56, 0.18, 0.46, False),
    'desk lamp': (furniture.desk_lamp, 0.22, 0.22, 0.42, False),
    'globe': (furniture.globe, 0.24, 0.24, 0.315, False),
    'mug': (furniture.mug, 0.084, 0.084, 0.1, False),
    'vase': (furniture.vase, 0.22, 0.22, 0.44, False),
    'bowl': (furniture.bowl, 0.24, 0.24, 0.134, False),
    'radio': (furniture.radio, 0.32, 0.15, 0.2, False),
    'photograph': (furniture.photograph, 0.2, 0.08, 0.26, False),
    'books': (lambda a: furniture.book_pile(a, 5), 0.3, 0.32, 0.18, False),
    'wall shelf': (lambda a: furniture.wall_shelf(a, 0.7, COLOUR), 0.7, 0.22, 0.4, True),
    'picture': (lambda a: furniture.picture(a, 0.5, 0.7, prints.poster), 0.5, 0.025, 0.7, True)}


def built(name, seed=0):
    assembly = Assembly(np.random.default_rng(seed))
    PIECES[name][0](assembly)
    return assembly


def corners(block):
    signs = np.stack(np.meshgrid(*[(-0.5, 0.5)] * 3), axis=-1).reshape(-1, 3)
    return se3.transform(block.T_world_block, signs * block.size)


@pytest.mark.parametrize('seed', [0, 1])
@pytest.mark.parametrize('name', PIECES)
def test_a_piece_keeps_its_size(name, seed):
    _, width, depth, height, is_at_wall = PIECES[name]
    assembly = built(name, seed)
    points = np.concatenate([surface.hull for surface in [*assembly.surfaces, *assembly.glowing]]
                            + [corners(block) for block in assembly.blocks])
    low, high = points.min(axis=0), points.max(axis=0)
    assert low[2] >= -0.01
    assert 0.65 * height < high[2] < 1.06 * height
    slack = 0.24 if name == 'desk' else 0.03  # its chair, which is turned
    assert 0.7 * width < high[0] - low[0] < 1.02 * width + slack
    assert abs(high[0] + low[0]) < 0.35 * width
    if is_at_wall:
        assert high[1] < 0.016
        assert 0.8 * depth < -low[1] < depth + slack
    else:
        assert 0.7 * depth < high[1] - low[1] < depth + 0.05


@pytest.mark.parametrize('name', PIECES)
def test_each_part_touches_the_floor_or_another_part(name):
    """Nothing floats: from each part others lead down to the floor, or to the wall."""
    blocks = built(name).blocks
    # points all over each block; touching is nearer than a centimetre
    ticks = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 5)] * 3), axis=-1).reshape(-1, 3)
    clouds = [se3.transform(block.T_world_block, ticks * block.size) for block in blocks]
    held = [bool(cloud[:, 2].min() < 0.01 or PIECES[name][4] and cloud[:, 1].max() > -0.011)
            for cloud in clouds]
    new = [i for i, is_held in enumerate(held) if is_held]
    while new:
        other = new.pop()
        for i, block in enumerate(blocks):
            if not held[i] and min(block.distance(clouds[other]).min(),
                                   blocks[other].distance(clouds[i]).min()) < 0.01:
                held[i] = True
                new.append(i)
    assert all(held)


def faces_up(surface):
    points, normals = surface.points(np.array([surface.width / 2]), np.array([surface.height / 2]))
    return points[0], normals[0]


def test_a_bookshelf_has_books_on_each_board():
    assembly = built('bookshelf')
    boards = sorted(b.T_world_block[2, 3] + 0.0125 for b in assembly.blocks
                    if b.size[2] == 0.025 and b.size[0] == 0.95)
    np.testing.assert_allclose(np.diff(boards), (2.0 - 0.025 - 0.06) / round(2.0 / 0.36))
    assert boards[-1] == pytest.approx(2.0)
    feet = [b.T_world_block[2, 3] - b.size[2] / 2 for b in assembly.blocks
            if 0.15 < b.size[2] < 0.5]
    for board in boards[:-1]:
        assert np.count_nonzero(np.abs(np.subtract(feet, board)) < 1e-9) >= 2
    # books end below the next board and between the sides
    for block in assembly.blocks:
        if block.size[1] == pytest.approx(0.21):
            bottom, top = block.T_world_block[2, 3] + block.size[2] * np.array([-0.5, 0.5])
            assert not any(bottom + 0.01 < board - 0.0125 < top for board in boards)
            assert abs(block.T_world_block[0, 3]) + block.size[0] / 2 <= 0.475


@pytest.mark.parametrize('name, tops', [
    ('desk', 0.74), ('coffee table', 0.42), ('cabinet', 0.88), ('chair', 0.5)])
def test_a_table_has_its_height(name, tops):
    """The largest part that lies has its top there."""
    lying = [b for b in built(name).blocks if b.size[2] < 0.07]
    largest = max(lying, key=lambda block: block.size[0] * block.size[1])
    assert largest.T_world_block[2, 3] + largest.size[2] / 2 == pytest.approx(tops)
    if name in ('desk', 'coffee table'):
        legs = [b for b in built(name).blocks if b.size[0] == b.size[1] == 0.06]
        places = np.array([leg.T_world_block[:2, 3] for leg in legs]) - (
            largest.T_world_block[:2, 3])
        np.testing.assert_allclose(np.abs(places), np.broadcast_to(
            largest.size[:2] / 2 - 0.05, (4, 2)))
        assert {tuple(sign) for sign in np.sign(places)} == {(a, b) for a in (-1, 1)
                                                             for b in (-1, 1)}
        np.testing.assert_allclose([leg.size[2] for leg in legs], tops - 0.04)


def test_the_screen_glows_towards_who_sits_there():
    for name in ('screen', 'desk'):
        [screen] = built(name).glowing
        assert (screen.width, screen.height) == (0.55, 0.34)
        middle, normal = faces_up(screen)
        assert normal[1] < -0.98
        bodies = [b for b in built(name).blocks if b.size[1] == 0.035]
        assert bodies[0].distance(middle[None])[0] == pytest.approx(0.0015, abs=1e-3)


def test_a_chair_is_turned_to_the_desk_and_its_back_is_behind_who_sits():
    chair = built('chair')
    tall = [b.T_world_block[1, 3] for b in chair.blocks if b.size[2] > 0.9]
    short = [b.T_world_block[1, 3] for b in chair.blocks if 0.4 < b.size[2] < 0.5]
    assert min(tall) > 0 > max(short) and len(tall) == len(short) == 2
    desk = built('desk')
    backs = [b.T_world_block[1, 3] for b in desk.blocks if b.size[2] > 0.9]
    seats = [b.T_world_block[1, 3] for b in desk.blocks if b.size.tolist() == [0.44, 0.44, 0.06]]
    assert len(backs) == 2 and max(backs) < seats[0] < -0.6


def test_a_photograph_leans_backwards():
    [frame] = built('photograph').blocks
    np.testing.assert_allclose(frame.T_world_block[:3, 2], (0, np.sin(0.2), np.cos(0.2)))


def test_a_window_is_between_its_curtains_above_its_sill():
    assembly = Assembly(np.random.default_rng(0))
    furniture.window(assembly.at(z=0.95), 1.4, 1.2)
    [view] = assembly.glowing
    middle, normal = faces_up(view)
    np.testing.assert_allclose(middle, (0, -0.01, 0.95 + 0.6), atol=1e-9)
    np.testing.assert_allclose(normal, (0, -1, 0), atol=1e-9)
    sill, *curtains = assembly.blocks
    assert sill.T_world_block[2, 3] + sill.size[2] / 2 == pytest.approx(0.95)
    assert sill.size[0] > 1.4
    places = sorted(curtain.T_world_block[0, 3] for curtain in curtains)
    assert places[0] == -places[1] and 0.6 < places[1] - 0.17 < 0.7  # half of the window
    for curtain in curtains:
        low, high = curtain.T_world_block[2, 3] + curtain.size[2] * np.array([-0.5, 0.5])
        assert 0.5 < low < 0.95 and high > 0.95 + 1.2


def test_clutter_is_small_enough_for_a_cabinet():
    for thing in furniture.CLUTTER:
        assembly = Assembly(np.random.default_rng(0))
        thing(assembly)
        points = np.concatenate([surface.hull for surface in assembly.surfaces])
        assert np.ptp(points[:, :2], axis=0).max() < 0.36 and points[:, 2].max() < 0.5


def boxes(assembly):
    """Return low and high corners of the blocks that are not turned, Nx3 each."""
    centres = np.array([b.T_world_block[:3, 3] for b in assembly.blocks])
    halves = np.array([b.size for b in assembly.blocks]) / 2
    return centres - halves, centres + halves


@pytest.mark.parametrize('name, front', [('bookshelf', -0.3), ('wall shelf', -0.22)])
def test_books_stand_a_little_behind_the_edge_of_their_board(name, front):
    """By 2 to 6 cm, and are 0.7 times as deep; a bookshelf has a back behind them."""
    low, high = boxes(built(name))
    depth = high[:, 1] - low[:, 1]
    books = np.isclose(depth, -0.7 * front) & (high[:, 2] - low[:, 2] > 0.05)
    assert books.sum() >= 2
    behind = low[books, 1] - front
    assert (behind >= 0.02 - 1e-9).all() and (behind <= 0.06 + 1e-9).all()
    flat = [s for s in built(name).surfaces if s.width == 1.0 and s.height == 2.0]
    assert [s.hull[:, 1].tolist() for s in flat] == [[pytest.approx(-0.01)] * 4] * (
        name == 'bookshelf')


def test_a_screen_stands_on_its_foot():
    low, high = boxes(built('screen'))
    assert low[:, 2].tolist() == pytest.approx([0.0, 0.015, 0.11])
    assert high[:, 2].tolist() == pytest.approx([0.015, 0.165, 0.46])
    # the neck is behind the panel's front and holds it
    assert low[2, 1] < low[1, 1] < high[2, 1]


def test_a_sofa_has_two_seats_between_its_arms_and_a_back():
    low, high = boxes(built('sofa'))
    base, back, *rest = range(len(low))
    arms = [i for i in rest if np.isclose(high[i, 0] - low[i, 0], 0.2)]
    seats = [i for i in rest if np.isclose(high[i, 2] - low[i, 2], 0.14)]
    assert len(arms) == len(seats) == 2
    assert sorted(low[arms, 0].tolist()) == pytest.approx([-0.95, 0.75])
    assert sorted(low[seats, 0].tolist()) == pytest.approx([-0.74, 0.01])
    np.testing.assert_allclose(low[[back, *seats], 2], high[base, 2])
    assert high[back, 1] == pytest.approx(0.0) and high[back, 2] == pytest.approx(0.78)
    assert (high[seats, 1] > low[back, 1] - 0.03).all()  # up to the back


def test_chairs_and_tables_of_a_desk_do_not_stand_in_each_other():
    for seed in range(5):
        blocks = built('desk', seed).blocks
        seat, = (b for b in blocks if b.size.tolist() == [0.44, 0.44, 0.06])
        drawers, = (b for b in blocks if b.size[0] == 0.42 and b.size[1] == 0.5)
        assert drawers.distance(corners(seat)).min() > 0.0
