# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the depth of two frames says about a pose, by residuals that are told."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration import depth_pair
from aick_ros.registration.depth_pair import DepthPair
from aick_ros.registration.refinement.misalignment import NO_CORRECTION
from aick_ros.registration.refinement.residuals import NormalEquations, Residuals
from aick_ros.settings import Settings

MOTION = se3.exp([0.02, -0.01, 0.03, 0.01, -0.02, 0.015])
BESIDE = se3.exp([0.3, 0.1, -0.2, 0.4, -0.3, 0.9])
UNOBSERVED = np.diag(np.repeat([0.05, 0.06], 3) ** 2)


def test_residuals_are_those_of_both_surfaces_corrected(monkeypatch):
    given = []
    residuals = SimpleNamespace(values=np.array([3.9, -3.9, 4.0, -4.1, 0.0]))
    monkeypatch.setattr(depth_pair, 'point_to_plane',
                        lambda *of, **options: given.append((*of, options)) or residuals)
    source, settings = SimpleNamespace(chosen=range(10)), Settings()
    pair = DepthPair(source, 'view', BESIDE, 'correction', settings)
    # of ten points five have a plane, three of these within four sigmas
    assert pair.overlap(MOTION) == 0.3
    refinement = settings.refinement
    (first, view, pose, *rest), = given
    assert (first, view) == (source, 'view')
    np.testing.assert_allclose(pose, BESIDE @ MOTION)
    assert rest == [settings.sensor, refinement.robust_width, refinement.reach, 'correction',
                    {'every': 1, 'smallest_cosine': 0.0}]


@pytest.fixture
def told(monkeypatch):
    """Return a pair of known information and noise, the truth being that the view sees MOTION."""
    def make(information, noise, weight=1.0, T_view_target=BESIDE, every=1, asked=[],
             curvature=1.0, of_normals=np.zeros((6, 6)), weights=1.0):
        def equations(residuals):
            if not residuals:
                return NormalEquations(np.zeros((6, 6)), np.zeros(6))
            error = se3.difference(residuals[0].pose, T_view_target @ MOTION)
            return NormalEquations(information, information @ error)

        def residuals(source, view, pose, *rest, **options):
            asked.append(options)
            return SimpleNamespace(pose=pose, weights=np.full(9, weights),
                                   normal_noise=of_normals)
        monkeypatch.setattr(depth_pair, 'point_to_plane', residuals)
        monkeypatch.setattr(depth_pair.NormalEquations, 'of', equations)
        monkeypatch.setattr(depth_pair, 'gradient_noise',
                            lambda residuals: noise if residuals else np.zeros((6, 6)))
        monkeypatch.setattr(depth_pair, 'curvature', lambda residuals: curvature)
        return DepthPair('source', 'view', T_view_target, 'correction', Settings(), weight, every)
    return make


@pytest.mark.parametrize('weight', [1.0, 0.25])
def test_equations_are_in_the_error_of_the_pose_in_the_target(told, made, weight):
    """A step by them leads to the pose that the view sees; two views of one weight add up."""
    information = np.linalg.inv(made.covariance() + 1e-6 * np.eye(6))
    pair = told(information, np.zeros((6, 6)), weight)
    off = se3.perturbed(MOTION, np.array([1e-4, -2e-4, 3e-4, 2e-4, 1e-4, -1e-4]))
    equations = pair.equations(off)
    step = -np.linalg.solve(equations.information, equations.gradient)
    np.testing.assert_allclose(se3.perturbed(off, step), MOTION, atol=1e-7)
    assert np.linalg.det(equations.information) == pytest.approx(
        weight ** 6 * np.linalg.det(information))


def test_more_points_make_a_pose_better_but_no_more_certain(told, made):
    """All of them have the weight of those that count; alone these are sums as they are."""
    information, asked = np.linalg.inv(made.covariance() + 1e-6 * np.eye(6)), []
    noise = 1e4 * made.covariance()
    pair = told(information, noise, every=4, asked=asked)
    alone, with_all = (pair.equations(np.eye(4), with_all) for with_all in (False, True))
    assert asked == [{'every': 4}, {'every': 1}]
    np.testing.assert_allclose(with_all.information, alone.information / 4)
    np.testing.assert_allclose(with_all.gradient, alone.gradient / 4)
    np.testing.assert_allclose(
        pair.covariance(MOTION, UNOBSERVED),
        told(information / 4, noise / 16).covariance(MOTION, UNOBSERVED), rtol=1e-6)


def test_points_count_for_the_covariance_whichever_way_they_face(told):
    """Those whose normals are as their planes' are chosen by chance where depth is noisy."""
    asked = []
    told(np.eye(6), np.eye(6), asked=asked).covariance(MOTION, UNOBSERVED)
    assert asked == [{'every': 1, 'smallest_cosine': 0.0}]


@pytest.mark.parametrize('share, weights, left', [
    (0.5, 1.0, 0.5), (0.5, 0.6, 0.7), (0.95, 1.0, 0.1), (1.3, 1.0, 0.1), (0.0, 1.0, 1.0)])
def test_what_noise_of_normals_adds_to_the_information_is_none(told, made, share, weights, left):
    """But for a tenth, as it is known roughly; where it is about one direction, only there."""
    information = np.linalg.inv(made.covariance() + 1e-6 * np.eye(6))
    prior = np.linalg.inv(UNOBSERVED)
    root = np.linalg.cholesky(information)
    for axes in (np.eye(6), np.diag([1.0, 0, 0, 0, 0, 0])):
        kept = np.where(axes.diagonal() > 0.0, left, 1.0)
        inverse = np.linalg.inv(root * kept @ root.T + prior)
        np.testing.assert_allclose(
            told(information, np.zeros((6, 6)), of_normals=share * root @ axes @ root.T,
                 weights=weights).covariance(MOTION, UNOBSERVED),
            inverse @ (0.01 * information + prior) @ inverse, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize('minutes', [0.1, 2.0, 10.0])
def test_what_no_surface_shows_stays_exact_however_long_it_is_dark(told, minutes):
    """A tilted wall at 0.2 m; a camera at 3 m/s would be kilometres away, turned at any angle."""
    rng, normal = np.random.default_rng(4), np.array([0.28, 0.0, 0.96])
    points = rng.uniform(-0.1, 0.1, (20000, 3))
    points -= np.outer(points @ normal - 0.2, normal)
    jacobian = np.column_stack([np.tile(normal, (20000, 1)), np.cross(points, normal)]) / 1e-4
    information = jacobian.T @ jacobian
    largest = np.repeat([180.0 * minutes, np.pi], 3) ** 2
    found = told(information, information).covariance(MOTION, np.diag(largest))
    np.testing.assert_allclose(found, found.T, atol=1e-15 * largest[0])
    assert np.linalg.eigvalsh(found)[0] > -1e-15 * largest[0]
    _, _, axes = np.linalg.svd(jacobian, full_matrices=False)
    hidden = axes[3:].T  # what moves no point off its plane
    np.testing.assert_allclose(
        found, hidden @ np.linalg.inv(hidden.T / largest @ hidden) @ hidden.T,
        atol=1e-6 * largest[0])


def test_the_covariance_has_the_scatter_of_depth_and_what_is_unobserved(told, made):
    information = np.linalg.inv(made.covariance() + 1e-6 * np.eye(6))
    noise = 1e4 * made.covariance()
    prior = np.linalg.inv(UNOBSERVED)
    for curvature in (1.0, 0.6):
        curved = curvature * information
        inverse = np.linalg.inv(curved + prior)
        np.testing.assert_allclose(
            told(information, noise, curvature=curvature).covariance(MOTION, UNOBSERVED),
            inverse @ (noise + 0.01 * curved + prior) @ inverse, rtol=1e-6)


@pytest.fixture
def with_edges(monkeypatch):
    """Return a pair of planes that show nothing along x, with edges that see MOTION there."""
    def make(shares=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0), asked=[]):
        information = np.diag(np.where(np.array(shares) == 1.0, 1e-6, 1e8))
        jacobian = np.sqrt(information)

        def planes(source, view, pose, *rest, **options):
            return SimpleNamespace(
                values=jacobian @ se3.difference(pose, BESIDE @ MOTION), jacobian=jacobian,
                weights=np.ones(6), blocks=np.arange(6), dimensions=1,
                normal_noise=np.diag(shares) @ information)

        def edges(source, view, pose):
            asked.append((source, view, pose))
            across = np.tile(np.eye(6)[0], (60, 1)) * 1e4
            error = se3.difference(pose, BESIDE @ MOTION)
            # all blocks scatter by one standard deviation
            return Residuals(across @ error + np.resize([1.0, -1.0], 60), across, np.ones(60),
                             np.arange(60))
        monkeypatch.setattr(depth_pair, 'point_to_plane', planes)
        monkeypatch.setattr(depth_pair, 'edge_distances', edges)
        return DepthPair('source', 'view', BESIDE, NO_CORRECTION, Settings()).with_edges(
            ('edges', 'other edges'), MOTION)
    return make


def test_edges_show_what_planes_hide(with_edges):
    asked = []
    pair = with_edges(asked=asked)
    off = se3.perturbed(MOTION, np.array([1e-4, -2e-4, 3e-4, 2e-4, 1e-4, -1e-4]))
    equations = pair.equations(off)
    step = -np.linalg.solve(equations.information, equations.gradient)
    np.testing.assert_allclose(se3.perturbed(off, step), MOTION, atol=1e-7)
    source, view, pose = asked[-1]
    assert (source, view) == ('edges', 'other edges')
    np.testing.assert_allclose(pose, BESIDE @ off)


def test_edges_have_a_variance_by_their_scatter(with_edges):
    """That of 60 in a row that err alike in part; along the other axes that of the planes."""
    covariance = with_edges().covariance(BESIDE @ MOTION, np.eye(6))
    independent = 1e-8 / 60
    assert 3.0 * independent < covariance[0, 0] < 6.0 * independent
    assert covariance[1, 1] < 1e-8


@pytest.mark.parametrize('share, part', [(0.2, 0.0), (0.5, 0.5), (0.8, 1.0)])
def test_edges_have_the_part_that_planes_leave(with_edges, share, part):
    pair = with_edges((share, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert (pair.hidden is None) == (part == 0.0)
    if part:
        np.testing.assert_allclose(pair.hidden @ pair.hidden, part * np.diag(np.eye(6)[0]),
                                   atol=1e-6)
