# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What cv2.Odometry is given, and its answers against the ground truth of rendered frames."""

import dataclasses
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.evaluation.baselines.opencv_odometry import OpencvOdometry
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

pytestmark = pytest.mark.skipif(not hasattr(cv2, 'Odometry'), reason='OpenCV 5 is required')
CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)


@pytest.fixture(scope='module')
def source():
    return SyntheticSource(SyntheticOptions(seed=2, frames=2, camera=CAMERA))


@pytest.fixture(scope='module')
def frames(source):
    return source.frame(0), source.frame(1)


@pytest.fixture
def made(monkeypatch):
    """Return what odometries are made of, in order, and the odometries."""
    made, odometry = [], cv2.Odometry
    monkeypatch.setattr(cv2, 'Odometry', lambda *parts: (
        made.append((*parts, odometry(*parts))) or made[-1][-1]))
    return made


def motion_of(method, source, target):
    return method.register(method.prepare(source), method.prepare(target)).T_target_source


@pytest.mark.parametrize('colour, kind', [
    (True, 'OdometryType_RGB_DEPTH'), (False, 'OdometryType_DEPTH')])
def test_colour_is_blue_green_red_and_depth_in_metres(made, frames, colour, kind):
    prepared = OpencvOdometry(colour).prepare(frames[0])
    np.testing.assert_array_equal(prepared.getImage(), frames[0].colour[:, :, ::-1])
    np.testing.assert_array_equal(prepared.getDepth(), frames[0].depth)
    [(made_kind, settings, algorithm, _)] = made
    assert (made_kind, algorithm) == (getattr(cv2, kind), cv2.OdometryAlgoType_COMMON)
    np.testing.assert_array_equal(settings.getCameraMatrix(), CAMERA.matrix)


def test_grey_stays_grey(frames):
    grey = frames[0].colour[:, :, 0].copy()
    prepared = OpencvOdometry(True).prepare(dataclasses.replace(frames[0], colour=grey))
    np.testing.assert_array_equal(prepared.getImage(), grey)


def test_another_camera_has_another_odometry(made, frames):
    method, other = OpencvOdometry(True), dataclasses.replace(CAMERA, fx=270.0)
    for camera in (CAMERA, CAMERA, other):
        method.prepare(dataclasses.replace(frames[0], camera=camera))
    assert [settings.getCameraMatrix()[0, 0] for _, settings, *_ in made] == [262.5, 270.0]


@pytest.mark.parametrize('colour', [True, False])
def test_the_source_comes_first_and_its_motion_is_returned(source, frames, colour):
    """The camera moves by 21 mm, of which the error is a part; the other way it would be twice."""
    first, second = source.ground_truth.poses[:2]
    truth = se3.inverse(first) @ second
    found = motion_of(OpencvOdometry(colour), frames[1], frames[0])
    error = se3.log(se3.inverse(truth) @ found)
    assert np.linalg.norm(truth[:3, 3]) > 0.02
    assert np.linalg.norm(error[:3]) < 0.007
    assert np.linalg.norm(error[3:]) < np.radians(0.3)


def test_of_depth_alone_colour_changes_nothing(frames):
    grey = tuple(dataclasses.replace(frame, colour=np.full_like(frame.colour, 90))
                 for frame in frames)
    found, found_grey = ([motion_of(OpencvOdometry(colour), *given) for colour in (True, False)]
                         for given in (frames, grey))
    np.testing.assert_array_equal(found[1], found_grey[1])
    assert found_grey[0] is None or not np.array_equal(found[0], found_grey[0])


def test_without_any_depth_it_is_a_failure(frames):
    method = OpencvOdometry(False)
    blind = dataclasses.replace(frames[0], depth=np.full_like(frames[0].depth, np.nan))
    estimate = method.register(method.prepare(frames[1]), method.prepare(blind))
    assert (estimate.T_target_source, estimate.failure) == (None, 'OpenCV found no transform')


@pytest.mark.parametrize('number', [np.nan, np.inf])
def test_a_motion_that_is_not_finite_is_a_failure(frames, number):
    """These frames have none: the answer alone is replaced, which no subclass in Python can."""
    method = OpencvOdometry(False)
    prepared = method.prepare(frames[0])
    method._odometry = SimpleNamespace(compute=lambda *_: (True, np.diag([1, 1, number, 1])))
    assert method.register(prepared, prepared).failure == 'OpenCV found no transform'
