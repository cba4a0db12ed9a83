# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Each method against the exact motion of a rendered camera, and against frames of nothing."""

import dataclasses
import importlib

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.baselines import registry
from aick_ros.evaluation.baselines.registry import METHODS, make, methods_of
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.registrar import Registrar
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

APART = 2  # frames
SLOW = ('gicp', 'ndt')  # seconds a pair; gicp-tuned and ndt-tuned are the same code


@pytest.fixture(scope='module')
def source():
    return SyntheticSource(SyntheticOptions.perfect(seed=4, frames=APART + 1))


@pytest.fixture(scope='module')
def pair(source):
    """Return the later and the earlier frame, and the true transform between them."""
    truth = source.ground_truth.poses
    return source.frame(APART), source.frame(0), se3.inverse(truth[0]) @ truth[APART]


@pytest.fixture(params=[name for name in METHODS if name not in SLOW])
def method(request):
    method = METHODS[request.param]
    if method.missing:
        pytest.skip(f'{method.name} is not installed: {method.missing}')
    return method


@pytest.fixture
def baseline(method):
    return make(method.factory, method.options)


def test_finds_the_motion_of_a_rendered_camera(baseline, pair):
    source, target, truth = pair
    estimate = baseline.register(baseline.prepare(source), baseline.prepare(target))
    error = se3.inverse(truth) @ estimate.T_target_source
    motion = np.linalg.norm(truth[:3, 3])
    assert np.linalg.norm(error[:3, 3]) < 0.3 * motion > 0.01
    assert se3.angle(error[:3, :3]) < 0.3 * se3.angle(truth[:3, :3])
    assert estimate.failure == ''


def test_featureless_frames_fail_with_a_reason(baseline, pair):
    camera = pair[0].camera
    shape = camera.height, camera.width
    nothing = RgbdFrame(1, np.full(shape, 128, np.uint8), np.full(shape, np.nan, np.float32),
                        camera)
    estimate = baseline.register(baseline.prepare(nothing), baseline.prepare(nothing))
    assert estimate.T_target_source is None
    assert estimate.failure


def test_the_same_frames_give_the_same_answers(method, pair):
    """Two of a method that are given the same pairs, in turn: neither knows of the other."""
    both = [make(method.factory, method.options) for _ in range(2)]
    prepared = [[one.prepare(frame) for frame in pair[:2]] for one in both]
    answers = [[one.register(*frames[::order]).T_target_source
                for one, frames in zip(both, prepared)] for order in (1, -1, 1)]
    exactness = 1e-5 if method.needs else 0.0  # others may sum in the order of their threads
    for one, other in answers:
        np.testing.assert_allclose(one, other, rtol=0, atol=exactness)
    change = np.abs(se3.difference(answers[2][0], answers[0][0]))
    if method.name != 'aick':
        assert change.max() <= exactness
    else:  # with what it learned of the camera in between, which is within the noise
        registrar = Registrar()
        covariance = registrar.register(*map(registrar.prepare, pair[:2])).covariance
        assert (change < 0.3 * np.sqrt(np.diag(covariance))).all()
        assert change.any()


def test_frames_are_not_changed(baseline, pair):
    """Each of the compared methods is given the same ones."""
    frames = [dataclasses.replace(frame, colour=frame.colour.copy(), depth=frame.depth.copy())
              for frame in pair[:2]]
    baseline.register(*map(baseline.prepare, frames))
    for frame, before in zip(frames, pair):
        np.testing.assert_array_equal(frame.colour, before.colour)
        np.testing.assert_array_equal(frame.depth, before.depth)


def test_lens_distortion_is_removed(baseline, pair, bent):
    """With the coefficients of the lens the motion is the same."""
    truth = pair[2]
    estimate = baseline.register(*map(baseline.prepare, bent))
    error = se3.inverse(truth) @ estimate.T_target_source
    assert np.linalg.norm(error[:3, 3]) < 0.3 * np.linalg.norm(truth[:3, 3])


@pytest.fixture(scope='module')
def bent(pair):
    """Return the two frames through a lens with the distortion of a Kinect."""
    cv2 = importlib.import_module('cv2')

    def bend(frame):
        camera = dataclasses.replace(frame.camera, distortion_model='plumb_bob',
                                     distortion=(0.2624, -0.9531, -0.0054, 0.0026, 1.1633))
        v, u = np.mgrid[:camera.height, :camera.width]
        rays = camera.normalize(np.column_stack([u.ravel(), v.ravel()]))
        seen = Camera(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
        maps = seen.project(np.column_stack([rays, np.ones(len(rays))])).astype(np.float32)
        columns, rows = maps.T.reshape(2, camera.height, camera.width).copy()
        return RgbdFrame(frame.stamp, cv2.remap(frame.colour, columns, rows, cv2.INTER_LINEAR),
                         cv2.remap(frame.depth, columns, rows, cv2.INTER_NEAREST,
                                   borderValue=float('nan')), camera)
    return [bend(frame) for frame in pair[:2]]


def test_names_of_methods():
    assert [method.name for method in methods_of('pnp, aick,pnp')] == ['pnp', 'aick']
    assert [method.name for method in methods_of('all')] == list(METHODS)
    with pytest.raises(InputError, match="'icp': the methods are all, aick, aick-orb"):
        methods_of('aick,icp')


def test_a_method_names_its_requirements(monkeypatch):
    monkeypatch.setattr(registry.importlib.util, 'find_spec', lambda name: None)
    assert METHODS['small-gicp'].missing == (
        "pip install '.[baselines]' in the folder of aick_ros")
    assert METHODS['aick-orb'].missing == ''


def test_methods_differ_in_what_decides_about_their_results():
    identities = [method.identity for method in METHODS.values()]
    assert len(set(identities)) == len(METHODS)
