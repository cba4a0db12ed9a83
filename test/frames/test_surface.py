# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Surfaces of depth images whose points and normals are known in closed form."""

import numpy as np
import pytest

from aick_ros import kernels
from aick_ros.errors import InputError
from aick_ros.frames.surface import CELL, Surface, cell_of
from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

SENSOR = SensorSettings()
PINHOLE = Camera(640, 480, 525, 520, 319.5, 239.5)
BARREL = Camera(640, 480, 517.3, 516.5, 318.6, 255.3, 'plumb_bob',
                (0.2624, -0.9531, -0.0054, 0.0026, 1.1633))  # a Kinect
FISHEYE = Camera(640, 480, 300, 300, 319.5, 239.5, 'equidistant', (0.02, -0.01, 0.002, 0.0))
RADIUS = 2  # cells to each side in the fit of a plane


def rays_of(camera):
    """Return the rays of all pixels, on the plane z = 1, HxWx3."""
    v, u = np.indices((camera.height, camera.width))
    rays = camera.normalize(np.column_stack([u.ravel(), v.ravel()]))
    return np.column_stack([rays, np.ones(len(rays))]).reshape(camera.height, camera.width, 3)


def plane_depth(camera, normal, distance):
    """Return the depth image of the plane normal . p = distance."""
    with np.errstate(divide='ignore'):
        z = distance / (rays_of(camera) @ normal)
    return np.where(z > 0, z, np.nan).astype(np.float32)


def surface_of(depth, camera=PINHOLE, count=1000):
    return Surface.of(depth, camera, SENSOR, count)


def in_image(cells):
    """Return a value per cell as an image of cells."""
    return cells.reshape(PINHOLE.height // CELL, PINHOLE.width // CELL)


def seen_cells(grid, camera, normal, distance):
    """
    Return where a plane must be usable, and where it may be, as images of cells.

    By the rays of the cells: it is within the image, in range, and not met at a grazing angle.
    """
    x, y = (part.ravel() for part in np.broadcast_arrays(*grid.rays))
    rays = np.column_stack([x, y, np.ones(len(x))])
    pixels = camera.project(rays)
    with np.errstate(divide='ignore'):
        z = distance / (rays @ normal)
    in_range = (z >= SENSOR.min_depth) & (z <= SENSOR.max_depth)
    is_ray = np.abs(camera.normalize(pixels) - rays[:, :2]).max(axis=1) < 1e-3
    cosines = np.abs(rays @ normal) / np.linalg.norm(rays, axis=1)

    def within(margin):
        size = camera.width - 1, camera.height - 1
        return is_ray & ((pixels >= margin) & (pixels <= np.array(size) - margin)).all(axis=1)
    return (eroded(in_image(within(CELL / 2) & in_range)) & in_image(cosines > 0.18),
            in_image(within(0) & in_range & (cosines > 0.16)))


def eroded(mask):
    """Return whether all cells around each cell are true, by brute force; false at the border."""
    rows, columns = mask.shape
    result = np.zeros_like(mask)
    for row in range(RADIUS, rows - RADIUS):
        for column in range(RADIUS, columns - RADIUS):
            result[row, column] = mask[row - RADIUS:row + RADIUS + 1,
                                       column - RADIUS:column + RADIUS + 1].all()
    return result


@pytest.mark.parametrize('camera', [PINHOLE, BARREL, FISHEYE], ids=['pinhole', 'barrel', 'fish'])
@pytest.mark.parametrize('normal', [(0, 0, 1), (0.5, 0.2, 0.8), (-0.1, 0.6, 0.6)])
def test_points_and_normals_of_a_plane(camera, normal):
    normal = np.array(normal) / np.linalg.norm(normal)
    surface = surface_of(plane_depth(camera, normal, 1.5), camera)
    must, may = seen_cells(surface.grid, camera, normal, 1.5)
    usable = in_image(surface.usable)
    assert must.mean() > 0.8 and usable[must].all() and not usable[~may].any()
    points, normals = surface.points[surface.usable], surface.normals[surface.usable]
    np.testing.assert_allclose(points @ normal, 1.5, atol=0.001)
    cosines = normals @ normal
    assert np.degrees(np.arccos(np.clip(cosines, -1, 1))).max() < 1
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)


@pytest.mark.parametrize('distance, is_usable', [
    (0.45, False), (0.55, True), (2.9, True), (3.1, False)])
def test_only_depths_in_the_range_of_the_sensor_are_usable(distance, is_usable):
    sensor = SensorSettings(min_depth=0.5, max_depth=3.0)
    surface = Surface.of(plane_depth(PINHOLE, (0, 0, 1.0), distance), PINHOLE, sensor, 1000)
    inside = in_image(surface.usable)[RADIUS:-RADIUS, RADIUS:-RADIUS]
    assert inside.all() if is_usable else not inside.any()


def test_a_plane_is_usable_where_a_ray_meets_it_at_ten_degrees_or_more():
    """A wall to the side: the cosine between ray and normal is 0 ahead, and grows outwards."""
    normal = np.array([0.96, 0.28, 0.0])
    surface = surface_of(plane_depth(PINHOLE, normal, 0.5))
    rays = surface.points / np.linalg.norm(surface.points, axis=1, keepdims=True)
    steep = in_image(rays @ normal)[RADIUS:-RADIUS, RADIUS:-RADIUS]
    usable = in_image(surface.usable)[RADIUS:-RADIUS, RADIUS:-RADIUS]
    assert usable[steep > 0.18].all() and not usable[steep < 0.16].any()
    assert usable.sum() > 1000 and (steep < 0.16).sum() > 500


@pytest.mark.parametrize('camera', [PINHOLE, BARREL], ids=['pinhole', 'barrel'])
def test_points_lie_on_the_rays_of_an_undistorted_camera(camera):
    surface = surface_of(plane_depth(camera, (0.2, 0.1, 1.0), 1.5), camera)
    v, u = np.indices((surface.grid.height, surface.grid.width)) * CELL + (CELL - 1) / 2
    rays = np.column_stack([(u.ravel() - camera.cx) / camera.fx,
                            (v.ravel() - camera.cy) / camera.fy])[surface.usable]
    points = surface.points[surface.usable]
    np.testing.assert_allclose(points[:, :2] / points[:, 2:], rays, atol=1e-6)


def test_edges_and_the_border_are_not_usable():
    depth = np.full((480, 640), 2.0, np.float32)
    depth[:, 320:] = 1.0
    usable = in_image(surface_of(depth).usable)
    left = np.zeros_like(usable)
    left[:, :320 // CELL] = True
    np.testing.assert_array_equal(usable, eroded(left) | eroded(~left))


def test_holes_and_depths_out_of_range_are_not_usable():
    depth = np.full((480, 640), 2.0, np.float32)
    holes = np.random.default_rng(0).integers((0, 0), (480, 640), (60, 2))
    for (v, u), value in zip(holes, 20 * [np.nan] + [0.01, 40.0] * 20):
        depth[v // CELL * CELL:, u // CELL * CELL:][:CELL, :CELL] = value
    whole = np.ones((120, 160), bool)
    whole[tuple(holes.T // CELL)] = False
    np.testing.assert_array_equal(in_image(surface_of(depth).usable), eroded(whole))


def test_grazing_angles_are_not_usable():
    normal = np.array([0.0, 1.0, 0.0])  # the floor
    surface = surface_of(plane_depth(PINHOLE, normal, 0.15))
    rays = rays_of(PINHOLE)[1::CELL, 1::CELL]
    angles = np.degrees(np.arccos(rays @ normal / np.linalg.norm(rays, axis=2)))
    usable = in_image(surface.usable)
    assert not usable[angles > 81].any()
    assert usable[RADIUS:-RADIUS, RADIUS:-RADIUS][
        (angles < 78)[RADIUS:-RADIUS, RADIUS:-RADIUS]].all()


def test_an_empty_image_has_no_usable_cells():
    surface = surface_of(np.full((480, 640), np.nan, np.float32))
    assert not surface.usable.any()
    assert len(surface.chosen) == 0


@pytest.mark.parametrize('axis', [0, 1])
def test_the_directions_of_a_small_box_are_chosen_beside_a_large_wall(axis):
    depth = plane_depth(PINHOLE, (0, 0, 1.0), 2.0)
    left, right = (plane_depth(PINHOLE, np.array([0.6 * sign * (axis == 0),
                                                  0.6 * sign * (axis == 1), 0.8]), 1.3)
                   for sign in (1, -1))
    box = np.zeros(depth.shape, bool)
    box[200:280, 280:360] = True
    depth = np.where(box, np.maximum(left, right), depth)
    surface = surface_of(depth, count=300)
    tilted = np.abs(surface.normals[:, axis]) > 0.3
    assert np.mean(tilted[surface.usable]) < 0.02
    chosen = tilted[surface.chosen]
    assert np.mean(chosen) > 0.3
    assert {-1, 1} == set(np.sign(surface.normals[surface.chosen][chosen, axis]))


@pytest.mark.parametrize('count', [10, 300, 3000, 100_000])
def test_chosen_cells_are_spread_over_the_image_up_to_the_count(count):
    surface = surface_of(plane_depth(PINHOLE, (0.2, 0.1, 1.0), 2.0), count=count)
    assert surface.usable[surface.chosen].all()
    assert len(set(surface.chosen)) == len(surface.chosen)
    assert len(surface.chosen) == min(count, np.count_nonzero(surface.usable))
    if count >= 300:
        row, column = np.divmod(surface.chosen, surface.grid.width)
        parts = np.bincount(row // 40 * 4 + column // 40, minlength=12)
        assert parts.min() > 0.5 * len(surface.chosen) / 12


def test_as_many_cells_may_be_spread_evenly_over_the_usable_ones():
    """The wall beside a small box gets its share of them."""
    depth = plane_depth(PINHOLE, (0, 0, 1.0), 2.0)
    box = np.zeros(depth.shape, bool)
    box[160:320, 240:400] = True
    depth = np.where(box, plane_depth(PINHOLE, (0.6, 0, 0.8), 1.3), depth)
    surface = surface_of(depth, count=300)
    even = surface.even
    assert surface.even is even and even.points is surface.points
    assert len(even.chosen) == len(surface.chosen) == len(set(even.chosen.tolist()))
    assert (np.diff(even.chosen) > 0).all() and surface.usable[even.chosen].all()
    tilted = surface.normals[:, 0] > 0.3
    share = np.mean(tilted[surface.usable])
    assert np.mean(tilted[even.chosen]) == pytest.approx(share, abs=0.06)
    assert np.mean(tilted[surface.chosen]) > 3 * share


def test_all_usable_cells_may_be_few():
    surface = surface_of(plane_depth(PINHOLE, (0, 0, 1.0), 2.0), count=100_000)
    np.testing.assert_array_equal(surface.even.chosen, surface.chosen)


def test_the_share_of_cells_that_face_as_a_normal_does():
    ways = np.array([(0.12, 0.12, 0.9855), (0.62, 0.12, 0.7754)])
    depth, other = (plane_depth(PINHOLE, way, distance)
                    for way, distance in zip(ways, (2.0, 1.3)))
    depth[:, 480:] = other[:, 480:]
    surface = surface_of(depth)
    share = np.mean(surface.normals[surface.usable, 0] > 0.3)
    assert 0.1 < share < 0.4
    found = surface.shares_facing(np.array([*ways, (0.0, -0.9, 0.1)]))
    np.testing.assert_allclose(found, [1 - share, share, 0.0], atol=1e-9)
    empty = surface_of(np.full((480, 640), np.nan, np.float32))
    assert empty.shares_facing(np.array([(0.0, 0.0, 1.0)])).tolist() == [0.0]


def test_the_count_is_nearly_reached_on_a_surface_of_all_directions():
    rays = rays_of(PINHOLE)
    across = np.linalg.norm(np.cross(rays, (0, 0, 2.0)), axis=2) / np.linalg.norm(rays, axis=2)
    with np.errstate(invalid='ignore'):  # a ball of 0.7 m radius, 2 m away
        length = (2 * rays[..., 2] / np.linalg.norm(rays, axis=2) - np.sqrt(0.49 - across ** 2))
    depth = (length / np.linalg.norm(rays, axis=2)).astype(np.float32)
    surface = surface_of(depth, count=1000)
    assert np.count_nonzero(surface.usable) > 3000
    assert 900 < len(surface.chosen) <= 1000
    outwards = surface.points - (0, 0, 2.0)
    outwards /= -np.linalg.norm(outwards, axis=1, keepdims=True)
    cosines = np.einsum('ij,ij->i', outwards, surface.normals)[surface.usable]
    assert np.degrees(np.arccos(np.clip(cosines, -1, 1))).max() < 3


def test_cells_at_is_projection_by_brute_force():
    depth = np.full((480, 640), 2.0, np.float32)
    depth[100:300, 200:400] = np.nan
    surface = surface_of(depth)
    rng = np.random.default_rng(1)
    points = rng.uniform((-3, -3, -1), (3, 3, 3), (3000, 3))
    points[:3] = (0, 0, 0), (1, 1, 0), (np.nan, 0, 1)
    expected = []
    for index, (x, y, z) in enumerate(points):
        if not z > 0:
            continue
        u, v = x / z * PINHOLE.fx + PINHOLE.cx, y / z * PINHOLE.fy + PINHOLE.cy
        column, row = np.floor((u + 0.5) / CELL), np.floor((v + 0.5) / CELL)
        if 0 <= column < 160 and 0 <= row < 120 and surface.usable[int(row * 160 + column)]:
            expected.append((index, int(row * 160 + column)))
    assert len(expected) > 100
    np.testing.assert_array_equal(np.column_stack(surface.cells_at(points)), expected)


def test_the_roughness_is_the_deviation_from_the_plane():
    """Columns of cells lie before and behind a tilted plane in turn."""
    inverse = 1 / plane_depth(PINHOLE, np.array([0.3, 0.1, 0.95]), 2.0)
    relief = 0.002 * (-1.0) ** (np.arange(PINHOLE.width) // CELL)
    surface = surface_of((1 / (inverse + relief)).astype(np.float32))
    signs = (-1.0) ** np.arange(2 * RADIUS + 1)
    ramp = np.arange(-RADIUS, RADIUS + 1)
    fit = signs.mean() + ramp * (ramp @ signs) / (ramp @ ramp)
    np.testing.assert_allclose(surface.roughness[surface.usable],
                               0.002 * np.std(signs - fit), rtol=0.02)


@pytest.mark.parametrize('exponent', [0.0, 0.5, 1.0])
def test_the_roughness_threshold_follows_the_noise_at_that_depth(exponent):
    """The inverse depth of time of flight is far noisier at short range than at long range."""
    def usable(distance, step=0.0):
        sensor = SensorSettings(depth_sigma=0.01, depth_exponent=exponent)
        depth = np.full((480, 640), distance)
        depth[:, 320:] += step
        noise = np.random.default_rng(3).normal(size=depth.shape)
        depth += sensor.depth_sigma * depth ** exponent * noise
        return in_image(Surface.of(np.float32(depth), PINHOLE, sensor, 1000).usable)

    whole = slice(RADIUS, -RADIUS)
    assert usable(0.15)[whole, whole].all()
    beside = 320 // CELL
    # the residual of a fit over a step is a fifth of it; eight standard deviations are allowed
    stepped = usable(4.0, step=60 * 0.01 * 4.0 ** exponent)[whole]
    assert not stepped[:, beside - 1:beside + 1].any()
    assert stepped[:, RADIUS:beside - RADIUS].all()


@pytest.mark.parametrize('index', [0, 50])
def test_time_of_flight_depth_across_edges_is_not_usable(index):
    """
    In a rendered room with depth at all edges: averages across them lie on no surface.

    Of what is usable without noise, noise takes next to nothing, and it adds nothing.
    """
    room = SyntheticSource(SyntheticOptions.perfect(seed=6, frames=100, camera=PINHOLE))
    sensor = SensorSettings(depth_sigma=0.005, depth_exponent=0.5)
    depth = room.frame(index).depth
    sigma = sensor.depth_sigma * depth ** sensor.depth_exponent
    noise = np.random.default_rng(index).normal(size=depth.shape)
    surface = Surface.of(np.float32(depth + sigma * noise), PINHOLE, sensor, 1000)
    error = np.abs(surface.points[:, 2] - depth[2::CELL, 2::CELL].ravel())
    without = Surface.of(depth, PINHOLE, sensor, 1000).usable
    assert np.mean(surface.usable[without]) > 0.99 and np.mean(without) > 0.5
    assert np.mean(without[surface.usable]) > 0.995
    assert np.mean((error > 8 * sigma[2::CELL, 2::CELL].ravel())[surface.usable]) < 0.04


@pytest.mark.parametrize('factor', [1.0, 3.0])
def test_a_fold_is_as_rough_as_the_noise_of_the_camera_lets_it_seem(factor):
    """Two walls that meet at a slight angle: where both are in a fit, it is no plane."""
    sensor = SensorSettings()
    rng = np.random.default_rng(5)
    ray = (np.arange(640) - 319.5) / 525.0

    def usable(rise):  # of the inverse depth along the second wall, from one cell to the next
        inverse = 0.5 + rise * np.maximum(ray, 0.0) * 525.0 / CELL
        noise = factor * sensor.depth_sigma * rng.normal(size=(480, 640))
        surface = Surface.of(np.float32(1 / (inverse + noise)), PINHOLE, sensor, 1000)
        return in_image(surface.usable)[RADIUS:-RADIUS]

    # a fold by one between cells leaves .3 of it as the residual; cells average sixteen pixels
    assert usable(4 * factor * sensor.depth_sigma)[:, 640 // CELL // 2].mean() < 0.1
    assert usable(0.0)[:, RADIUS:-RADIUS].mean() > 0.99


def test_a_precise_sensor_keeps_a_near_plane():
    """Rounding of float32, large in the squares of large inverse depths, is not roughness."""
    sensor = SensorSettings(depth_sigma=2e-6)
    depth = plane_depth(PINHOLE, np.array((0.0002, 0.0001, 1.0)), 0.2)
    usable = in_image(Surface.of(depth, PINHOLE, sensor, 1000).usable)
    assert usable[RADIUS:-RADIUS, RADIUS:-RADIUS].all()


@pytest.mark.parametrize('width, height', [(1, 1), (640, 3), (3, 480)])
def test_an_image_smaller_than_a_cell_is_rejected(width, height):
    camera = Camera(width, height, 500.0, 500.0, 0.0, 0.0)
    with pytest.raises(InputError, match=f'{width} x {height} pixels: at least 4 x 4 are'):
        Surface.of(np.ones((height, width), np.float32), camera, SensorSettings(), 10)


@pytest.mark.parametrize('shape', [(5, 5), (6, 11), (30, 40)])
def test_planes_are_those_of_least_squares(shape):
    """Of the 25 inverse depths about each cell; of a cell without depth and of the border none."""
    rng = np.random.default_rng(0)
    inverse = (0.5 + 0.1 * rng.random(shape)).astype(np.float32)
    inverse[0, 0], intrinsics = np.nan, np.array([50.0, 60.0, 7.0, 5.0])
    points, normals = np.full((2, inverse.size, 3), 9, np.float32)
    roughness, cosines = np.full((2, inverse.size), 9, np.float32)
    kernels.fit_planes(inverse, intrinsics, points, normals, roughness, cosines)
    v, u = np.mgrid[-2:3, -2:3].reshape(2, -1)
    for y, x in np.ndindex(shape):
        cell, around = y * shape[1] + x, inverse[max(y - 2, 0):y + 3, max(x - 2, 0):x + 3]
        if around.size < 25 or not np.isfinite(around).all():
            assert np.isnan([roughness[cell], cosines[cell], *points[cell], *normals[cell]]).all()
            continue
        rays = np.column_stack([(x + u - 7) / 50, (y + v - 5) / 60, np.ones(25)])
        plane, squares, *_ = np.linalg.lstsq(rays, around.ravel(), rcond=None)
        normal, ray = plane / np.linalg.norm(plane), rays[12]
        np.testing.assert_allclose(normals[cell], normal, atol=1e-5)
        np.testing.assert_allclose(points[cell], ray / (ray @ plane), rtol=1e-5)
        assert roughness[cell] == pytest.approx(np.sqrt(squares[0] / 25), rel=1e-5)
        assert cosines[cell] == pytest.approx(normal @ ray / np.linalg.norm(ray), abs=1e-5)


@pytest.mark.parametrize('side', [1, 2, 3, 4, 5])
def test_cells_have_the_mean_of_their_inverse_depths(side):
    rng = np.random.default_rng(side)
    depth = rng.uniform(0.5, 4.0, (23, 31)).astype(np.float32)
    depth[0, 0], depth[9:11, 7] = np.nan, 0.0
    height, width = 23 // side, 31 // side
    found = np.empty((height, width), np.float32)
    kernels.mean_inverse_depths(depth, side, 0.3, 1.5, found)
    with np.errstate(divide='ignore'):
        inverse = (1 / depth[:height * side, :width * side].astype(float)).reshape(
            height, side, width, side)
    mean = inverse.mean(axis=(1, 3))
    with np.errstate(invalid='ignore'):
        whole = np.isfinite(mean)
        mean[~((mean >= 0.3) & (mean <= 1.5))] = np.nan
    np.testing.assert_allclose(found[whole], mean[whole], rtol=1e-6)
    assert np.isnan(found[0, 0]) and np.isfinite(found).sum() > 10


def mean_inverse_depths(depth, side):
    found = np.empty((depth.shape[0] // side, depth.shape[1] // side), np.float32)
    kernels.mean_inverse_depths(depth.astype(np.float32), side, 0.1, 9.0, found)
    return found


def slanted(height, width):
    """Return a plane: inverse depths, HxW."""
    v, u = np.indices((height, width))
    return 0.5 + 0.01 * u - 0.004 * v


@pytest.mark.parametrize('side', [2, 3, 4])
@pytest.mark.parametrize('invalid', [np.nan, 0.0])
def test_pixels_that_are_invalid_by_themselves_leave_a_cell_what_it_is(side, invalid):
    inverse = slanted(24, 36)
    depth, whole = 1 / inverse, mean_inverse_depths(1 / inverse, side)
    for row, column in ((13, 13), (0, 5), (8, 35), (9, 22), (10, 23)):  # two of them touch
        depth[row, column] = invalid
    np.testing.assert_allclose(mean_inverse_depths(depth, side), whole, rtol=1e-6)


@pytest.mark.parametrize('share, planes', [(0.01, 0.95), (0.05, 0.8), (0.1, 0.5)])
def test_a_surface_remains_where_single_pixels_are_missing(share, planes):
    """The others are exact, so that its planes are the same."""
    depth = np.broadcast_to(1 / (0.3 + 0.0005 * np.arange(640)), (480, 640)).astype(np.float32)
    missing = np.random.default_rng(0).random(depth.shape) < share
    whole, some = surface_of(depth), surface_of(np.where(missing, np.float32(np.nan), depth))
    assert some.usable.sum() > planes * whole.usable.sum()
    both = some.usable & whole.usable
    np.testing.assert_allclose(some.points[both], whole.points[both], rtol=1e-5)
    np.testing.assert_allclose(some.normals[both], whole.normals[both], atol=1e-3)


def test_the_cells_about_a_hole_have_no_depth():
    depth = 1 / slanted(24, 24)
    depth[7:14, 9:16] = np.nan  # more than half of the cells about it are valid
    found = np.isnan(mean_inverse_depths(depth, 4))
    expected = np.zeros((6, 6), bool)
    expected[1:4, 2:4] = True
    np.testing.assert_array_equal(found, expected)


def test_a_cell_of_which_less_than_half_is_left_has_no_depth():
    depth = 1 / slanted(12, 12)
    depth[4:8:2, 4:8] = np.nan  # two rows of four, each beside valid ones
    assert np.isnan(mean_inverse_depths(depth, 4)[1, 1])
    depth[4:8, 4:8] = 1 / slanted(12, 12)[4:8, 4:8]
    depth[4, 4] = depth[5, 6] = depth[7, 5] = np.nan  # with their mirror images six of sixteen
    assert np.isfinite(mean_inverse_depths(depth, 4)).all()
    depth[6, 6] = depth[7, 7] = np.nan
    assert np.isfinite(mean_inverse_depths(depth, 4)[1, 1])  # mirror images of those before


def test_arrays_that_are_not_of_the_cells_are_rejected():
    depth, inverse = np.ones((8, 8), np.float32), np.ones((6, 7), np.float32)
    with pytest.raises(ValueError, match='^the image has fewer cells than that$'):
        kernels.mean_inverse_depths(depth, 4, 0.1, 9.0, np.empty((2, 3), np.float32))
    with pytest.raises(ValueError, match='^the image has fewer cells than that$'):
        kernels.mean_inverse_depths(depth, 0, 0.1, 9.0, np.empty((2, 2), np.float32))
    vectors, numbers = np.empty((2, 41, 3), np.float32), np.empty((2, 41), np.float32)
    with pytest.raises(ValueError, match='^there are not as many planes as cells$'):
        kernels.fit_planes(inverse, np.ones(4), *vectors, *numbers)
    for order in (-1, 2):
        with pytest.raises(ValueError, match='^a number of the order is not that of a cell$'):
            kernels.choose_cells(np.array([1, order]), np.zeros(2, np.uint8), np.array([2]), 1,
                                 np.empty(2, bool))
    for most in (-1, 1 << 62):
        with pytest.raises(ValueError, match='^the number of cells to choose is out of range$'):
            kernels.choose_cells(np.array([0]), np.zeros(1, np.uint8), np.array([1]), most,
                                 np.empty(1, bool))
    for across in (0, 16, 1 << 30):
        with pytest.raises(ValueError, match='^the buckets are too many for their numbers$'):
            kernels.normal_buckets(np.zeros((2, 3), np.float32), np.ones(2, bool), across,
                                   np.empty(2, np.uint8), np.zeros(256, np.int64))


def test_normals_are_counted_by_their_direction():
    """Of the corners of the square of x and y, and its middle; of cells that are usable."""
    normals = np.float32([(-1, -1, 0), (1, -1, 0), (-1, 1, 0), (1, 1, 0), (0.01, 0.01, 1),
                          (0.01, 0.01, 1), (np.nan, 0, 0)])
    buckets, sizes = np.empty(7, np.uint8), np.zeros(16, np.int64)
    usable = np.array([True] * 5 + [False, True])
    kernels.normal_buckets(normals, usable, 4, buckets, sizes)
    assert buckets.tolist() == [0, 12, 3, 15, 10, 255, 255]
    assert np.flatnonzero(sizes == 1).tolist() == [0, 3, 10, 12, 15] and sizes.sum() == 5


@pytest.mark.parametrize('count', [0, 1, 255, 256, 1000])
def test_between_four_cells_it_is_interpolated(count):
    """Exactly, on planes; NaN beside a missing one, and where there are not four."""
    rng = np.random.default_rng(count)
    rows, columns = np.indices((9, 12), np.float32)
    values = 3.0 + 0.5 * columns - 0.25 * rows
    values[4, 7] = np.nan
    places = rng.uniform((-1, -1), (12, 9), (count, 2)).astype(np.float32)
    places[::17] = np.round(places[::17])
    places[3::19] = rng.choice([np.nan, np.inf, -np.inf, 1e30, 11, 8, -0.0], places[3::19].shape)
    u, v = np.ascontiguousarray(places.T)
    found = np.empty(count, np.float32)
    kernels.interpolate(values, u, v, found)
    between = (u >= 0) & (u < 11) & (v >= 0) & (v < 8)
    known = between & ~((abs(np.floor(u) - 6.5) < 1) & (abs(np.floor(v) - 3.5) < 1))
    np.testing.assert_allclose(found[known], 3.0 + 0.5 * u[known] - 0.25 * v[known], atol=1e-5)
    assert np.isnan(found[~known]).all() and known.sum() >= count // 2


def test_one_row_of_cells_cannot_be_interpolated_between():
    place = np.zeros(1, np.float32)
    for shape in ((1, 5), (5, 1)):
        with pytest.raises(ValueError, match='^the values are too few or too many to interpolate'):
            kernels.interpolate(np.zeros(shape, np.float32), place, place, place.copy())


@pytest.mark.parametrize('height, width', [(1, 1), (2, 3), (31, 48), (30, 47)])
@pytest.mark.parametrize('share', [0.0, 0.2, 1.0])
@pytest.mark.parametrize('exponent', [0.0, -0.5])
@pytest.mark.parametrize('bounds', [(1.0, 8.0), (0.1, 0.4), (3.0, 99.0)])
def test_planes_are_as_smooth_as_most_of_the_smoothest_cells(height, width, share, exponent,
                                                             bounds):
    """By the quantiles of every second row and column; where there is none all are allowed."""
    rng = np.random.default_rng(height)
    count = height * width
    points = rng.uniform(0.5, 3.0, (count, 3)).astype(np.float32)
    cosines = rng.uniform(0.0, 1.0, count).astype(np.float32)
    roughness = rng.gamma(1.0, 0.002, (height, width)).astype(np.float32)
    missing = rng.random((height, width)) < share
    roughness[missing] = rng.choice([np.nan, np.inf], missing.sum())
    relative = roughness.ravel() / (0.002 * points[:, 2].astype(float) ** exponent)
    grid = relative.reshape(height, width)[::2, ::2]
    finite = np.sort(grid[np.isfinite(grid)])
    largest = bounds[1]
    if len(finite):
        largest = np.clip(min(8.0 * finite[len(finite) // 10], 4.0 * finite[len(finite) // 4]),
                          *bounds)
    smooth = np.empty(count, bool)
    kernels.smooth_cells(points, roughness, cosines, np.array([0.002, exponent]), 8.0, 4.0,
                         *bounds, 0.17, smooth)
    clear = np.abs(relative - largest) > 1e-4
    expected = (relative < largest) & (cosines > 0.17)
    np.testing.assert_array_equal(smooth[clear], expected[clear])


def test_cells_have_a_roughness_each():
    with pytest.raises(ValueError, match='^there are not as many cells as their roughness'):
        kernels.smooth_cells(np.ones((5, 3), np.float32), np.ones((2, 3), np.float32),
                             np.ones(5, np.float32), np.ones(2), 8.0, 4.0, 1.0, 8.0, 0.2,
                             np.empty(5, bool))


def test_the_noise_of_cells_is_a_factor_and_an_exponent():
    cells = np.ones((4, 3), np.float32), np.ones((2, 2), np.float32), np.ones(4, np.float32)
    with pytest.raises(ValueError, match='the noise of depth has 3 numbers: 2 are required'):
        kernels.smooth_cells(*cells, np.ones(3), 8.0, 4.0, 1.0, 8.0, 0.2, np.empty(4, bool))


def test_the_first_of_each_bucket_in_the_order_are_chosen():
    rng = np.random.default_rng(0)
    buckets, order = rng.choice([*range(15), 255], 300).astype(np.uint8), rng.permutation(300)
    chosen, taken = np.empty(300, bool), {255: 7}
    kernels.choose_cells(order, buckets, np.full(15, 10), 7 * 15, chosen)
    for cell in order:
        assert chosen[cell] == (taken.get(buckets[cell], 0) < 7)
        taken[buckets[cell]] = taken.get(buckets[cell], 0) + 1


def test_the_quota_of_the_buckets_is_the_largest_within_the_count():
    rng = np.random.default_rng(0)
    for _ in range(200):
        sizes = rng.integers(0, rng.integers(2, 60), rng.integers(2, 64))
        count = int(rng.integers(0, max(sizes.sum(), 1)))
        buckets = np.repeat(np.arange(len(sizes), dtype=np.uint8), sizes)
        chosen = np.empty(len(buckets), bool)
        kernels.choose_cells(np.arange(len(buckets)), buckets, sizes, count, chosen)
        contributed = np.bincount(buckets[chosen], minlength=len(sizes))
        quota = contributed.max()
        np.testing.assert_array_equal(contributed, np.minimum(sizes, quota))
        assert chosen.sum() <= count
        assert np.minimum(sizes, quota + 1).sum() > count or sizes.sum() == 0


def test_points_on_the_first_and_last_cells_are_in_view():
    """On a surface of cells that are all usable: those of images have a border that is not."""
    grid = surface_of(plane_depth(PINHOLE, (0, 0, 1), 2.0)).grid
    count = grid.width * grid.height
    surface = Surface(grid, np.zeros((count, 3)), np.zeros((count, 3)), np.ones(count, bool),
                      np.arange(0), np.zeros(count))
    x, y = grid.rays
    points = np.column_stack([np.tile(x[0], grid.height), np.repeat(y[:, 0], grid.width),
                              np.ones(count)])
    for beyond in ([0, 0], [-0.4, 0.4], [0.4, -0.4]):  # cells, less than half of one
        moved = points + np.array([beyond[0] / grid.fx, beyond[1] / grid.fy, 0.0])
        np.testing.assert_array_equal(surface.cells_at(3.0 * moved), 2 * [np.arange(count)])
    for outside in ([-1, 0], [grid.width, 0], [0, -1], [0, grid.height]):
        ray = [(outside[0] - grid.cx) / grid.fx, (outside[1] - grid.cy) / grid.fy, 1.0]
        assert not len(surface.cells_at(np.array([ray]))[0])


@pytest.mark.parametrize('width, side', [
    (1920, 4), (640, 4), (481, 4), (480, 3), (424, 3), (320, 2), (161, 2), (160, 1), (4, 1)])
def test_cells_are_smaller_in_small_images(width, side):
    assert cell_of(Camera(width, width, 500.0, 500.0, 0.0, 0.0)) == side


@pytest.mark.parametrize('factor', [2, 4])
def test_a_camera_with_fewer_pixels_sees_as_many_planes(factor):
    """A wall with a step every 20th of the view: larger cells would be of both sides."""
    depth = np.where(np.indices((480, 640))[1] // 32 % 2, 2.0, 2.3).astype(np.float32)
    small = Camera(640 // factor, 480 // factor, 525.0 / factor, 525.0 / factor,
                   319.5 / factor, 239.5 / factor)
    all_of_it, seen = (Surface.of(image, camera, SENSOR, 2000).usable for image, camera in (
        (depth, PINHOLE), (depth[::factor, ::factor].copy(), small)))
    assert seen.size == all_of_it.size and seen.sum() > 0.9 * all_of_it.sum() > 0


@pytest.mark.parametrize('cell', [2, 4, 8])
def test_a_cell_is_the_mean_of_its_pixels_at_its_centre(cell):
    """On a plane, with cells of any size; pixels left over at the right and below have none."""
    camera = Camera(103, 71, 90.0, 95.0, 50.0, 34.0)
    normal = np.array([0.2, -0.1, 1.0]) / np.linalg.norm([0.2, -0.1, 1.0])
    surface = Surface.of(plane_depth(camera, normal, 1.2), camera, SENSOR, 1000, cell)
    grid = surface.grid
    assert (grid.width, grid.height) == (103 // cell, 71 // cell)
    usable = surface.usable
    assert usable.sum() == (grid.width - 2 * RADIUS) * (grid.height - 2 * RADIUS)
    np.testing.assert_allclose(surface.points[usable] @ normal, 1.2, rtol=1e-4)
    v, u = np.indices((grid.height, grid.width)).reshape(2, -1) * cell + (cell - 1) / 2
    seen = camera.project(surface.points[usable].astype(float))
    np.testing.assert_allclose(seen, np.column_stack([u, v])[usable], atol=1e-2)


def folded(rise):
    """Return the depth of two walls that meet at a slight angle in the middle of the image."""
    beyond = np.maximum(np.arange(640) - 319.5, 0.0) / CELL
    return np.float32(1 / np.tile(0.5 + rise * beyond, (480, 1)))


@pytest.mark.parametrize('factor, is_usable', [(0.9, True), (1.1, False)])
def test_a_fold_without_noise_is_as_rough_as_one_deviation_of_the_sensor(factor, is_usable):
    ramp = np.arange(-RADIUS, RADIUS + 1)
    fold = np.maximum(ramp + 0.5, 0.0)  # between two cells, or mirrored
    residual = np.std(fold - fold.mean() - ramp * (ramp @ fold) / (ramp @ ramp))
    sensor = SensorSettings(depth_sigma=1e-4)
    depth = folded(factor * sensor.depth_sigma / residual)
    surface = Surface.of(depth, PINHOLE, sensor, 1000)
    usable = in_image(surface.usable)[RADIUS:-RADIUS, RADIUS:-RADIUS]
    middle = 640 // CELL // 2 - RADIUS
    at_fold = usable[:, middle - 1:middle + 1]
    assert at_fold.all() if is_usable else not at_fold.any()
    assert usable[:, :middle - 3].all() and usable[:, middle + 3:].all()


def test_normals_point_away_from_the_camera():
    surface = surface_of(plane_depth(PINHOLE, np.array([0.5, 0.2, 0.8]), 1.5))
    assert (np.einsum('ij,ij->i', surface.normals, surface.points)[surface.usable] > 0).all()


@pytest.mark.parametrize('first, smooth, ratio, is_usable', [
    (100, 1.5, 3.9, True), (100, 1.5, 4.1, False), (30, 0.25, 7.9, True), (30, 0.25, 8.1, False),
    (100, 4.0, 1.95, True), (100, 4.0, 2.05, False)])
def test_a_plane_may_be_as_many_times_as_rough_as_the_smoothest_ones(
        first, smooth, ratio, is_usable):
    """
    Four times as a quarter, eight times as a tenth of the cells; at most eight times the noise.

    Columns of cells lie before and behind a wall in turn, on the right further off it.
    """
    signs = (-1.0) ** np.arange(2 * RADIUS + 1)
    roughness = np.std(signs - signs.mean())
    column = np.arange(PINHOLE.width) // CELL
    relief = smooth * SENSOR.depth_sigma / roughness * (-1.0) ** column
    relief[column >= first] *= ratio
    depth = np.tile(1 / (0.5 + relief), (PINHOLE.height, 1)).astype(np.float32)
    usable = in_image(surface_of(depth).usable)[RADIUS:-RADIUS]
    assert usable[:, RADIUS:first - RADIUS].all()
    beyond = usable[:, first + RADIUS:-RADIUS]
    assert beyond.all() if is_usable else not beyond.any()


def test_rays_that_the_model_folds_back_into_the_image_have_no_surface():
    """Beyond the largest radius that the polynomial has, in closed form."""
    camera = Camera(640, 480, 300, 300, 319.5, 239.5, 'plumb_bob', (-0.4, 0.05, 0.0, 0.0, 0.0))
    surface = Surface.of(np.full((480, 640), 2.0, np.float32), camera, SENSOR, 1000)
    radius = np.hypot(*np.broadcast_arrays(*surface.grid.rays)).ravel()
    largest = np.sqrt((1.2 - np.sqrt(1.44 - 1.0)) / 0.5)  # where the derivative of r' is zero
    folded = radius > largest + 0.02
    assert folded.mean() > 0.05 and not surface.usable[folded].any()
    assert surface.usable[radius < 0.7].all()


def test_a_sensor_without_a_least_depth_measures_from_a_millimetre_on():
    sensor = SensorSettings(min_depth=0.0, depth_sigma=1e-6)
    for distance, is_usable in ((2.0, True), (0.0011, True), (0.0009, False), (0.0, False)):
        surface = Surface.of(np.full((480, 640), distance, np.float32), PINHOLE, sensor, 1000)
        usable = in_image(surface.usable)[RADIUS:-RADIUS, RADIUS:-RADIUS]
        assert usable.all() if is_usable else not usable.any()
