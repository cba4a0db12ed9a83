# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Fused keypoints against their true positions in rendered rooms, and their own uncertainty."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.odometry.local_map import LocalMap
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings
from aick_ros.sources.synthetic import ColourSensor, SyntheticOptions, SyntheticSource

SETTINGS = Settings()
COUNT = 12


@pytest.fixture(scope='module')
def source():
    return SyntheticSource(SyntheticOptions(seed=4, frames=COUNT, colour=ColourSensor.perfect()))


@pytest.fixture(scope='module')
def exact():
    return SyntheticSource(SyntheticOptions.perfect(seed=4, frames=COUNT))


@pytest.fixture(scope='module')
def views(source):
    registrar = Registrar(SETTINGS)
    return [registrar.prepare(source.frame(i)) for i in range(COUNT)]


@pytest.fixture(scope='module')
def registrations(views):
    """Return how each view was placed in the first, by the points of the first as it is."""
    registrar, first = Registrar(SETTINGS), LocalMap(SETTINGS).start(views[0])
    return [registrar.place(view, first) for view in views[1:]]


def depth_errors(view, exact, number):
    """Return how far the keypoints of a view are from the true surface along their rays [m]."""
    columns, rows = np.rint(view.keypoints.pixels).astype(int).T
    return view.keypoints.positions[:, 2] - exact.frame(number).depth[rows, columns]


def test_a_map_begins_with_what_one_frame_does_not_know(views):
    begun = LocalMap(SETTINGS).start(views[0])
    positions, covariances = begun.keypoints.positions, begun.keypoints.covariances
    np.testing.assert_array_equal(positions, views[0].keypoints.positions)
    z = positions[:, 2]
    np.testing.assert_allclose(np.sqrt(covariances[:, 2, 2]),
                               SETTINGS.sensor.depth_sigma * z ** 2, rtol=1e-4)
    along = positions / z[:, None]
    np.testing.assert_allclose(np.einsum('nij,nj->ni', covariances, np.cross(along, (1, 2, 3))),
                               0, atol=1e-9)  # nothing is unknown across the ray


def test_every_frame_makes_the_depths_better(views, registrations, exact):
    fusing = LocalMap(SETTINGS)
    begun = told = fusing.start(views[0])
    for registration in registrations:
        told = fusing.update(told, registration)
    before, after = (np.abs(depth_errors(view, exact, 0)) for view in (begun, told))
    seen = np.isin(np.arange(len(before)), registrations[-1].tracks.keypoints)
    smooth = seen & (before < 4 * np.sqrt(begun.keypoints.covariances[:, 2, 2]))
    assert smooth.sum() > 150
    assert np.median(after[smooth]) < 0.7 * np.median(before[smooth])
    sigmas = np.sqrt(told.keypoints.covariances[smooth, 2, 2])
    assert (sigmas < np.sqrt(begun.keypoints.covariances[smooth, 2, 2])).mean() > 0.95
    assert np.median(after[smooth] / sigmas) < 1.0  # a normal distribution has 0.67


def test_no_frame_makes_a_depth_surer_than_what_never_changes(views, registrations):
    fusing = LocalMap(SETTINGS)
    told = fusing.start(views[0])
    single = np.sqrt(told.keypoints.covariances[:, 2, 2])
    for registration in 5 * registrations:
        told = fusing.update(told, registration)
    assert (np.sqrt(told.keypoints.covariances[:, 2, 2]) > 0.49 * single).all()


def test_the_next_keyframe_knows_the_points_it_sees(views, registrations, exact):
    fusing = LocalMap(SETTINGS)
    told = fusing.start(views[0])
    for registration in registrations:
        told = fusing.update(told, registration)
    carried = fusing.propagate(told, views[-1], registrations[-1])
    inherited = len(carried.keypoints) - len(
        np.flatnonzero(np.isin(carried.keypoints.pixels, views[-1].keypoints.pixels).all(axis=1)))
    assert inherited > 100
    poses = exact.ground_truth.poses
    first_to_last = se3.inverse(poses[COUNT - 1]) @ poses[0]
    numbers = registrations[-1].tracks.keypoints
    truth = exact_points(told, exact)[numbers]
    moved = se3.transform(first_to_last, truth)
    off = np.linalg.norm(carried.keypoints.positions[:inherited, None] - moved, axis=2).min(axis=1)
    assert np.median(off) < 0.003
    own = np.abs(depth_errors(views[-1], exact, COUNT - 1))
    assert np.median(off) < np.median(own) + 0.001
    pixels = carried.keypoints.pixels
    apart = np.linalg.norm(pixels[:inherited, None] - pixels[inherited:], axis=2)
    assert apart.min() > 5.9


def exact_points(view, exact):
    """Return the true points of a view's keypoints, of the first frame, Nx3."""
    frame = exact.frame(0)
    columns, rows = np.rint(view.keypoints.pixels).astype(int).T
    return frame.camera.back_project(view.keypoints.pixels, frame.depth[rows, columns])


def test_a_point_seen_elsewhere_is_not_taken_over(views, registrations):
    fusing, registration = LocalMap(SETTINGS), registrations[-1]
    begun = fusing.start(views[0])
    wrong = dataclasses.replace(registration.tracks, depths=registration.tracks.depths.copy())
    wrong.depths[::2] *= 1.5
    right = np.delete(np.arange(len(wrong)), np.s_[::2])
    both = fusing.propagate(begun, views[-1], dataclasses.replace(registration, tracks=wrong))
    only = fusing.propagate(begun, views[-1],
                            dataclasses.replace(registration, tracks=registration.tracks[right]))
    first = len(np.flatnonzero(np.isin(only.keypoints.pixels, both.keypoints.pixels).all(axis=1)))
    assert first == len(only.keypoints.pixels) == len(both.keypoints.pixels)


@pytest.mark.parametrize('tracks', ['none', 'empty'])
def test_without_tracks_a_keyframe_begins_a_new_map(views, registrations, tracks):
    fusing, registration = LocalMap(SETTINGS), registrations[-1]
    tracks = None if tracks == 'none' else registration.tracks[:0]
    registration = dataclasses.replace(registration, tracks=tracks)
    begun = fusing.start(views[0])
    told = fusing.update(begun, registration)
    np.testing.assert_array_equal(told.keypoints.positions, begun.keypoints.positions)
    carried = fusing.propagate(begun, views[-1], registration)
    np.testing.assert_array_equal(carried.keypoints.pixels, views[-1].keypoints.pixels)


def test_placing_is_registering_the_other_way_round(views):
    """The covariance by moving the found pose about and inverting it."""
    found = Registrar(SETTINGS).register(views[0], views[3])
    placed = Registrar(SETTINGS).place(views[3], views[0])
    np.testing.assert_allclose(placed.T_target_source @ found.T_target_source, np.eye(4),
                               atol=1e-12)
    np.testing.assert_array_equal(placed.matches, found.matches[:, ::-1])
    columns = []
    for axis in np.eye(6):
        moved = se3.inverse(se3.perturbed(found.T_target_source, 1e-6 * axis))
        columns.append(np.r_[moved[:3, 3] - placed.T_target_source[:3, 3],
                             se3.log_rotation(
                                 moved[:3, :3] @ placed.T_target_source[:3, :3].T)] / 1e-6)
    jacobian = np.transpose(columns)
    np.testing.assert_allclose(placed.covariance, jacobian @ found.covariance @ jacobian.T,
                               rtol=1e-3, atol=1e-12)
