# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Registration by depth alone, on planes whose depth has a closed form."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import FINE_CELL, Surface
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration import depth_alone
from aick_ros.registration.depth_alone import DepthAlone
from aick_ros.registration.depth_pair import KnownView
from aick_ros.registration.refinement.measured_noise import Noise
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.refinement.residuals import NormalEquations, point_to_plane
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status
from aick_ros.settings import Settings

CAMERA = Camera(320, 240, 260.0, 260.0, 160.0, 120.0)
WALL = [([0.0, 0.0, 1.0], 2.0)]  # normal and distance of each plane
CORNER = [([0.6, 0.0, 0.8], 1.6), ([-0.6, 0.0, 0.8], 1.6), ([0.0, 0.8, 0.6], 1.5)]
MOTION = se3.exp([0.02, -0.01, 0.03, 0.01, -0.02, 0.015])
PRIOR = np.diag(np.repeat([0.05, 0.06], 3) ** 2)


def prepared(planes, T_world_camera, stamp, rng):
    """Return the frame of a camera that sees the nearest of some planes, with noise of depth."""
    return with_surface(depth_of(planes, T_world_camera), stamp, rng)


def depth_of(planes, T_world_camera, rows=slice(None)):
    """Return the depth of the nearest of some planes, in some rows of the image."""
    v, u = np.mgrid[:CAMERA.height, :CAMERA.width][:, rows]
    rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy,
                     np.ones(u.shape)], axis=-1)
    directions = rays @ T_world_camera[:3, :3].T
    with np.errstate(divide='ignore'):
        depths = [(distance - np.dot(normal, T_world_camera[:3, 3])) / (directions @ normal)
                  for normal, distance in planes]
    return np.min([np.where(z > 0, z, np.inf) for z in depths], axis=0)


def rolled(planes, T_world_camera, twist, readout, stamp, rng):
    """Return the frame of a camera with a rolling shutter, its rows taken one by one."""
    rows = (np.arange(CAMERA.height) - CAMERA.cy) / CAMERA.height
    depth = np.empty((CAMERA.height, CAMERA.width))
    for v, row in enumerate(rows):
        pose = T_world_camera @ se3.exp(readout * row * twist)
        depth[v] = depth_of(planes, pose, slice(v, v + 1))[0]
    return dataclasses.replace(with_surface(depth, stamp, rng), twist=twist)


def with_surface(depth, stamp, rng):
    """Return a frame with a depth image, to which noise is added."""
    depth = depth + Settings().sensor.depth_sigma * depth ** 2 * rng.standard_normal(depth.shape)
    depth = depth.astype(np.float32)
    frame = RgbdFrame(stamp, np.zeros(depth.shape, np.uint8), depth, CAMERA)
    none = KeypointFrame(stamp, np.empty((0, 3), np.float32), np.empty((0, 32), np.uint8),
                         np.empty((0, 3, 3), np.float32), np.empty((0, 2), np.float32))
    return PreparedFrame(frame, none, frame.grey,
                         Surface.of(depth, CAMERA, Settings().sensor, 2000))


def corrugated(shift, stamp, rng):
    """Return a frame of a wall folded every 16 pixels, seen after a shift [m] of the camera."""
    u = np.mgrid[:CAMERA.height, :CAMERA.width][1]
    ray, fold = (u - CAMERA.cx) / CAMERA.fx, 16 / CAMERA.fx * 2.0
    depth = np.full(u.shape, 2.0)
    for _ in range(30):  # a fixed point: the folds are less steep than the rays
        x = ray * depth + shift
        depth = 2.0 + 0.5 * np.abs((x + fold) % (2 * fold) - fold)
    return with_surface(depth, stamp, rng)


def views(planes, other=None, seed=0):
    """Return two views that are MOTION apart, the second first."""
    rng = np.random.default_rng(seed)
    target = prepared(planes, np.eye(4), 0, rng)
    return prepared(other or planes, MOTION, 33_000_000, rng), target


def register(planes, expected=np.eye(4), other=None, seed=0, prior=PRIOR, unobserved=PRIOR,
             noise=None):
    """Return the registration of two views."""
    return DepthAlone(Settings(), noise).register(
        *views(planes, other, seed), PoseWithCovariance(expected, prior), unobserved)


def test_a_corner_holds_all_directions():
    found = register(CORNER)
    assert found.status.ok
    assert found.evidence is Evidence.DEPTH_ALONE
    error = se3.difference(found.T_target_source, MOTION)
    assert np.abs(error[:3]).max() < 0.002
    assert np.abs(error[3:]).max() < np.radians(0.1)
    sigmas = np.sqrt(np.diag(found.covariance))
    assert (np.abs(error) < 3 * sigmas).all()
    assert (sigmas < 0.1 * np.sqrt(np.diag(PRIOR))).all()


def test_a_wall_holds_its_normal_and_two_rotations_and_the_motion_expected_the_rest():
    expected = se3.exp([0.04, -0.03, 0.0, 0.0, 0.0, 0.05])
    found = register(WALL, expected)
    assert found.status.ok
    error = se3.difference(found.T_target_source, MOTION)
    sigmas, prior = np.sqrt(np.diag(found.covariance)), np.sqrt(np.diag(PRIOR))
    seen, blind = [2, 3, 4], [0, 1, 5]  # z is along the normal
    assert np.abs(error[seen]).max() < 0.003
    assert (sigmas[seen] < 0.15 * prior[seen]).all()
    np.testing.assert_allclose(found.T_target_source[:2, 3], expected[:2, 3], atol=0.003)
    np.testing.assert_allclose(sigmas[blind], prior[blind], rtol=0.1)


def test_folds_as_narrow_as_sixteen_pixels_hold_the_direction_across_them():
    rng = np.random.default_rng(0)
    target, source = corrugated(0.0, 0, rng), corrugated(0.02, 33_000_000, rng)
    found = DepthAlone(Settings()).register(
        source, target, PoseWithCovariance(np.eye(4), PRIOR), PRIOR)
    assert found.T_target_source[0, 3] == pytest.approx(0.02, abs=0.002)


def test_what_nothing_observes_is_as_uncertain_as_without_the_frames_before():
    found = register(WALL, unobserved=9 * PRIOR)
    blind = [0, 1, 5]
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance))[blind],
                               3 * np.sqrt(np.diag(PRIOR))[blind], rtol=0.1)


def test_an_expectation_as_sure_as_the_depth_images_counts_as_much():
    """Two estimates of equal information: the pose is halfway between them."""
    settings = Settings()
    source, target = (Surface.of(view.frame.depth, CAMERA, settings.sensor,
                                 settings.refinement.surface_points, FINE_CELL)
                      for view in views(CORNER))
    seen = NormalEquations.of([point_to_plane(
        source, target, MOTION, settings.sensor, settings.refinement.robust_width,
        settings.refinement.reach)])
    off = np.array([0.006, -0.004, 0.005, 0.003, -0.004, 0.003])
    found = register(CORNER, se3.perturbed(MOTION, off), prior=np.linalg.inv(seen.information))
    np.testing.assert_allclose(se3.difference(found.T_target_source, MOTION), off / 2,
                               atol=0.25 * np.abs(off).max())


def with_bias(covariance):
    """Return the noise of a camera whose bias between keypoints and depth is known."""
    return SimpleNamespace(expected=lambda displacement: Noise(bias=covariance))


def test_the_errors_are_those_of_the_covariance():
    """The NEES of nine registrations with different noise follows chi squared, without bias."""
    nees = 0.0
    for seed in range(9):
        found = register(CORNER, seed=seed, noise=with_bias(np.zeros((6, 6))))
        error = se3.difference(found.T_target_source, MOTION)
        nees += error @ np.linalg.solve(found.covariance, error)
    assert chi2.ppf(0.001, 54) < nees < chi2.ppf(0.999, 54)


def test_the_bias_of_the_camera_is_an_error_of_the_pose():
    root = np.random.default_rng(2).normal(0, 0.003, (6, 6))
    without, biased = (register(CORNER, noise=with_bias(bias))
                       for bias in (np.zeros((6, 6)), root @ root.T))
    np.testing.assert_array_equal(biased.T_target_source, without.T_target_source)
    np.testing.assert_allclose(biased.covariance - without.covariance, root @ root.T, atol=1e-12)


@pytest.mark.parametrize('unstamped', [0.0, 0.03])
@pytest.mark.parametrize('late', ['source', 'target'])
def test_the_pose_is_that_of_the_colour_image_where_depth_is_taken_later(late, unstamped):
    """The camera is at rest at one image and moves at the other, so that lags do not cancel."""
    rng, lag = np.random.default_rng(0), 0.02
    twist = np.array([0.4, -0.2, 0.3, 0.9, 0.5, -1.0])
    lags = {frame: se3.exp(lag * twist) if frame == late else np.eye(4)
            for frame in ('source', 'target')}
    moving, rest = (dict(depth_lag=lag - unstamped, twist=t) for t in (twist, np.zeros(6)))
    delay = MisalignmentEstimate(Misalignment(np.zeros(6), unstamped, 0.0, 0.0))
    target, source = (
        dataclasses.replace(prepared(CORNER, pose @ lags[frame], stamp, rng),
                            **(moving if frame == late else rest))
        for frame, pose, stamp in (('target', np.eye(4), 0), ('source', MOTION, 33_000_000)))
    found = DepthAlone(Settings(), misalignment=delay).register(
        source, target, PoseWithCovariance(MOTION, PRIOR), PRIOR)
    error = se3.difference(found.T_target_source, MOTION)
    assert np.abs(error[:3]).max() < 0.002
    assert np.abs(error[3:]).max() < np.radians(0.15)


def test_the_overlap_is_the_share_of_the_view_that_both_depth_images_show():
    assert register(CORNER).overlap > 0.9
    source, target = views(WALL)
    hidden = target.frame.depth.copy()
    hidden[:, :CAMERA.width // 3] = np.nan
    target = dataclasses.replace(
        target, frame=dataclasses.replace(target.frame, depth=hidden),
        surface=Surface.of(hidden, CAMERA, Settings().sensor, 2000))
    found = DepthAlone(Settings()).register(
        source, target, PoseWithCovariance(MOTION, PRIOR), PRIOR)
    assert found.overlap == pytest.approx(2 / 3, abs=0.06)


@pytest.mark.parametrize('other', [
    [([0.0, 0.0, 1.0], 1.2)], [([0.8, 0.0, 0.6], 1.0), ([-0.3, 0.9, 0.3], 1.3)]])
def test_surfaces_that_are_not_the_same_are_not_registered(other):
    assert not register(CORNER, other=other).status.ok


def test_without_depth_there_is_no_registration():
    rng = np.random.default_rng(0)
    target, source = prepared(CORNER, np.eye(4), 0, rng), prepared(CORNER, MOTION, 1, rng)
    blind = PreparedFrame(source.frame, source.keypoints, source.grey)
    found = DepthAlone(Settings()).register(
        blind, target, PoseWithCovariance(np.eye(4), PRIOR), PRIOR)
    assert not found.status.ok
    assert not np.isfinite(found.covariance).any(axis=None, where=np.eye(6, dtype=bool))


def test_the_pose_is_that_of_the_stamp_where_a_shutter_rolls():
    rng, readout = np.random.default_rng(0), 0.03
    twist = np.array([0.4, -0.2, 0.3, 0.9, 0.5, -1.0])
    target = dataclasses.replace(prepared(CORNER, np.eye(4), 0, rng), twist=np.zeros(6))
    source = rolled(CORNER, MOTION, twist, readout, 33_000_000, rng)
    errors = []
    for known in (0.0, readout):
        estimate = MisalignmentEstimate(Misalignment(np.zeros(6), 0.0, 0.0, known))
        found = DepthAlone(Settings(), misalignment=estimate).register(
            source, target, PoseWithCovariance(MOTION, PRIOR), PRIOR)
        errors.append(np.abs(se3.difference(found.T_target_source, MOTION)))
    uncorrected, corrected = errors
    assert corrected[:3].max() < 0.002
    assert corrected[3:].max() < np.radians(0.15)
    assert uncorrected.max() > 3 * corrected.max()


def test_the_expected_motion_counts_with_all_of_its_covariance():
    """Depth that measures x alone moves what is correlated with it: the update of Kalman."""
    root = 0.01 * np.random.default_rng(1).standard_normal((6, 6))
    covariance, sigma, measured = root @ root.T, 0.003, 0.002
    along_x = np.eye(6)[0]

    def equations(pose, with_all):
        error = se3.difference(pose, np.eye(4))[0] - measured
        return NormalEquations(np.outer(along_x, along_x) / sigma ** 2,
                               error * along_x / sigma ** 2)

    solution = depth_alone._solve([SimpleNamespace(equations=equations)],
                                  PoseWithCovariance(np.eye(4), covariance), np.eye(4))
    gain = covariance[:, 0] / (covariance[0, 0] + sigma ** 2)
    np.testing.assert_allclose(se3.difference(solution, np.eye(4)), measured * gain, atol=2e-6)


class Surfaces:
    """Surfaces of frames; those of new ones are made where they are asked for."""

    def __init__(self, known):
        self.known = known

    def __call__(self, frame):
        return self.known.setdefault(id(frame), tuple(
            SimpleNamespace(name=f'{name} of a view') for name in ('coarse', 'fine')))

    def knows(self, frame):
        return id(frame) in self.known


class Played:
    """Depth alone whose problems have known answers, with notes of what they are given."""

    def __init__(self, monkeypatch, made, count=300, overlap=0.5):
        self.log, self.overlap, self.shared = [], overlap, {}
        self.poses = {'coarse': made.pose(), 'fine': made.pose()}
        self.covariance, self.bias, self.asked = made.covariance(), made.covariance(), []
        monkeypatch.setattr(depth_alone, 'DepthPair', self._pair)
        monkeypatch.setattr(depth_alone, '_solve', self._solve)
        self.twist = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
        self.source, self.target = (made.prepared(
            stamp, surface='a surface', twist=twist, depth_lag=lag) for stamp, twist, lag in (
                (2, self.twist, 0.01), (1, -self.twist, 0.02)))
        points = np.tile([0.3, -0.2, 2.0], (count + 5, 1))
        self.surface = SimpleNamespace(name='coarse', points=points, chosen=np.arange(count))
        fine = SimpleNamespace(name='fine', chosen=np.arange(4 * count - 1))
        self.surfaces = [(self.surface, fine), tuple(
            SimpleNamespace(name=name) for name in ('coarse', 'fine'))]
        self.misalignment = MisalignmentEstimate(Misalignment(np.zeros(6), 0.005, 0.03, 0.02))
        self.alone = DepthAlone(Settings(), SimpleNamespace(expected=self._noise),
                                self.misalignment)
        self.alone._surfaces = Surfaces({
            id(frame.frame): surfaces for frame, surfaces in zip(
                (self.source, self.target), self.surfaces)})
        self.alone._edges = lambda frame: f'edges of {self._name(frame)}'
        self.hidden = None

    def _noise(self, displacement):
        self.asked.append(displacement)
        return Noise(bias=self.bias)

    def _name(self, frame):
        names = {id(self.source.frame): 'the source', id(self.target.frame): 'the target'}
        return names.get(id(frame), 'a view')

    def _pair(self, source, view, T_view_target, correction, settings, weight, every):
        name = source.name
        assert every == (1 if name == 'coarse' else 3)
        self.log.append(('pair', source, view, T_view_target, correction, settings, weight))
        pair = SimpleNamespace(
            name=name, view=view, weight=weight, hidden_near=lambda pose: self.hidden,
            with_edges=lambda edges, pose: self.log.append(('edges', name, edges, pose)) or pair,
            overlap=lambda pose: self.log.append(('overlap', name, pose)) or (
                self.shared.get(id(view), self.overlap)),
            covariance=lambda pose, unobserved: self.log.append(
                ('covariance', name, pose, unobserved)) or self.covariance)
        return pair

    def _solve(self, pairs, expected, pose, most_steps=12, with_all=False):
        name, = {pair.name for pair in pairs}
        self.log.append(('solve', name, pose, expected, pairs, most_steps, with_all))
        return self.poses[name]

    def register(self, *others):
        return self.alone.register(self.source, self.target,
                                   PoseWithCovariance(MOTION, PRIOR), 9 * PRIOR, *others)

    def only(self, kind):
        (entry,) = [entry[1:] for entry in self.log if entry[0] == kind]
        return entry


@pytest.fixture
def play(monkeypatch, made):
    return lambda **values: Played(monkeypatch, made, **values)


def test_coarse_surfaces_give_the_first_pose_and_fine_ones_the_last(play):
    played = play()
    found = played.register()
    names, poses, expected, _, steps, with_all = zip(*(
        entry[1:] for entry in played.log if entry[0] == 'solve'))
    assert names == ('coarse', 'fine', 'fine')
    assert poses[0] is MOTION and poses[1] is played.poses['coarse']
    assert poses[2] is found.T_target_source is played.poses['fine']
    assert all(motion.covariance is PRIOR for motion in expected)
    assert (steps, with_all) == ((12, 12, 3), (False, False, True))
    assert played.only('overlap') == ('coarse', played.poses['fine'])
    name, pose, unobserved = played.only('covariance')
    assert name == 'fine' and pose is played.poses['fine']
    np.testing.assert_array_equal(unobserved, 9 * PRIOR)
    np.testing.assert_allclose(found.covariance, played.covariance + played.bias)
    assert (found.evidence, found.overlap, found.support, found.tracks) == (
        Evidence.DEPTH_ALONE, 0.5, 0, None)
    assert found.matches.shape == (0, 2) and found.iterations == 0
    assert found.reason == 'by depth alone, 50% of 300 points'


def test_the_bias_is_that_of_the_displacement_of_the_image(play):
    """All points are at one place, which the pose moves."""
    played = play()
    played.register()
    before, after = (point[:2] / point[2] for point in (
        played.surface.points[0], se3.transform(played.poses['fine'],
                                                played.surface.points[:1])[0]))
    focal_length = played.source.frame.camera.fx
    assert played.asked == [pytest.approx(focal_length * np.linalg.norm(after - before))]


def test_points_that_come_to_lie_behind_the_camera_displace_nothing():
    surface = SimpleNamespace(points=np.array([[0.2, 0, 2.0], [0.1, 0, 0.5], [9, 9, 9]]),
                              chosen=np.array([0, 1]))
    back = se3.exp([0.4, 0, -1.0, 0, 0, 0])
    assert depth_alone._displacement(surface, back, 100.0) == pytest.approx(100 * (0.6 - 0.1))
    assert depth_alone._displacement(surface, se3.exp([0, 0, -2.0, 0, 0, 0]), 100.0) == 0.0


@pytest.mark.parametrize('values, status', [
    ({'count': 299}, Status.TOO_FEW_KEYPOINTS), ({'overlap': 0.4999}, Status.TOO_FEW_MATCHES)])
def test_it_fails_with_few_points_or_little_overlap(play, values, status):
    found = play(**values).register()
    assert found.status is status
    assert found.reason == ('299 points with depth' if 'count' in values
                            else 'by depth alone, 50% of 300 points')


@pytest.mark.parametrize('which, changes', [
    ('source', {'surface': None}), ('target', {'repeat': Repeat.DEPTH})])
def test_it_fails_where_the_depth_of_one_frame_is_not_used(play, which, changes):
    played = play()
    setattr(played, which, dataclasses.replace(getattr(played, which), **changes))
    found = played.register()
    assert (found.status, found.reason) == (Status.TOO_FEW_KEYPOINTS, '0 points with depth')


@pytest.mark.parametrize('known, twists', [
    ('both', (1, -1)), ('source', (1, 1)), ('target', (0, -1)), ('none', (0, 0))])
def test_depth_is_corrected_by_the_velocity_of_each_frame(play, known, twists):
    """A target of an unknown one moves as the source, without any both are at rest."""
    played = play()
    for name in {'source', 'target'} - ({known} if known != 'both' else {'source', 'target'}):
        setattr(played, name, dataclasses.replace(getattr(played, name), twist=None))
    played.register()
    for entry, *surfaces in zip([entry for entry in played.log if entry[0] == 'pair'],
                                *played.surfaces, strict=True):
        _, source, target, pose, correction, settings, weight = entry
        assert [source, target] == surfaces and settings is played.alone._settings
        assert weight == 1.0
        np.testing.assert_array_equal(pose, np.eye(4))
        for moved, twist, lag in zip((correction.source, correction.target), twists,
                                     (0.01, 0.02)):
            np.testing.assert_allclose(
                moved.twists, np.outer([lag + 0.005, 0.03, 0.02], twist * played.twist))


@pytest.mark.parametrize('width, cells', [
    (1280, (4, 2)), (640, (4, 2)), (424, (3, 1)), (320, (2, 1)), (160, (1, 1))])
def test_each_frame_has_two_surfaces_made_once(monkeypatch, made, width, cells):
    given = []
    monkeypatch.setattr(depth_alone.Surface, 'of', lambda *of: given.append(of) or len(of))
    settings, frame = Settings(), type('Frame', (), {  # not kept alive by what it is known for
        'depth': 'depth', 'camera': SimpleNamespace(width=width)})()
    alone = DepthAlone(settings)
    assert alone._surfaces(frame) is alone._surfaces(frame)
    count = settings.refinement.surface_points
    assert given == [(frame.depth, frame.camera, settings.sensor, points, cell)
                     for points, cell in zip((count, 10 * count), cells)]
    alone.forget()
    assert not alone._surfaces.knows(frame)


def test_the_iteration_ends_with_a_small_step_or_after_twelve():
    """From 1 m away: depth is a thousand times as sure as the motion expected, and exact."""
    asked, information = [], 1000 * np.linalg.inv(PRIOR)
    expected = PoseWithCovariance(np.eye(4), PRIOR)

    def exact(pose, with_all):
        asked.append(pose)
        return NormalEquations(information, information @ se3.difference(pose, np.eye(4)))

    far = se3.exp([1.0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(depth_alone._solve(
        [SimpleNamespace(equations=exact)], expected, far), np.eye(4), atol=1e-9)
    assert len(asked) == 2  # the second step is none
    asked.clear()
    endless = SimpleNamespace(
        equations=lambda pose, with_all: asked.append(pose) or NormalEquations(
            1e9 * np.eye(6), 1e9 * np.full(6, 1.01e-4)))
    found = depth_alone._solve([endless], expected, np.eye(4))
    assert len(asked) == 12
    # from the second step on five times as long, as the gradient stays as it was
    np.testing.assert_allclose(found[:3, 3], -(1 + 11 * 5) * 1.01e-4, rtol=1e-3)


@pytest.mark.parametrize('axis', range(6))
def test_information_that_claims_four_times_too_much_leaves_nothing_of_the_way(axis):
    """As of a wall with noisy normals, along it: by itself it would leave .75 ** 12 of it."""
    true = np.diag([4e4, 4e4, 1e6, 1e5, 1e5, 4e4])
    claimed = true.copy()
    claimed[axis, axis] *= 4.0
    pair = SimpleNamespace(equations=lambda pose, with_all: NormalEquations(
        claimed, true @ se3.difference(pose, MOTION)))
    found = depth_alone._solve([pair], PoseWithCovariance(np.eye(4), 1e6 * np.eye(6)), np.eye(4))
    np.testing.assert_allclose(se3.difference(found, MOTION), 0.0, atol=1e-4)


def test_all_pairs_have_a_part_in_the_pose():
    """Two that are as sure of two places meet halfway; one of three times the weight nearer."""
    def at(place, information):
        return SimpleNamespace(equations=lambda pose, with_all: NormalEquations(
            information * np.eye(6), information * (
                se3.difference(pose, np.eye(4)) - place * np.eye(6)[0])))
    expected = PoseWithCovariance(np.eye(4), 1e6 * np.eye(6))
    for sure, place in ((1e4, 0.02), (3e4, 0.03)):
        found = depth_alone._solve([at(0.0, 1e4), at(0.04, sure)], expected, np.eye(4))
        np.testing.assert_allclose(found, se3.exp([place, 0, 0, 0, 0, 0]), atol=1e-8)


def beside(play, made, *overlaps):
    """Return a registration with views that share so much with the source, some known before."""
    played = play()
    views = [KnownView(made.prepared(stamp, surface='a surface', twist=np.zeros(6)), made.pose())
             for stamp in range(len(overlaps))]
    for view, share in zip(views, overlaps):
        coarse, _ = played.alone._surfaces(view.prepared.frame)
        played.shared[id(coarse)] = share
    return played, views


@pytest.mark.parametrize('share, weight', [
    (0.3, None), (0.375, 0.25), (0.45, 0.5), (0.6, 1.0), (0.9, 1.0)])
def test_views_that_show_much_of_the_same_have_a_part(play, made, share, weight):
    """They come and go by degrees, judged where the frame is expected."""
    played, (view,) = beside(play, made, share)
    found = played.register([view])
    assert found.status.ok
    for _, _, _, _, pairs, *_ in [entry for entry in played.log if entry[0] == 'solve']:
        assert [pair.weight for pair in pairs] == pytest.approx(
            [1.0] if weight is None else [1.0, weight])
    assert played.log[1] == ('overlap', 'coarse', MOTION)
    poses = [entry[3] for entry in played.log if entry[0] == 'pair']
    assert sum(pose is view.T_view_target for pose in poses) == (1 if weight is None else 3)
    assert played.only('covariance')[0] == 'fine'


def test_the_surfaces_of_one_new_view_are_made_with_each_frame(play, made):
    played, views = beside(play, made, 0.9, 0.8, 0.7)
    for new in views[1:]:
        del played.alone._surfaces.known[id(new.prepared.frame)]
    parts = []
    for _ in range(3):
        played.log.clear()
        played.register(views)
        parts.append(len([entry for entry in played.log if entry[0] == 'solve'][0][4]))
    assert parts == [3, 4, 4]


def test_a_view_with_the_depth_of_another_moment_has_no_part(play, made):
    played, (view,) = beside(play, made, 0.9)
    other = KnownView(dataclasses.replace(view.prepared, repeat=Repeat.DEPTH), view.T_view_target)
    played.register([other])
    assert [entry for entry in played.log if entry[0] == 'pair'][0][3] is not view.T_view_target


def test_a_third_view_holds_what_drifts():
    """The target is known wrong, the others right: two of three hold it, and it is doubted."""
    rng = np.random.default_rng(0)
    off = se3.exp([0.008, -0.006, 0.004, 0, 0, 0])
    poses = [np.eye(4), *(se3.exp(beside) for beside in (
        [-0.02, 0.01, 0, 0, 0.01, 0], [0.01, 0, 0.02, 0.01, 0, 0]))]
    target, *others = (prepared(CORNER, pose, stamp, rng) for stamp, pose in enumerate(poses))
    source = prepared(CORNER, MOTION, 33_000_000, rng)
    expected = PoseWithCovariance(MOTION, PRIOR)
    views = [KnownView(view, se3.inverse(pose) @ off) for view, pose in zip(others, poses[1:])]
    alone = DepthAlone(Settings())
    by_target = alone.register(source, target, expected, PRIOR)
    for _ in views:
        by_all = alone.register(source, target, expected, PRIOR, views)
    errors = [np.linalg.norm(se3.difference(found.T_target_source,
                                            se3.inverse(off) @ MOTION)[:3])
              for found in (by_target, by_all)]
    assert errors[0] == pytest.approx(0.0108, abs=0.002)
    assert errors[1] == pytest.approx(errors[0] / 3, abs=0.002)
    assert np.trace(by_all.covariance) > 1.5 * np.trace(by_target.covariance)


def test_where_planes_of_the_target_hide_a_motion_all_pairs_have_edges(monkeypatch, made):
    played = Played(monkeypatch, made)
    view = KnownView(made.prepared(3, surface='a surface', twist=None, depth_lag=0.0), np.eye(4))
    played.register([view])
    assert [entry for entry in played.log if entry[0] == 'edges'] == []
    played.hidden = np.eye(6)
    played.register([view])
    found = [entry[1:] for entry in played.log if entry[0] == 'edges']
    assert [(name, of) for name, of, _ in found] == [
        (name, ('edges of the source', f'edges of {other}'))
        for name in ('coarse', 'fine') for other in ('the target', 'a view')]
    assert all(pose is MOTION for *_, pose in found)


def beside_a_post(T_world_camera, stamp, rng):
    """Return a frame of a wall in front of which a post stands, of no depth but what hides it."""
    wall, post = (depth_of([(np.array([0.0, 0.0, 1.0]), far)], T_world_camera)
                  for far in (2.5, 1.5))
    v, u = np.mgrid[:CAMERA.height, :CAMERA.width]
    rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones(u.shape)])
    across, = np.tensordot(T_world_camera[:1, :3], rays * post, 1) + T_world_camera[0, 3]
    return with_surface(np.where(np.abs(across - 0.1) < 0.15, post, wall), stamp, rng)


def test_edges_hold_what_planes_do_not():
    """Along a wall with a post before it, where the motion expected is off by 5 cm."""
    rng = np.random.default_rng(1)
    target, source = (beside_a_post(pose, stamp, rng)
                      for pose, stamp in ((np.eye(4), 0), (MOTION, 33_000_000)))
    expected = PoseWithCovariance(se3.exp([0.05, 0, 0, 0, 0, 0]) @ MOTION, PRIOR)
    unobserved = np.diag([4.0, 4.0, 4.0, 1.0, 1.0, 1.0])
    found = DepthAlone(Settings()).register(source, target, expected, unobserved)
    error = se3.difference(found.T_target_source, MOTION)
    assert abs(error[0]) < 0.003
    assert error[0] ** 2 < 9 * found.covariance[0, 0] < 9 * 0.01 ** 2
    assert found.covariance[1, 1] > 0.05 ** 2  # the post shows no motion up or down
