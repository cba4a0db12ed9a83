# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""True poses and motions of a camera that moves at constant velocity."""

import numpy as np
import pytest

from aick_ros.evaluation.scores.ground_truth import MAX_INTERPOLATION_GAP, true_motion, true_pose
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory

TWIST = np.array([0.3, -0.2, 0.1, 0.2, 0.4, -0.3])
START = se3.exp([1.0, 2.0, 3.0, 0.5, -0.4, 0.3])
GAP = round(MAX_INTERPOLATION_GAP * NANOSECONDS)


@pytest.fixture
def path():
    """Return poses as far apart as may be, and then one nanosecond farther."""
    stamps = np.array([0, GAP, 2 * GAP, 3 * GAP + 1])
    return Trajectory(stamps, np.array([START @ se3.exp(TWIST * stamp / GAP)
                                        for stamp in stamps]))


def test_a_motion_is_that_of_the_source_in_the_target(path):
    motion = true_motion(path, GAP, 2 * GAP)
    np.testing.assert_allclose(motion, se3.exp(TWIST), atol=1e-9)
    np.testing.assert_allclose(true_motion(path, 2 * GAP, GAP), se3.exp(-TWIST), atol=1e-9)
    np.testing.assert_allclose(true_pose(path, 0) @ true_motion(path, 0, GAP),
                               true_pose(path, GAP), atol=1e-9)


def test_poses_are_interpolated_up_to_the_longest_gap(path):
    halfway = true_pose(path, GAP // 2)
    np.testing.assert_allclose(halfway[:3, :3], (START @ se3.exp(TWIST / 2))[:3, :3], atol=1e-9)
    assert true_pose(path, 2 * GAP + 5) is None


@pytest.mark.parametrize('target, source', [(0, 2 * GAP + 5), (2 * GAP + 5, 0), (-1, 0)])
def test_without_one_of_the_poses_there_is_no_motion(path, target, source):
    assert true_motion(path, target, source) is None
