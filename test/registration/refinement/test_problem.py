# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The joint problem on residuals that are told, against sums of marginal informations."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement import problem
from aick_ros.registration.refinement.mean_scatter import SHARE, MeanScatter
from aick_ros.registration.refinement.measured_noise import Noise
from aick_ros.registration.refinement.misalignment import NO_CORRECTION, Misalignment, image_height
from aick_ros.registration.refinement.problem import Problem
from aick_ros.registration.refinement.residuals import Residuals, curvature, gradient_noise
from aick_ros.registration.samples import NoiseSample
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM, Tracks
from aick_ros.settings import Settings

CAMERA, OTHER = Camera(640, 480, 500, 510, 320, 240), Camera(640, 480, 400, 420, 320, 240)
SETTINGS = Settings()
POSE = se3.exp([0.1, 0.2, 0.3, 0.1, -0.2, 0.1])
PRIOR = np.eye(6)
INTERVAL, LAGS = 0.1, (0.02, 0.01)  # s, of the source and of the target
RATE = 1 + (LAGS[0] - LAGS[1]) / INTERVAL
TWISTS = np.array([np.arange(1.0, 7.0), np.arange(7.0, 13.0)]) / 10


@dataclasses.dataclass
class Surface:
    """A surface of which nothing but the number of chosen points is known."""

    name: str
    count: int

    @property
    def chosen(self):
        return range(self.count)


def residuals(rng, count, scale):
    return Residuals(0.1 * rng.standard_normal(count), scale * rng.standard_normal((count, 6)),
                     rng.uniform(0.1, 1.0, count), rng.integers(0, 40, count))


class Moving:
    """Shutters that add told errors."""

    added = np.zeros((6, 6))

    def errors(self, *asked):
        self.asked = asked
        return self.added

    def by_readout(self, twists):
        return twists[0] - twists[1]


class Told:
    """A problem of two frames with told residuals, and notes of what they were asked for."""

    def __init__(self, monkeypatch, tracks=30, depth=('source', 'target'), twists=TWISTS,
                 points=2100):
        rng = np.random.default_rng(4)
        self.given, self.count = {}, tracks
        self.told = {'reprojection': residuals(rng, 2 * tracks, 30.0),
                     'track_depth': residuals(rng, tracks, 10.0),
                     'point_to_plane': residuals(rng, 200, 20.0)}
        self.told['track_steps'] = 'a pose', 'a step'
        self.told['Shutters'] = self.shutters = Moving()
        for name in self.told:
            monkeypatch.setattr(problem, name, lambda *of, name=name: self._tell(name, of))
        monkeypatch.setattr(problem, 'misalignment_sample', lambda *of: self.given.setdefault(
            'misalignment_sample', of) and 'misalignment_sample')
        jitter, by_depth, bias = (np.diag(np.square(root))
                                  for root in 0.004 * rng.standard_normal((3, 6)))
        of_keypoints, of_depth = (MeanScatter(np.diag(shape)) for shape in (
            [0.4, 0.6, 0.8, 1.0, 1.2, 2.0], [3.0, 1.0, 0.5, 0.5, 0.5, 0.5]))
        self.noise = Noise(keypoints=3.0, bias=bias, keypoint_jitter=jitter, depth_bias=by_depth,
                           keypoint_scatter=of_keypoints, depth_scatter=of_depth)
        self.motions = []
        self.source, self.target = (SimpleNamespace(
            stamp=stamp, surface=Surface(name, points) if name in depth else None,
            depth_lag=lag, twist=twist, frame=SimpleNamespace(camera=camera))
            for stamp, name, lag, twist, camera in (
                (200_000_000, 'source', LAGS[0], twists[0], CAMERA),
                (100_000_000, 'target', LAGS[1], twists[1], OTHER)))
        self.tracks = Tracks(np.arange(tracks) + 5, rng.uniform(1.0, 3.0, (tracks, 3)),
                             rng.uniform(-0.5, 0.5, (tracks, 2)), np.ones(tracks),
                             np.ones(tracks))
        self.problem = Problem(
            self.source, self.target, self.tracks, SETTINGS.refinement, SETTINGS.sensor,
            SimpleNamespace(expected=lambda motion: self.motions.append(motion) or self.noise,
                            points=SimpleNamespace(of=self._points, shown_by=self._shown_by)))

    @staticmethod
    def _points(surface):
        """Return a surface with the points to take, of which there are as many."""
        return Surface(f'points of the {surface.name}', surface.count)

    def _shown_by(self, *of):
        self.given['points'] = of
        return 0.7

    def _tell(self, name, of):
        self.given[name] = of
        return self.told[name]

    def kinds(self):
        """Return the residuals of keypoints, and of depth."""
        return [self.told['reprojection'], self.told['track_depth']], [self.told['point_to_plane']]


@pytest.fixture
def tell(monkeypatch):
    return lambda **values: Told(monkeypatch, **values)


def information(kinds):
    return sum((kind.jacobian.T * kind.weights) @ kind.jacobian for kind in kinds)


def gradient(kinds):
    return sum((kind.jacobian.T * kind.weights) @ kind.values for kind in kinds)


def own(kinds):
    """Return error, scatter about it, and inverse of some residuals with the prior, alone."""
    inverse = np.linalg.inv(information(kinds) + PRIOR)
    error = inverse @ gradient(kinds)
    about = [Residuals(kind.values - kind.jacobian @ error, kind.jacobian, kind.weights,
                       kind.blocks) for kind in kinds]
    return error, gradient_noise(about), inverse


def expected(kinds, mean):
    """Return the covariance of the gradient that has most of its shape from a mean."""
    root = np.linalg.cholesky(information(kinds) + PRIOR)
    shown = np.linalg.solve(root, np.linalg.solve(root, own(kinds)[1]).T)
    return root @ ((1 - SHARE) * shown + SHARE * np.trace(shown) / 6 * mean.shape) @ root.T


def covariances(told):
    """Return the covariances by each kind of residual with the prior: as is expected, and own."""
    for kinds, mean in zip(told.kinds(), (told.noise.keypoint_scatter, told.noise.depth_scatter)):
        _, scatter, inverse = own(kinds)
        yield [inverse @ (noise + PRIOR) @ inverse for noise in (expected(kinds, mean), scatter)]


def assert_others(told, kinds):
    """Check that some residuals and the prior were added to those of the tracks."""
    *_, others = told.given['track_steps']
    np.testing.assert_allclose(others.information, information(kinds) + PRIOR)
    np.testing.assert_allclose(others.gradient, gradient(kinds) + np.zeros(6))


@pytest.mark.parametrize('coarse', [True, False])
def test_a_step_is_by_keypoints_first_and_then_by_both(tell, coarse):
    told = tell()
    assert told.problem.step(POSE, coarse) == ('a pose', 'a step')
    tracks, pose, sigma, sensor, width, wider, weight, _ = told.given['track_steps']
    assert tracks is told.tracks and pose is POSE and sensor is SETTINGS.sensor
    assert sigma == SETTINGS.refinement.track_sigma / OTHER.fx and weight == 1 / 3.0 / 4
    assert width == SETTINGS.refinement.robust_width and wider == [3.0 if coarse else 1.0]
    assert_others(told, [] if coarse else told.kinds()[1])


def test_without_tracks_depth_takes_the_coarse_step_too(tell):
    told = tell(tracks=0)
    told.problem.step(POSE, True)
    assert_others(told, told.kinds()[1])


def test_depth_is_compared_over_the_time_between_its_own_images(tell):
    told = tell()
    told.problem.step(POSE, False)
    source, target, pose, sensor, width, reach, correction, rate, _ = told.given['point_to_plane']
    assert (source.name, target.name) == ('points of the source', 'target')
    assert correction is NO_CORRECTION
    assert pose is POSE and rate == pytest.approx(RATE)
    assert sensor is SETTINGS.sensor
    assert (width, reach) == (SETTINGS.refinement.robust_width, SETTINGS.refinement.reach)


@pytest.mark.parametrize(('points', 'every'), [(2100, 4), (999, 1), (1000, 2), (0, 1)])
def test_steps_take_some_points_of_depth_as_if_they_were_all_and_the_last_one_all(
        tell, points, every):
    told = tell(points=points)
    told.problem.step(POSE, False)
    assert told.given['point_to_plane'][-1] == every
    assert told.given['track_steps'][6] == 1 / 3.0 / every
    told.problem.finish(POSE)
    assert told.given['point_to_plane'][-1] == 1


def test_the_noise_is_that_of_the_displacement_where_both_have_depth(tell):
    told = tell()
    assert told.motions == [told.tracks.displacement(OTHER.fx)]
    for depth in ((), ('source',), ('target',)):
        assert tell(depth=depth).motions == []


def test_the_pose_is_that_of_all_informations_with_the_biases_marginalised(tell):
    """Of each kind the inverse information and the covariance of its bias add up."""
    told = tell()
    refined, noise = told.problem.finish(POSE), told.noise
    (total, curved, scatter), pull = np.zeros((3, 6, 6)), np.zeros(6)
    for kinds, weight, bias, mean in zip(told.kinds(), (1 / 3.0, 1.0),
                                         (noise.keypoint_jitter, noise.depth_bias),
                                         (noise.keypoint_scatter, noise.depth_scatter)):
        seen = np.linalg.inv(weight * information(kinds))
        marginal = np.linalg.inv(seen + bias)
        total += marginal
        curved += curvature(kinds) * marginal
        pull += marginal @ seen @ (weight * gradient(kinds))
        gain = weight * marginal @ seen
        scatter += gain @ expected(kinds, mean) @ gain.T
    inverse = np.linalg.inv(total + PRIOR)
    np.testing.assert_allclose(refined.T_target_source,
                               se3.perturbed(POSE, -inverse @ pull), atol=1e-12)
    spread = np.linalg.inv(curved + PRIOR)
    least = max(0.01 - np.trace(inverse @ scatter) / 6, 0.0) * total
    covariance = spread @ (scatter + least + PRIOR) @ spread + noise.bias
    np.testing.assert_allclose(refined.covariance, covariance, rtol=1e-8,
                               atol=1e-10 * np.abs(covariance).max())
    assert refined.systematic is noise.bias


def test_tracked_are_those_whose_weight_is_more_than_a_quarter(tell):
    """Of the two residuals of a track the first one has its weight."""
    told = tell()
    weights = told.told['reprojection'].weights
    weights[0], weights[1] = 0.25, np.nextafter(0.25, 1.0)
    tracked = told.problem.finish(POSE).tracked
    np.testing.assert_array_equal(
        tracked.keypoints, told.tracks.keypoints[weights[:told.count] > 0.25])
    assert told.tracks.keypoints[1] in tracked.keypoints


def test_the_two_kinds_show_their_bias(tell):
    told = tell()
    refined = told.problem.finish(POSE)
    error, by_depth = (own(kinds)[0] for kinds in told.kinds())
    np.testing.assert_allclose(refined.bias.difference, by_depth - error, rtol=1e-9)
    for found, of_both in zip((refined.bias.expected_covariance, refined.bias.covariance),
                              zip(*covariances(told))):
        np.testing.assert_allclose(found, sum(of_both), rtol=1e-9, atol=1e-12)


def test_the_gain_of_depth_is_how_far_it_moves_the_joint_pose(tell):
    """By its information, its bias marginalised, as a share of all information."""
    told = tell()
    refined, noise = told.problem.finish(POSE), told.noise
    by_keypoints, by_depth = (
        np.linalg.inv(np.linalg.inv(weight * information(kinds)) + bias)
        for kinds, weight, bias in zip(told.kinds(), (1 / 3.0, 1.0),
                                       (noise.keypoint_jitter, noise.depth_bias)))
    np.testing.assert_allclose((by_keypoints + by_depth + PRIOR) @ refined.bias.gain, by_depth,
                               rtol=1e-8, atol=1e-8 * np.abs(by_depth).max())


def test_the_two_kinds_show_their_noise(tell):
    told = tell()
    refined = told.problem.finish(POSE)
    (error, scatter, inverse), (by_depth, depth_scatter, depth_inverse) = map(own, told.kinds())
    noise = refined.measure.noise()
    assert noise.motion == told.motions[0]
    assert noise.ratio == pytest.approx(np.trace(inverse @ (scatter + PRIOR)) / np.trace(
        depth_inverse @ (depth_scatter + PRIOR)))
    (_, of_keypoints), _ = covariances(told)
    assert noise.normalised == refined.bias.normalised
    np.testing.assert_array_equal(noise.squares, refined.bias.squares)
    poses = noise.poses
    assert poses.stamps == (200_000_000, 100_000_000)
    np.testing.assert_allclose(poses.by_keypoints, se3.perturbed(POSE, -error), atol=1e-12)
    np.testing.assert_allclose(poses.by_depth, se3.perturbed(POSE, -by_depth), atol=1e-12)
    assert poses.variance == pytest.approx(np.trace(of_keypoints[:3, :3]) / 3)
    for shown, kinds in zip(noise.scatters, told.kinds()):
        root = np.linalg.cholesky(information(kinds) + PRIOR)
        np.testing.assert_allclose(root @ shown @ root.T, own(kinds)[1], rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize('tracks, is_known', [(FEWEST_TO_CONFIRM, True),
                                              (FEWEST_TO_CONFIRM - 1, False)])
def test_with_few_tracks_the_noise_and_the_misalignment_are_not_known(tell, tracks, is_known):
    told = tell(tracks=tracks)
    refined = told.problem.finish(POSE)
    assert refined.bias is not None and (refined.measure is not None) == is_known
    if is_known:
        noise = refined.measure.noise()
        assert isinstance(noise, NoiseSample) and noise.rare == 0.7
        assert told.given['points'] == (told.told['point_to_plane'], told.target.surface)
        assert refined.measure.misalignment() == 'misalignment_sample'


def test_where_surfaces_leave_a_motion_open_they_show_nothing_of_the_camera(tell):
    """By the prior alone keypoints and depth would agree to the digit."""
    told = tell()
    depth = told.told['point_to_plane']
    told.told['point_to_plane'] = dataclasses.replace(
        depth, jacobian=depth.jacobian * [0, 1, 1, 1, 1, 1])
    refined = told.problem.finish(POSE)
    assert refined.bias is not None and refined.measure is None


def test_by_keypoints_alone_there_is_neither(tell):
    refined = tell(depth=()).problem.finish(POSE)
    assert refined.bias is refined.measure is None


LATE = Misalignment(np.zeros(6), 0.005, 0.03, 0.02)
NONE = Misalignment(np.zeros(6), 0.0, 0.0, 0.0)


@pytest.fixture
def corrected(monkeypatch):
    """Let corrections return what they were given."""
    given = []
    monkeypatch.setattr(problem.Correction, 'tracks', lambda self, *of: given.append(
        ('tracks', *of)) or of[0])
    return given


def test_both_frames_are_corrected_by_their_own_velocity(tell, corrected):
    """Depth to the mean lag of the two: what they differ by is in the rate."""
    told = tell()
    told.problem.correct(LATE, TWISTS[0], POSE)
    (_, tracks, source, sensor, pose), = corrected
    assert tracks is told.tracks and source is told.source and sensor is SETTINGS.sensor
    assert pose is POSE
    told.problem.step(POSE, False)
    source, target, *_, correction, _, _ = told.given['point_to_plane']
    assert (source, target) == (told._points(told.source.surface), told.target.surface)
    for moved, twist, camera in ((correction.source, TWISTS[0], CAMERA),
                                 (correction.target, TWISTS[1], OTHER)):
        np.testing.assert_allclose(moved.twists, np.outer([0.015 + 0.005, 0.03, 0.02], twist))
        assert moved.height == image_height(camera)


def test_tracked_are_as_they_were_seen(tell, monkeypatch):
    """Corrected points would be corrected once more where they are keypoints of a frame."""
    told = tell()
    moved = dataclasses.replace(told.tracks, points=told.tracks.points + 0.1)
    monkeypatch.setattr(problem.Correction, 'tracks', lambda *_: moved)
    told.problem.correct(LATE, TWISTS[0], POSE)
    tracked = told.problem.finish(POSE).tracked
    assert len(tracked)
    np.testing.assert_array_equal(tracked.points, told.tracks.points[tracked.keypoints - 5])


@pytest.mark.parametrize('twist, of_target', [(None, TWISTS[1]), (TWISTS[0], None)])
def test_where_one_velocity_is_not_known_both_are_at_rest(tell, corrected, twist, of_target):
    told = tell(twists=(twist, of_target))
    told.problem.correct(LATE, twist, POSE)
    assert not told.problem._correction.source.twists.any()
    assert not told.problem._correction.target.twists.any()


@pytest.mark.parametrize('misalignment, lags, twists, is_corrected', [
    (NONE, LAGS, TWISTS, True), (NONE, (0.0, 0.0), TWISTS, False),
    (NONE, LAGS, np.zeros((2, 6)), False), (LATE, (0.0, 0.0), TWISTS, True),
    (LATE, LAGS, np.zeros((2, 6)), True)])
def test_what_nothing_displaces_is_not_corrected(
        tell, corrected, misalignment, lags, twists, is_corrected):
    told = tell(twists=twists)
    told.source.depth_lag, told.target.depth_lag = lags
    told.problem.correct(misalignment, twists[0], POSE)
    assert bool(corrected) == is_corrected
    assert (told.problem._correction is not NO_CORRECTION) == is_corrected


def test_without_a_surface_the_tracks_are_corrected_all_the_same(tell, corrected):
    told = tell(depth=('target',))
    told.problem.correct(LATE, TWISTS[0], POSE)
    assert [kind for kind, *_ in corrected] == ['tracks']


def test_velocities_that_the_frames_are_corrected_by_err(tell, corrected):
    told = tell()
    told.problem.correct(LATE, TWISTS[0], POSE)
    without = told.problem.finish(POSE)
    solution, source, target = told.given['Shutters']
    misalignment, lag = told.shutters.asked
    assert solution.T_target_source is without.T_target_source
    assert solution.tracks is told.problem._tracks
    assert [solution.keypoints, *solution.depth] == [
        told.told['reprojection'], told.told['point_to_plane']]
    np.testing.assert_array_equal(solution.gain, without.bias.gain)
    assert (source, target) == (told.source, told.target) and misalignment is LATE
    assert lag == pytest.approx(np.mean(LAGS))
    told.shutters.added = errors = np.diag(np.arange(1.0, 7.0))
    refined = told.problem.finish(POSE)
    np.testing.assert_allclose(refined.covariance - without.covariance, errors)
    np.testing.assert_array_equal(refined.by_readout, TWISTS[0] - TWISTS[1])


def test_the_misalignment_is_shown_by_both_kinds_as_they_were_corrected(tell, corrected):
    told = tell()
    told.problem.correct(LATE, TWISTS[0], POSE)
    told.problem.finish(POSE).measure.misalignment()
    keypoints, depth, tracks, pair, weight, applied = told.given['misalignment_sample']
    assert keypoints is told.told['reprojection'] and tracks is told.problem._tracks
    assert weight == 1 / 3.0 and applied is LATE
    np.testing.assert_array_equal(depth.jacobian, told.kinds()[1][0].jacobian)
    assert (pair.source, pair.target) == (told.source, told.target)
    assert pair.surface == told._points(told.source.surface)
    assert pair.T_target_source is POSE
    np.testing.assert_array_equal(pair.twists, TWISTS)
    np.testing.assert_array_equal(pair.cameras, [CAMERA.model, OTHER.model])
