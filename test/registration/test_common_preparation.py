# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames prepared as others are, against frames that were prepared so from the start."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.depth_distortion import COLUMNS, NO_DISTORTION, ROWS, DepthDistortion
from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration.common_preparation import CommonPreparation
from aick_ros.registration.depth_alone import DepthAlone
from aick_ros.registration.depth_pair import KnownView
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.learned import Learned
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.samples import Equations
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)


def distortion(seed):
    return DepthDistortion(np.random.default_rng(seed).normal(0, 0.01, (ROWS, COLUMNS)))


@pytest.fixture(scope='module')
def frame():
    """Return a chequered slope."""
    chequers = np.random.default_rng(1).integers(0, 256, (24, 32), np.uint8)
    depth = np.broadcast_to(np.linspace(1.0, 2.0, 320, dtype=np.float32), (240, 320)).copy()
    return RgbdFrame(5, np.kron(chequers, np.ones((10, 10), np.uint8)), depth, CAMERA)


class Known:
    """A distortion that is known, and never learned."""

    def __init__(self, distortion):
        self.distortion = distortion

    def follow(self, camera):
        pass

    def learn(self, equations):
        pass


def prepared(frame, known):
    """Return a frame prepared where a distortion is known, and the preparer."""
    registrar = Registrar(learned=Learned(distortion=Known(known)))
    return registrar.prepare(frame), registrar.preparer


@pytest.mark.parametrize('before', [NO_DISTORTION, distortion(2)])
def test_a_frame_is_as_if_it_had_been_prepared_with_the_other_distortion(frame, before):
    now = distortion(3)
    (old, preparer), (new, _) = prepared(frame, before), prepared(frame, now)
    found = CommonPreparation(preparer, 2)(old, new)
    assert found.distortion is now
    assert found.frame.colour is old.frame.colour
    np.testing.assert_allclose(found.frame.depth, new.frame.depth, rtol=1e-6)
    np.testing.assert_array_equal(found.keypoints.pixels, new.keypoints.pixels)
    np.testing.assert_array_equal(found.keypoints.descriptors, new.keypoints.descriptors)
    np.testing.assert_allclose(found.keypoints.positions, new.keypoints.positions, rtol=5e-4)
    assert found.keypoints.positions.dtype == np.float32
    np.testing.assert_allclose(found.surface.points[found.surface.usable],
                               new.surface.points[found.surface.usable], rtol=1e-5)
    difference = np.abs(old.keypoints.positions - new.keypoints.positions).max()
    assert difference > 20 * np.abs(found.keypoints.positions - new.keypoints.positions).max()


@pytest.mark.parametrize('known', [NO_DISTORTION, distortion(3)])
@pytest.mark.parametrize('changed', [
    {'features.orb.patch_size': 21}, {'features.detector': 'sift'}, {'sensor.max_depth': 1.5},
    {'aick.vocabulary': 'orb-1000'}, {'refinement.mode': 'keypoints'},
    {'refinement.surface_points': 100}])
def test_a_frame_of_other_settings_is_prepared_again(frame, known, changed):
    old = prepared(frame, NO_DISTORTION)[0].with_keypoints(KeypointFrame.none(5), is_tracked=True)
    registrar = Registrar(with_values(Settings(), changed),
                          learned=Learned(distortion=Known(known)))
    new = registrar.prepare(frame)
    found = registrar.prepared_like(old, new)
    assert found.settings == new.settings != old.settings and not found.is_tracked
    assert (found.keypoints.words is None) == (new.keypoints.words is None)
    for name in ('positions', 'descriptors', 'covariances', 'pixels'):
        np.testing.assert_allclose(getattr(found.keypoints, name), getattr(new.keypoints, name),
                                   rtol=1e-5)
    if new.surface is None:
        assert found.surface is None
    else:
        np.testing.assert_allclose(found.surface.points[found.surface.chosen],
                                   new.surface.points[new.surface.chosen], rtol=1e-5)
    assert registrar.prepared_like(old, new) is found
    assert registrar.prepared_again(found) is found
    assert registrar.prepared_again(old).settings == new.settings


@pytest.mark.parametrize('old_settings, new_settings', [
    ('known', None), (None, 'known'), (None, None)])
def test_a_frame_of_unknown_settings_is_by_those_of_now(frame, old_settings, new_settings):
    (old, preparer), (new, _) = (prepared(frame, known) for known in (
        NO_DISTORTION, distortion(3)))
    old, new = (one if settings else dataclasses.replace(one, settings=None)
                for one, settings in ((old, old_settings), (new, new_settings)))
    alike = CommonPreparation(preparer, 2)
    found = alike(old, new)
    np.testing.assert_allclose(found.frame.depth, new.frame.depth, rtol=1e-6)
    np.testing.assert_allclose(found.keypoints.positions, new.keypoints.positions, rtol=5e-4)
    np.testing.assert_allclose(found.surface.points[found.surface.usable],
                               new.surface.points[found.surface.usable], rtol=1e-5)
    assert alike(found, new) is found and alike.prepared_again(old) is old


def test_frames_are_not_brought_to_settings_that_are_not_those_of_now(frame):
    old = prepared(frame, NO_DISTORTION)[0]
    other = Registrar(with_values(Settings(), {'features.orb.patch_size': 21})).prepare(frame)
    alike = CommonPreparation(prepared(frame, NO_DISTORTION)[1], 2)
    with pytest.raises(InputError, match='the source is prepared by other settings'):
        alike(old, other)
    with pytest.raises(InputError, match='the source is prepared by other settings'):
        alike(other, dataclasses.replace(other, distortion=distortion(3)))
    assert alike(other, other) is other


def test_a_depth_image_of_another_moment_shows_no_surface_again(frame):
    old = dataclasses.replace(prepared(frame, NO_DISTORTION)[0], repeat=Repeat.DEPTH, surface=None)
    registrar = Registrar(with_values(Settings(), {'features.max_keypoints': 50}))
    again = registrar.prepared_again(old)
    assert again.surface is None and len(again.keypoints) == 50


def test_a_frame_with_the_same_distortion_stays(frame):
    known = distortion(2)
    (one, preparer), (other, _) = prepared(frame, known), prepared(frame, known)
    assert CommonPreparation(preparer, 2)(one, other) is one


def test_a_frame_is_brought_once_until_the_distortion_changes_again(frame):
    one, preparer = prepared(frame, NO_DISTORTION)
    alike = CommonPreparation(preparer, 2)
    second, third = (prepared(frame, distortion(seed))[0] for seed in (3, 4))
    found = alike(one, second)
    assert alike(one, second) is found
    again = alike(one, third)
    assert again is not found and again.distortion is third.distortion


def test_as_many_frames_are_kept_as_are_compared_at_once(frame):
    (one, preparer), other = prepared(frame, NO_DISTORTION), prepared(frame, distortion(3))[0]
    frames = [one, *(dataclasses.replace(one) for _ in range(2))]
    alike = CommonPreparation(preparer, 2)
    first, second, third = (alike(each, other) for each in frames)
    assert alike(frames[2], other) is third and alike(frames[1], other) is second
    assert alike(one, other) is not first


def test_a_frame_can_be_brought_back_to_how_it_was_measured(frame):
    corrected, preparer = prepared(frame, distortion(2))
    other, _ = prepared(frame, NO_DISTORTION)
    found = CommonPreparation(preparer, 2)(corrected, other)
    assert found.distortion is NO_DISTORTION
    np.testing.assert_allclose(found.frame.depth, frame.depth, rtol=1e-6)


def test_a_frame_without_a_surface_gets_none(frame):
    one, preparer = prepared(frame, NO_DISTORTION)
    other, _ = prepared(frame, distortion(3))
    without = dataclasses.replace(one, surface=None)
    assert CommonPreparation(preparer, 2)(without, other).surface is None


@pytest.mark.parametrize('is_ahead', [False, True])
def test_another_image_of_the_camera_has_no_distortion_that_was_learned(frame, is_ahead):
    """Also of a frame that was prepared on another thread, with what was known before."""
    learned, true = Learned(), distortion(2).nodes.ravel()
    registrar = Registrar(learned=learned)
    registrar.prepare(frame)
    information = 1e9 * np.eye(12 + len(true))
    for _ in range(40):
        learned.distortion.learn(Equations(information, information @ [*np.zeros(12), *true]))
    one = registrar.prepare(frame)
    assert one.distortion is learned.distortion.distortion is not NO_DISTORTION
    cropped = RgbdFrame(6, frame.colour[30:-30, 40:-40], frame.depth[30:-30, 40:-40],
                        Camera(240, 180, 262.5, 262.5, 119.5, 89.5))
    other = (registrar.prepared(registrar.preparer.prepare(cropped)) if is_ahead
             else registrar.prepare(cropped))
    assert other.distortion is learned.distortion.distortion is NO_DISTORTION
    assert registrar.preparer.distortion is NO_DISTORTION
    np.testing.assert_array_equal(other.frame.depth, cropped.depth)
    measured = cropped.camera.back_project(other.keypoints.pixels.astype(float),
                                           other.keypoints.positions[:, 2].astype(float))
    np.testing.assert_allclose(other.keypoints.positions, measured, atol=1e-3)


@pytest.mark.parametrize('known', [NO_DISTORTION, distortion(2)])
@pytest.mark.parametrize('copied', [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_a_frame_with_a_copy_of_the_distortion_stays(frame, known, copied):
    """As one that was prepared before its registrar was copied, or sent to another process."""
    one, preparer = prepared(frame, known)
    preparer = copied(preparer)
    ahead = preparer.prepare(frame)
    other = dataclasses.replace(one, distortion=preparer.distortion)
    assert other.distortion is not one.distortion
    assert CommonPreparation(preparer, 2)(one, other) is one
    preparer.distortion = copied(preparer.distortion)
    assert ahead.up_to_date() is ahead


@pytest.mark.parametrize('known', [NO_DISTORTION, distortion(3)])
def test_by_depth_alone_the_distortion_counts_and_no_keypoint(frame, known, monkeypatch):
    """Frames that had no surface by their settings, too: depth alone makes its own."""
    changed = {'features.orb.patch_size': 21, 'refinement.mode': 'keypoints'}
    target, other = (Registrar(with_values(Settings(), changed)).prepare(
        dataclasses.replace(frame, stamp=stamp)) for stamp in (3, 4))
    registrar = Registrar(learned=Learned(distortion=Known(known)))
    source, registered = registrar.prepare(frame), []
    register = DepthAlone.register
    monkeypatch.setattr(KeypointExtractor, 'extract', None)
    monkeypatch.setattr(DepthAlone, 'register', lambda self, *those: (
        registered.append((those[1], those[-1][0].prepared)) or register(self, *those)))
    expected = PoseWithCovariance(np.eye(4), 1e-4 * np.eye(6))
    for _ in range(2):
        found = registrar.register_depth(source, target, expected, np.eye(6),
                                         [KnownView(other, np.eye(4))])
        assert found.status.ok
        np.testing.assert_allclose(found.T_target_source, np.eye(4), atol=1e-4)
    assert all(one is two for one, two in zip(*registered))
    for before, used in zip((target, other), registered[0]):
        assert (used is before) == known.is_none and used.distortion == known
        np.testing.assert_allclose(used.frame.depth, source.frame.depth, rtol=1e-6)


@pytest.mark.parametrize('how, mode', [('register', 'none'), ('recognize', 'none'),
                                       ('register', 'joint'), ('recognize', 'joint'),
                                       ('track', 'joint')])
def test_registrations_compare_frames_with_the_same_distortion(frame, how, mode):
    """The same image twice: what is left of a distortion would show as a motion along the ray."""
    known = Known(NO_DISTORTION)
    registrar = Registrar(with_values(Settings(), {'refinement.mode': mode}),
                          learned=Learned(distortion=known))
    target = registrar.prepare(frame)
    known.distortion = DepthDistortion(np.full((ROWS, COLUMNS), 0.02))  # 3 cm at 1.2 m
    source = registrar.prepare(dataclasses.replace(frame, stamp=6))
    arguments = (ExpectedPose(np.eye(4), 0.03),) if how == 'track' else ()
    found = getattr(registrar, how)(source, target, *arguments)
    found = found[1] if how == 'track' else found
    assert found.status.ok
    np.testing.assert_allclose(found.T_target_source, np.eye(4), atol=1e-3)
