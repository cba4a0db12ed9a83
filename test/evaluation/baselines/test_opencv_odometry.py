# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What cv2.Odometry is given, by a stand-in for it, and what its answers become."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.evaluation.baselines.opencv_odometry import OpencvOdometry
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera

CAMERA = Camera(4, 3, 5.0, 6.0, 1.5, 1.0)
COLOUR = np.arange(36, dtype=np.uint8).reshape(3, 4, 3)


@pytest.fixture
def library(monkeypatch):
    """Return the stand-in, which keeps what it is given."""
    library = SimpleNamespace(made=[], frames=[], answer=(True, np.eye(4)))

    class Odometry:

        def __init__(self, kind, settings, algorithm):
            library.made.append((kind, settings.matrix, algorithm))

        def prepareFrame(self, frame):  # noqa: N802
            library.frames.append((self, *frame))

        def compute(self, source, target):
            library.registered = source, target
            return library.answer

    class OdometrySettings:

        def setCameraMatrix(self, matrix):  # noqa: N802
            self.matrix = matrix

    for name, part in {'Odometry': Odometry, 'OdometrySettings': OdometrySettings,
                       'OdometryFrame': lambda depth, colour: (depth, colour),
                       'OdometryType_RGB_DEPTH': 'both', 'OdometryType_DEPTH': 'depth',
                       'OdometryAlgoType_COMMON': 'common'}.items():
        monkeypatch.setattr(cv2, name, part, raising=False)
    return library


def frame(camera=CAMERA, colour=COLOUR):
    return RgbdFrame(1, colour, np.full((3, 4), 2.0, np.float32), camera)


@pytest.mark.parametrize('colour, kind', [(True, 'both'), (False, 'depth')])
def test_colour_is_blue_green_red_and_depth_in_metres(library, colour, kind):
    depth, image = OpencvOdometry(colour).prepare(frame())
    np.testing.assert_array_equal(image, COLOUR[:, :, ::-1])
    np.testing.assert_array_equal(depth, np.full((3, 4), 2.0))
    (made, matrix, algorithm), = library.made
    assert (made, algorithm, matrix.dtype) == (kind, 'common', np.float32)
    np.testing.assert_array_equal(matrix, CAMERA.matrix)


def test_grey_stays_grey(library):
    _, image = OpencvOdometry(True).prepare(frame(colour=COLOUR[:, :, 0].copy()))
    np.testing.assert_array_equal(image, COLOUR[:, :, 0])


def test_another_camera_has_another_odometry(library):
    method, other = OpencvOdometry(True), Camera(4, 3, 7.0, 6.0, 1.5, 1.0)
    for camera in (CAMERA, CAMERA, other):
        method.prepare(frame(camera))
    assert [matrix[0, 0] for _, matrix, _ in library.made] == [5.0, 7.0]
    first, second, third = (odometry for odometry, *_ in library.frames)
    assert first is second is not third


def test_the_source_comes_first_and_its_motion_is_returned(library):
    method, motion = OpencvOdometry(True), np.diag([1.0, 1.0, 1.0, 1.0])
    motion[:3, 3] = 1.0, 2.0, 3.0
    library.answer = True, motion
    method.prepare(frame())
    estimate = method.register('source', 'target')
    assert library.registered == ('source', 'target')
    np.testing.assert_array_equal(estimate.T_target_source, motion)


@pytest.mark.parametrize('answer', [(False, np.eye(4)), (True, np.diag([1, 1, np.nan, 1])),
                                    (True, np.diag([1, 1, np.inf, 1]))])
def test_what_is_no_motion_is_a_failure(library, answer):
    method = OpencvOdometry(False)
    method.prepare(frame())
    library.answer = answer
    estimate = method.register(None, None)
    assert (estimate.T_target_source, estimate.failure) == (None, 'OpenCV found no transform')
