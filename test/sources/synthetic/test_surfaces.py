# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Extents of surfaces, their hulls and their textures; test_renderer casts rays at them."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.sources.synthetic.surfaces import Disc, Rectangle, Round

IMAGE = np.zeros((4, 6, 3), np.uint8)
T_WORLD_SURFACE = se3.exp([1.0, -2.0, 0.5, 0.4, 0.7, -0.3])
PROFILES = {  # (a, b, c), low, high, largest radius
    'ball': ((0.09, 0.0, -1.0), -0.3, 0.3, 0.3),
    'upper half of a ball': ((0.09, 0.0, -1.0), 0.1, 0.3, np.sqrt(0.08)),
    'ball off its centre': ((0.05, 0.4, -1.0), 0.0, 0.4, 0.3),
    'cylinder': ((0.04, 0.0, 0.0), -0.1, 0.5, 0.2),
    'cone upwards': ((0.04, -0.12, 0.09), 0.0, 0.5, 0.2),
    'cone downwards': ((0.04, 0.12, 0.09), 0.0, 0.5, 0.35),
    'waist': ((0.04, 0.0, 1.0), -0.2, 0.3, np.sqrt(0.13))}


@pytest.mark.parametrize('name', PROFILES)
def test_the_size_of_round_things(name):
    profile, low, high, radius = PROFILES[name]
    surface = Round(T_WORLD_SURFACE, profile, low, high, IMAGE)
    assert surface.width == pytest.approx(2 * np.pi * radius)
    assert surface.height == pytest.approx(high - low)
    rng = np.random.default_rng(0)
    s, t = rng.uniform(0, 1, (2, 2000)) * [[surface.width], [surface.height]]
    points, _ = surface.points(s, t)
    here = se3.transform(se3.inverse(T_WORLD_SURFACE), points)
    a, b, c = profile
    np.testing.assert_allclose(here[:, 0] ** 2 + here[:, 1] ** 2,
                               a + b * here[:, 2] + c * here[:, 2] ** 2, atol=1e-9)
    hull = se3.transform(se3.inverse(T_WORLD_SURFACE), surface.hull)
    assert hull.shape == (8, 3)
    np.testing.assert_allclose(hull.min(axis=0), (-radius, -radius, low))
    np.testing.assert_allclose(hull.max(axis=0), (radius, radius, high))
    assert (np.abs(here[:, :2]).max(axis=0) > 0.9 * radius).all()
    # wound from the x axis towards y, from the upper end downwards
    np.testing.assert_allclose(np.arctan2(here[:, 1], here[:, 0]) % (2 * np.pi),
                               2 * np.pi * s / surface.width, atol=1e-9)
    np.testing.assert_allclose(here[:, 2], high - t, atol=1e-9)


@pytest.mark.parametrize('kind', [Rectangle, Disc])
def test_the_corners_of_flat_things(kind):
    surface = kind(T_WORLD_SURFACE, 0.4, 0.6, IMAGE)
    hull = se3.transform(se3.inverse(T_WORLD_SURFACE), surface.hull)
    np.testing.assert_allclose(
        sorted(np.abs(hull).round(9).tolist()),
        [[0, 0, 0], [0, 0.6, 0], [0.4, 0, 0], [0.4, 0.6, 0]], atol=1e-12)
    points, normals = surface.points(np.array([0.1, 0.3]), np.array([0.2, 0.5]))
    np.testing.assert_allclose(se3.transform(se3.inverse(T_WORLD_SURFACE), points),
                               [[0.1, 0.2, 0], [0.3, 0.5, 0]], atol=1e-12)
    np.testing.assert_allclose(normals @ T_WORLD_SURFACE[:3, :3], [[0, 0, -1]] * 2, atol=1e-12)


@pytest.mark.parametrize('surface', [
    Rectangle(T_WORLD_SURFACE, 0.4, 0.6, IMAGE), Disc(T_WORLD_SURFACE, 0.5, 0.5, IMAGE),
    Round(T_WORLD_SURFACE, (0.09, 0.0, -1.0), -0.3, 0.3, IMAGE)])
def test_another_texture_is_all_that_changes(surface):
    image = np.ones((3, 2, 3), np.uint8)
    other = surface.with_image(image)
    assert type(other) is type(surface)
    assert other.image is image and surface.image is IMAGE
    assert (other.width, other.height) == (surface.width, surface.height)
    np.testing.assert_array_equal(other.hull, surface.hull)


@pytest.mark.parametrize('tilt', [0.0, 0.5, 1.1])
def test_the_stretch_of_a_pixel_is_what_it_covers_more_at_oblique_incidence(tilt):
    """Along the slope a pixel covers 1 / cos of the incidence, of which the tangent is stretch."""
    T_camera_board = np.eye(4)
    T_camera_board[:3, :3] = se3.exp_rotation((-tilt, 0, 0))
    T_camera_board[:3, 3] = (-1.0, -1.0 * np.cos(tilt), 2.0 + np.sin(tilt))
    board = Rectangle(T_camera_board, 2.0, 2.0, IMAGE)
    zero = np.zeros(1, np.float32)
    T_surface_camera = se3.inverse(T_camera_board)
    inverse_depth = board.inverse_depth(T_surface_camera, zero, zero).astype(np.float32)
    found = board.texture_points(T_surface_camera, zero, zero, inverse_depth, 0.002)
    assert inverse_depth == pytest.approx(0.5, rel=1e-6)
    assert (found.s, found.t) == (pytest.approx(1.0, abs=1e-5), pytest.approx(1.0, abs=1e-5))
    assert found.stretch_s == pytest.approx(0.0, abs=1e-8)
    assert abs(found.stretch_t) == pytest.approx(2.0 * 0.002 * np.tan(tilt), abs=1e-7)


SOLIDS = {
    'rectangle': Rectangle(T_WORLD_SURFACE, 0.4, 0.6, IMAGE),
    'disc': Disc(T_WORLD_SURFACE, 0.5, 0.5, IMAGE),
    **{name: Round(T_WORLD_SURFACE, profile, low, high, IMAGE)
       for name, (profile, low, high, _) in PROFILES.items() if name != 'waist'}}


def crossing(surface, origin, direction):
    """Return how far along a ray in the frame of a surface it is hit first; 0: nowhere."""
    if isinstance(surface, Rectangle):
        far = -origin[2] / direction[2]
        place = origin + far * direction
        inside = (0 <= place[:2]).all() and (place[:2] <= (surface.width, surface.height)).all()
        if type(surface) is Disc:
            inside = np.linalg.norm(place[:2] - surface.width / 2) <= surface.width / 2
        return far if inside and far > 0 else 0.0  # from behind, too
    a, b, c = surface.profile
    (ox, oy, oz), (dx, dy, dz) = origin, direction
    roots = np.roots([dx * dx + dy * dy - c * dz * dz,
                      2 * (ox * dx + oy * dy - c * oz * dz) - b * dz,
                      ox * ox + oy * oy - a - b * oz - c * oz * oz])
    # where it leaves, it is not seen: from outside only
    far = min(roots.real[np.abs(roots.imag) < 1e-12], default=0.0)
    return far if far > 0 and surface.low <= oz + far * dz <= surface.high else 0.0


@pytest.mark.parametrize('name', SOLIDS)
@pytest.mark.parametrize('view', [(0.5, 1.2, -0.9), (-1.2, 0.7, -0.4), (0.9, -1.1, 0.2)])
def test_rays_hit_where_the_equation_says(name, view):
    """Single rays, by their roots; the texture there is the point that is hit."""
    surface = SOLIDS[name]
    middle = se3.transform(se3.inverse(T_WORLD_SURFACE), surface.hull).mean(axis=0)
    forward = -np.array(view) / np.linalg.norm(view)
    right = np.cross(forward, (0.3, 0.8, 0.1))
    right /= np.linalg.norm(right)
    T_surface_camera = np.eye(4)
    T_surface_camera[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    T_surface_camera[:3, 3] = middle + view
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-0.35, 0.35, (2, 400)).astype(np.float32)
    found = surface.inverse_depth(T_surface_camera, x, y)
    rays = np.column_stack([x, y, np.ones(400)]).astype(float)
    expected = np.array([crossing(surface, T_surface_camera[:3, 3],
                                  T_surface_camera[:3, :3] @ ray) for ray in rays])
    hits = (found > 0) & (expected > 0)
    assert np.count_nonzero((found > 0) != (expected > 0)) <= 2  # at the rim
    assert hits.any()
    np.testing.assert_allclose(1 / found[hits], expected[hits], rtol=2e-4)
    texture = surface.texture_points(T_surface_camera, x[hits], y[hits],
                                     found[hits].astype(np.float32), 0.002)
    points, normals = surface.points(texture.s.astype(float), texture.t.astype(float))
    T_world_camera = T_WORLD_SURFACE @ T_surface_camera
    np.testing.assert_allclose(
        points, se3.transform(T_world_camera, rays[hits] * expected[hits, None]), atol=1e-3)
    if not isinstance(surface, Rectangle):
        assert (np.einsum('ij,ij->i', normals, points - T_world_camera[:3, 3]) < 1e-3).all()


@pytest.mark.parametrize('name', SOLIDS)
def test_normals_are_across_the_surface(name):
    """They are perpendicular to both ways along it, of length one, and point outwards."""
    surface = SOLIDS[name]
    rng = np.random.default_rng(1)
    s, t = rng.uniform(0.05, 0.95, (2, 50)) * [[surface.width], [surface.height]]
    points, normals = surface.points(s, t)
    along = surface.points(s + 1e-6, t)[0] - points
    down = surface.points(s, t + 1e-6)[0] - points
    across = np.cross(along, down)
    np.testing.assert_allclose(normals, -across / np.linalg.norm(across, axis=1, keepdims=True),
                               atol=1e-4)


def test_the_stretch_is_along_the_slope():
    """Leaning to the side it is one of the image's rows, with the sign of the slope."""
    for axis in (0, 1):
        for lean in (-0.6, 0.6):
            T_camera_board = np.eye(4)
            turn = np.zeros(3)
            turn[1 - axis] = lean
            T_camera_board[:3, :3] = se3.exp_rotation(turn)
            T_camera_board[:3, 3] = T_camera_board[:3, :3] @ (-1, -1, 0) + (0, 0, 3.0)
            board = Rectangle(T_camera_board, 2.0, 2.0, IMAGE)
            zero = np.zeros(1, np.float32)
            found = board.texture_points(se3.inverse(T_camera_board), zero, zero,
                                         np.full(1, 1 / 3, np.float32), 0.002)
            stretch = np.array([found.stretch_s[0], found.stretch_t[0]])
            # the way on the board that the normal to the line of sight takes
            slope = T_camera_board[2, :2] / T_camera_board[2, 2]
            expected = 3.0 * 0.002 * slope
            np.testing.assert_allclose(np.abs(stretch), np.abs(expected), rtol=1e-5, atol=1e-9)
