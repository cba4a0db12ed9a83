# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The renderer against a slow ray caster, written from the scene's geometry alone."""

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.sources.synthetic.renderer import Renderer
from aick_ros.sources.synthetic.surfaces import Disc, Rectangle, Round

FRAMES = (0, 50, 100, 149)


def cast(surfaces, origin, directions):
    """Return for each ray (Nx3, world) its length in directions, surface, s and t; inf: none."""
    best = np.full((4, len(directions)), np.inf)
    for index, surface in enumerate(surfaces):
        meet = meet_round if isinstance(surface, Round) else meet_plane
        length, s, t = meet(surface, origin, directions)
        nearer = length < best[0]
        best[:, nearer] = np.stack([length, np.full(len(s), index), s, t])[:, nearer]
    return best


def meet_plane(surface, origin, directions):
    right, down, away, corner = surface.T_world_surface[:3].T
    slope = directions @ away
    with np.errstate(divide='ignore', invalid='ignore'):
        length = (corner - origin) @ away / slope
    points = origin + length[:, None] * directions - corner
    s, t = points @ right, points @ down
    hit = (slope > 0) & (length > 0)
    if type(surface) is Disc:
        hit &= np.hypot(s - surface.width / 2, t - surface.width / 2) <= surface.width / 2
    else:
        hit &= (s >= 0) & (s <= surface.width) & (t >= 0) & (t <= surface.height)
    return np.where(hit, length, np.inf), s, t


def meet_round(surface, origin, directions):
    T_surface_world = se3.inverse(surface.T_world_surface)
    start = T_surface_world[:3, :3] @ origin + T_surface_world[:3, 3]
    rays = directions @ T_surface_world[:3, :3].T
    a, b, c = surface.profile
    result = np.full((3, len(rays)), np.inf)
    middle = surface.hull.mean(axis=0)
    past = np.linalg.norm(np.cross(directions, middle - origin), axis=1) / np.linalg.norm(
        directions, axis=1)
    for i in np.flatnonzero(past < np.linalg.norm(surface.hull - middle, axis=1).max()):
        ray = rays[i]
        # x^2 + y^2 - a - b z - c z^2 along the ray
        x, y, z = (np.poly1d([r, o]) for r, o in zip(ray, start))
        polynomial = x * x + y * y - a - b * z - c * z * z
        for root in sorted(polynomial.roots):
            entering = np.isreal(root) and root.real > 0 and polynomial.deriv()(root.real) < 0
            if entering and surface.low <= z(root.real) <= surface.high:
                turn = np.arctan2(y(root.real), x(root.real)) % (2 * np.pi)
                result[:, i] = (root.real, turn / (2 * np.pi) * surface.width,
                                surface.high - z(root.real))
                break
    return result


def texel(surface, s, t):
    rows, columns = surface.image.shape[:2]
    row = min(int(t / surface.height * rows), rows - 1)
    column = min(int(s / surface.width * columns), columns - 1)
    return surface.image[row, column].astype(float)


def mean_colours(surfaces, camera, T_world_camera, pixels):
    """Return the mean colour of 36 rays through each pixel."""
    offset = (np.arange(6) + 0.5) / 6 - 0.5
    offsets = np.stack(np.meshgrid(offset, offset), axis=-1).reshape(-1, 2)
    rays = rays_of(camera, T_world_camera, (pixels[:, None] + offsets).reshape(-1, 2))
    _, hit, s, t = cast(surfaces, T_world_camera[:3, 3], rays)
    colours = np.array([texel(surfaces[int(k)], *place) for k, *place in zip(hit, s, t)])
    return colours.reshape(len(pixels), len(offsets), 3).mean(axis=1)


def rays_of(camera, T_world_camera, pixels):
    return camera.back_project(pixels, np.ones(len(pixels))) @ T_world_camera[:3, :3].T


def compare_with_cast(surface):
    camera = Camera(120, 90, 97.5, 98.25, 59.0, 45.5)
    pixels = np.stack(np.meshgrid(np.arange(120), np.arange(90)), axis=-1).reshape(-1, 2)
    depth = Renderer([surface], camera).render(np.eye(4)).depth
    true = cast([surface], np.zeros(3), rays_of(camera, np.eye(4), pixels))[0]
    true[np.isinf(true)] = np.nan
    assert 30 < np.isfinite(true).sum() < 4500
    np.testing.assert_allclose(depth.ravel(), true, rtol=2e-7)


def pose(position, turn):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = se3.exp_rotation(turn), position
    return T


def random_pixels(camera, count, seed):
    return np.random.default_rng(seed).integers(0, (camera.width, camera.height), (count, 2))


@pytest.mark.parametrize('index', FRAMES)
def test_depth_is_that_of_the_ray_through_the_centre_of_the_pixel(perfect, index):
    frame, T_world_camera = perfect.frame(index), perfect.ground_truth.poses[index]
    pixels = random_pixels(frame.camera, 120, seed=index)
    rays = rays_of(frame.camera, T_world_camera, pixels)
    true = cast(perfect.scene.surfaces, T_world_camera[:3, 3], rays)[0]
    rendered = frame.depth[pixels[:, 1], pixels[:, 0]]
    np.testing.assert_allclose(rendered, true, rtol=2e-7)


@pytest.mark.parametrize('index', FRAMES)
def test_colour_is_the_mean_over_the_pixel(perfect, index):
    frame, T_world_camera = perfect.frame(index), perfect.ground_truth.poses[index]
    pixels = random_pixels(frame.camera, 40, seed=index)
    true = mean_colours(perfect.scene.surfaces, frame.camera, T_world_camera, pixels)
    error = np.abs(frame.colour[pixels[:, 1], pixels[:, 0]] - true).mean(axis=1)
    assert np.median(error) < 1.0
    # the rest is at outlines and where texels are larger than pixels
    assert np.quantile(error, 0.8) < 4.0


@pytest.mark.parametrize('turn', [(1.2, -0.3, 0.2), (3.0, 0.1, 0.0), (0.8, 0.3, 0.0)])
@pytest.mark.parametrize('profile', [(0.09, 0.0, -1.0), (0.04, 0.0, 0.0), (0.04, -0.12, 0.09)],
                         ids=['ball', 'cylinder', 'cone'])
def test_round_things_have_exact_depth(checkers, profile, turn):
    surface = Round(pose((0.05, -0.1, 2.0), turn), profile, -0.3, 0.3, checkers)
    compare_with_cast(surface)


@pytest.mark.parametrize('turn', [(0.2, -0.3, 0.2), (1.3, 0.0, 0.0)])
def test_discs_have_exact_depth(checkers, turn):
    compare_with_cast(Disc(pose((0.05, -0.1, 2.0), turn), 0.5, 0.5, checkers))


@pytest.mark.parametrize('kind', ['rectangle', 'ball', 'cone'])
def test_points_of_a_surface_lie_where_rays_find_them(checkers, kind):
    T_world_surface = pose((0.05, -0.1, 2.0), (0.9, -0.3, 0.2))
    surface = {'rectangle': Rectangle(T_world_surface, 0.4, 0.6, checkers),
               'ball': Round(T_world_surface, (0.09, 0.0, -1.0), -0.3, 0.3, checkers),
               'cone': Round(T_world_surface, (0.04, -0.12, 0.09), -0.3, 0.3, checkers)}[kind]
    rng = np.random.default_rng(5)
    s, t = rng.uniform(0.05, 0.95, (2, 300)) * [[surface.width], [surface.height]]
    points, normals = surface.points(s, t)
    faces = np.einsum('ni,ni->n', points, normals) < -0.05
    length, _, found_s, found_t = cast([surface], np.zeros(3), points)
    np.testing.assert_allclose(length[faces], 1.0, rtol=1e-9)
    np.testing.assert_allclose(found_s[faces], s[faces], atol=1e-9)
    np.testing.assert_allclose(found_t[faces], t[faces], atol=1e-9)
    assert faces.sum() > 50
    for step in ((1e-6, 0), (0, 1e-6)):
        tangents = (surface.points(s + step[0], t + step[1])[0] - points) / 1e-6
        assert np.abs(np.einsum('ni,ni->n', tangents, normals)).max() < 1e-4


def test_outlines_are_smooth():
    white = np.full((20, 20, 3), 255, np.uint8)
    square = Rectangle(pose((-0.3, -0.45, 2.0), (0, 0, 0.3)), 0.8, 0.7, white)
    camera = Camera(160, 120, 130.0, 130.0, 79.5, 59.5)
    colour = Renderer([square], camera).render(np.eye(4)).colour[..., 0]
    # how much of each pixel the square covers, counted in 16 by 16 places
    fine = Camera(2560, 1920, 2080.0, 2080.0, 1279.5, 959.5)
    pixels = np.stack(np.meshgrid(np.arange(2560), np.arange(1920)), axis=-1).reshape(-1, 2)
    seen = np.isfinite(cast([square], np.zeros(3), rays_of(fine, np.eye(4), pixels))[0])
    coverage = seen.reshape(120, 16, 160, 16).mean(axis=(1, 3))
    edge = (coverage > 0) & (coverage < 1)
    assert edge.sum() > 100
    error = np.abs(colour / 255 - coverage)
    assert error[~edge].max() == 0
    assert error[edge].mean() < 0.1
    assert error[edge].max() < 0.3


def test_a_point_is_seen_in_the_pixel_it_projects_to(checkers):
    # a pattern whose corners are known, found in the picture by OpenCV
    board = Rectangle(pose((-0.5, -0.3, 1.5), (0.3, 0.4, 0.1)), 1.0, 0.8, checkers)
    camera = Camera(640, 480, 500.0, 510.0, 310.0, 250.0)
    picture = Renderer([board], camera).render(np.eye(4))
    grey = cv2.cvtColor(picture.colour, cv2.COLOR_RGB2GRAY)
    s, t = (a.ravel() for a in np.meshgrid(np.arange(2, 9) * 0.1, np.arange(2, 7) * 0.1))
    pixels = camera.project(board.points(s, t)[0])
    found = cv2.cornerSubPix(grey, pixels.astype(np.float32).reshape(-1, 1, 2), (5, 5), (-1, -1),
                             (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 50, 1e-4))
    error = found.reshape(-1, 2) - pixels
    assert np.abs(error).max() < 0.2
    assert np.abs(error.mean(axis=0)).max() < 0.03


def test_what_is_not_there_has_no_depth(checkers):
    board = Rectangle(np.eye(4), 1.0, 0.8, checkers)
    behind = np.eye(4)
    behind[2, 3] = 1.0  # the camera is on the far side of the board
    picture = Renderer([board], Camera(64, 48, 50.0, 50.0, 31.5, 23.5)).render(behind)
    assert np.isnan(picture.depth).all()
    assert not picture.colour.any()


def test_surfaces_partly_behind_the_camera_are_seen(checkers):
    # a floor that reaches under and behind the camera, one metre below it
    T_world_floor = np.array([[1.0, 0, 0, -5], [0, 0, 1, 1], [0, -1, 0, 5], [0, 0, 0, 1]])
    floor = Rectangle(T_world_floor, 10.0, 10.0, checkers)
    camera = Camera(64, 48, 50.0, 50.0, 31.5, 23.5)
    depth = Renderer([floor], camera).render_depth(np.eye(4))
    below = np.arange(34, 48)
    np.testing.assert_allclose(depth[below, 30], 50.0 / (below - 23.5), rtol=1e-6)


def test_a_camera_with_distortion_is_rejected(checkers):
    camera = Camera(64, 48, 50.0, 50.0, 31.5, 23.5, 'plumb_bob', (0.1, 0.0, 0.0, 0.0))
    with pytest.raises(InputError, match='^the renderer takes a camera without distortion$'):
        Renderer([Rectangle(np.eye(4), 1.0, 1.0, checkers)], camera)


@pytest.mark.parametrize('tilt, distance', [
    (0.0, 0.8), (0.0, 1.5), (0.0, 2.5), (0.6, 2.0), (1.2, 2.0), (1.35, 2.0)])
def test_fine_texture_neither_flickers_nor_blurs(tilt, distance):
    rng = np.random.default_rng(8)
    grain = cv2.GaussianBlur(rng.uniform(0, 255, (800, 800)).astype(np.float32), (0, 0), 1.2)
    image = np.repeat(np.clip(128 + 3 * (grain - 128), 0, 255)[..., None], 3, axis=2)
    board = Rectangle(pose((-0.8, -0.8 * np.cos(tilt), distance + 0.8 * np.sin(tilt)),
                           (-tilt, 0, 0)), 1.6, 1.6, image.astype(np.uint8))
    camera = Camera(320, 240, 260.0, 260.0, 159.5, 119.5)
    picture = Renderer([board], camera).render(np.eye(4))
    inside = cv2.erode(np.isfinite(picture.depth).astype(np.uint8), np.ones((3, 3)))
    pixels = random_pixels(camera, 3000, seed=1)
    pixels = pixels[inside[pixels[:, 1], pixels[:, 0]] > 0][:500]
    true = mean_colours([board], camera, np.eye(4), pixels)[:, 0]
    rendered = picture.colour[pixels[:, 1], pixels[:, 0], 0]
    # less contrast is blur, the rest of the error is flicker
    contrast = np.polyfit(true, rendered, 1)[0]
    assert 0.8 < contrast < 1.15
    assert np.std(rendered - true) < 0.3 * true.std()


def test_a_rectangle_is_seen_from_its_front_and_a_ball_from_all_sides(checkers):
    """What is behind a rectangle is seen through its back."""
    camera = Camera(64, 48, 60.0, 60.0, 31.5, 23.5)
    front = pose((-1.0, -1.0, 2.0), (0.0, 0.0, 0.0))
    wall = Rectangle(front, 2.0, 2.0, checkers)
    ball = Round(pose((0.0, 0.0, 4.0), (0.0, 0.0, 0.0)), (0.25, 0.0, -1.0), -0.5, 0.5, checkers)
    renderer = Renderer([wall, ball], camera)
    assert renderer.render_depth(np.eye(4))[24, 32] == pytest.approx(2.0)
    from_behind = pose((0.0, 0.0, 6.0), (0.0, np.pi, 0.0))
    seen = renderer.render_depth(from_behind)
    assert seen[24, 32] == pytest.approx(1.5, abs=0.01)
    alone = Renderer([wall], camera).render_depth(from_behind)
    assert np.isnan(alone).all()


@pytest.mark.parametrize('focal', [(60.0, 120.0), (120.0, 60.0)])
def test_an_edge_is_mixed_by_the_share_of_the_pixel_that_it_covers(focal):
    """Along either axis, whatever its focal length: a white board before a dark wall."""
    camera = Camera(64, 48, *focal, 31.5, 23.5)
    white, dark = (np.full((8, 8, 3), grey, np.uint8) for grey in (240, 0))
    wall = Rectangle(pose((-4.0, -4.0, 3.0), (0, 0, 0)), 8.0, 8.0, dark)
    # its lower right corner lies a quarter of a pixel beyond the centre of one
    right, down = (2.0 * (0.75 / f) for f in focal)
    board = Rectangle(pose((right - 2.0, down - 2.0, 2.0), (0, 0, 0)), 2.0, 2.0, white)
    colours = Renderer([wall, board], camera).render(np.eye(4)).colour[..., 0].astype(float)
    # 31.5 + 0.75 = 32.25 px: three quarters of column 32, and likewise of row 24
    assert colours[10, 31] == colours[23, 10] == 240 and colours[10, 33] == colours[25, 10] == 0
    assert colours[10, 32] == pytest.approx(0.75 * 240, abs=30)
    assert colours[24, 10] == pytest.approx(0.75 * 240, abs=30)
