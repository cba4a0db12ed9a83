# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The truth that a demonstration compares the base with."""

import numpy as np

from aick_ros.cli.commands import demo
from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory


def test_the_base_is_where_its_camera_and_the_extrinsic_say():
    """A base that drives ahead: its camera looks along x, with y down."""
    bases = np.array([se3.from_roll_pitch_yaw(0.1, 0.2, 0.3 * i, (0.5 * i, -0.2, 0.1))
                      for i in range(5)])
    T_base_camera = np.eye(4)
    T_base_camera[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    found = demo._of_base(Trajectory(np.arange(5), bases @ T_base_camera))
    np.testing.assert_array_equal(found.stamps, np.arange(5))
    np.testing.assert_allclose(found.poses, bases, atol=1e-12)
    assert demo._of_base(None) is None
