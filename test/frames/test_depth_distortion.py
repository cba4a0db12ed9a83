# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

import copy
import dataclasses
import itertools
import pickle

import numpy as np
import pytest

from aick_ros import kernels
from aick_ros.frames.depth_distortion import (
    COLUMNS, NO_DISTORTION, ROWS, DepthDistortion, have_same_nodes, nodes_around)
from aick_ros.geometry.camera import Camera

CAMERA = Camera(60, 48, 50.0, 52.0, 29.0, 24.5)
LENS = Camera(60, 48, 50.0, 52.0, 29.0, 24.5, 'plumb_bob', (-0.3, 0.1, 0.01, -0.02, 0.0))


def pixels():
    """Return the coordinates of all pixels, HxW each."""
    return np.meshgrid(np.arange(CAMERA.width, dtype=float), np.arange(CAMERA.height, dtype=float))


def seen_at(u, v, camera=CAMERA, z=1.7):
    """Return points at a depth that project to pixels, Nx3."""
    return camera.back_project(np.column_stack([u, v]), np.full(len(u), z))


def inclined(a, b, c):
    """Return the distortion linear over the image: a at its first pixel, b by u, c by v."""
    rows, columns = np.mgrid[:ROWS, :COLUMNS]
    return DepthDistortion(a + b * columns * (CAMERA.width - 1) / (COLUMNS - 1)
                           + c * rows * (CAMERA.height - 1) / (ROWS - 1))


def random_one(seed=0, sigma=0.01):
    """Return a distortion without any order."""
    return DepthDistortion(np.random.default_rng(seed).normal(0, sigma, (ROWS, COLUMNS)))


class TestDepthImage:
    """A depth image without its distortion."""

    def test_inverse_depth_gains_what_is_missing(self):
        u, v = pixels()
        depth = np.random.default_rng(1).uniform(0.4, 6.0, u.shape).astype(np.float32)
        corrected = inclined(0.01, 2e-4, -3e-4).undistorted(depth)
        expected = 1.0 / (1.0 / depth.astype(float) + 0.01 + 2e-4 * u - 3e-4 * v)
        np.testing.assert_allclose(corrected, expected, rtol=2e-6)
        assert corrected.dtype == np.float32

    def test_is_bilinear_between_the_nodes(self):
        random = random_one()
        corrected = random.undistorted(np.ones((CAMERA.height, CAMERA.width), np.float32))
        found = 1.0 / corrected.astype(float) - 1.0
        u = np.linspace(0, CAMERA.width - 1, COLUMNS)
        v = np.linspace(0, CAMERA.height - 1, ROWS)
        rows = np.stack([np.interp(np.arange(CAMERA.width), u, row) for row in random.nodes])
        expected = np.stack([np.interp(np.arange(CAMERA.height), v, column) for column in rows.T])
        np.testing.assert_allclose(found, expected.T, atol=2e-6)

    def test_what_is_no_depth_stays_none(self):
        depth = np.full((48, 60), 1.5, np.float32)
        depth[3, 4], depth[5, 6] = np.nan, 0.0
        corrected = random_one().undistorted(depth)
        assert np.isnan(corrected[3, 4])
        assert corrected[5, 6] == 0.0
        assert np.count_nonzero(np.isfinite(corrected)) == depth.size - 1

    def test_each_pixel_lacks_its_own_inverse_depth(self):
        depth = np.random.default_rng(2).uniform(0.3, 8.0, (47, 61)).astype(np.float32)
        missing = 1.0 / random_one().undistorted(np.ones_like(depth)).astype(float) - 1.0
        assert np.ptp(missing) > 1e-3
        np.testing.assert_allclose(1.0 / random_one().undistorted(depth).astype(float),
                                   1.0 / depth.astype(float) + missing, rtol=1e-6)

    def test_images_of_another_size_are_refused(self):
        images = [np.ones(shape, np.float32) for shape in ((4, 6), (4, 5), (6, 4))]
        for first, second in itertools.permutations(images, 2):
            with pytest.raises(ValueError, match='not of the same size'):
                kernels.undistort_depth(first, np.ones((2, 2)), 0.5, second)

    @pytest.mark.parametrize('shape', [(1, 2), (2, 1)])
    def test_less_than_four_nodes_are_refused(self, shape):
        image = np.ones((4, 6), np.float32)
        with pytest.raises(ValueError, match='less than 2 x 2 nodes'):
            kernels.undistort_depth(image, np.ones(shape), 0.5, image.copy())

    @pytest.mark.parametrize('shape', [(1, 1), (1, 61), (47, 1), (2, 3), (5, 6), (6, 11)])
    def test_images_hardly_larger_than_the_grid_are_bilinear_too(self, shape):
        """The first and last pixels of a side lie on nodes; a single one on the first."""
        random = random_one()
        corrected = random.undistorted(np.ones(shape, np.float32))
        rows, columns = (np.linspace(0, nodes - 1, count)
                         for nodes, count in zip((ROWS, COLUMNS), shape))
        along = np.stack([np.interp(columns, np.arange(COLUMNS), row) for row in random.nodes])
        expected = np.stack([np.interp(rows, np.arange(ROWS), column) for column in along.T]).T
        np.testing.assert_allclose(1.0 / corrected.astype(float) - 1.0, expected, atol=2e-7)

    def test_far_depth_does_not_end_up_behind_the_camera(self):
        depth = np.full((48, 60), 1000.0, np.float32)
        corrected = DepthDistortion(np.full((ROWS, COLUMNS), -0.01)).undistorted(depth)
        assert (corrected > 1000.0).all()

    def test_nothing_changes_without_distortion(self):
        depth = np.ones((48, 60), np.float32)
        assert NO_DISTORTION.undistorted(depth) is depth

    def test_the_image_given_stays_and_the_one_returned_cannot_be_changed(self):
        depth = np.full((48, 60), 1.5, np.float32)
        corrected = random_one().undistorted(depth)
        assert (depth == 1.5).all()
        with pytest.raises(ValueError, match='read-only'):
            corrected[0, 0] = 1.0

    def test_images_of_two_sizes_are_corrected_alike(self):
        """As they are by a camera that changes its resolution."""
        random = random_one(2)
        small, large = (random.undistorted(np.ones(shape, np.float32))
                        for shape in ((48, 60), (95, 119)))
        np.testing.assert_allclose(large[::2, ::2], small, rtol=1e-6)
        np.testing.assert_array_equal(random.undistorted(np.ones((48, 60), np.float32)), small)


class TestNodeWeights:
    """The weights of the nodes where points are seen."""

    @pytest.mark.parametrize('camera', [CAMERA, LENS])
    def test_they_interpolate_what_the_image_has(self, camera):
        random = random_one(3)
        rng = np.random.default_rng(4)
        u, v = rng.integers(0, CAMERA.width, 200), rng.integers(0, CAMERA.height, 200)
        image = 1.0 / random.undistorted(np.ones((48, 60), np.float32)).astype(float) - 1.0
        np.testing.assert_allclose(random.at(seen_at(u, v, camera), camera), image[v, u],
                                   atol=1e-5)

    def test_they_are_those_of_the_four_nodes_around_and_sum_up_to_one(self):
        rng = np.random.default_rng(5)
        u, v = rng.uniform(0, 59, 100), rng.uniform(0, 47, 100)
        nodes, weights = nodes_around(seen_at(u, v), CAMERA)
        np.testing.assert_allclose(weights.sum(axis=1), 1.0)
        assert (weights >= 0).all()
        rows, columns = np.divmod(nodes, COLUMNS)
        np.testing.assert_allclose((weights * columns).sum(axis=1) * 59 / (COLUMNS - 1), u)
        np.testing.assert_allclose((weights * rows).sum(axis=1) * 47 / (ROWS - 1), v)
        assert (np.ptp(rows, axis=1) == 1).all() and (np.ptp(columns, axis=1) == 1).all()

    def test_beside_the_image_its_border_counts(self):
        outside = seen_at(np.array([-20.0, 90.0]), np.array([-9.0, 70.0]))
        corners = random_one(6)
        np.testing.assert_allclose(corners.at(outside, CAMERA),
                                   [corners.nodes[0, 0], corners.nodes[-1, -1]])


class TestSameNodes:
    """Whether the nodes of two cameras lie on the same rays."""

    @pytest.mark.parametrize('other, are_same', [
        (CAMERA, True), (Camera(60, 48, 50.4, 52.4, 29.2, 24.6), True),
        (Camera(120, 96, 100.0, 104.0, 58.5, 49.5), True),
        (Camera(50, 40, 50.0, 52.0, 24.0, 20.5), False),
        (Camera(60, 48, 53.5, 55.6, 29.0, 24.5), False),
        (Camera(60, 48, 50.0, 52.0, 31.0, 24.5), False), (LENS, False)])
    def test_they_do_unless_crop_zoom_or_lens_differ(self, other, are_same):
        assert have_same_nodes(CAMERA, other) == are_same
        assert have_same_nodes(other, CAMERA) == are_same

    def test_a_lens_is_like_itself_at_another_resolution(self):
        """Its calibration is the same but for the pixels."""
        half = dataclasses.replace(LENS, width=30, height=24, fx=25.0, fy=26.0, cx=14.25, cy=12.0)
        assert have_same_nodes(LENS, half)

    def test_where_a_lens_shows_no_rays_nothing_is_the_same(self):
        folded = dataclasses.replace(LENS, distortion=(-9.0, 30.0, 0.0, 0.0, -40.0))
        assert not have_same_nodes(folded, CAMERA)
        assert have_same_nodes(folded, dataclasses.replace(folded))

    def test_an_image_of_one_pixel_has_them_all_there(self):
        point = Camera(1, 1, 50.0, 50.0, 0.0, 0.0)
        assert not have_same_nodes(point, CAMERA) and have_same_nodes(point, point)


class TestEquality:
    """Distortions are compared by their nodes."""

    @pytest.mark.parametrize('copied', [
        copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one)),
        lambda one: DepthDistortion(one.nodes - 0.0)])
    @pytest.mark.parametrize('one', [NO_DISTORTION, random_one(7)])
    def test_a_copy_is_the_same(self, one, copied):
        other = copied(one)
        assert other is not one and other == one and hash(other) == hash(one)

    def test_another_one_is_not(self):
        nodes = random_one(7).nodes.copy()
        nodes[2, 3] += 1e-9
        assert random_one(7) != DepthDistortion(nodes)
        assert random_one(7) != NO_DISTORTION and random_one(7) != 'a distortion'

    def test_a_zero_has_no_sign(self):
        negative = DepthDistortion(-NO_DISTORTION.nodes)
        assert negative == NO_DISTORTION and hash(negative) == hash(NO_DISTORTION)


class TestDescription:
    """What users read."""

    def test_it_has_the_size_at_one_metre(self):
        even = DepthDistortion(np.full((ROWS, COLUMNS), 0.0021))
        assert '2.1 mm' in even.description

    def test_no_distortion_needs_no_words(self):
        assert NO_DISTORTION.description == ''
        assert NO_DISTORTION.is_none
        assert not random_one().is_none
