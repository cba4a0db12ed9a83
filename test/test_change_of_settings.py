# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Settings that change on the way, each with frames of the settings before."""

import numpy as np

from aick_ros import rigid
from aick_ros.odometry import Odometry
from aick_ros.parameter import with_values
from aick_ros.settings import Settings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.status import Status

CHANGES = [
    {}, {'refinement.mode': 'none'}, {'refinement.mode': 'keypoints'}, {},
    {'aick.vocabulary': 'orb-1000'}, {'refinement.mode': 'none'},
    {'refinement.surface_points': 100}, {'refinement.max_tracks': 50},
    {'features.max_keypoints': 150}, {'features.orb.patch_size': 21}, {},
]


def test_no_change_within_a_detector_loses_the_pose():
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=len(CHANGES)))
    odometry = Odometry()
    for i, changed in enumerate(CHANGES):
        odometry.change_settings(with_values(Settings(), changed))
        update = odometry.register_frame(source.frame(i))
        assert update.status is (Status.OK if i else Status.FIRST_FRAME), changed
        truth = rigid.inverse(source.ground_truth.poses[0]) @ source.ground_truth.poses[i]
        apart = rigid.inverse(truth) @ update.T_odom_camera
        assert np.linalg.norm(apart[:3, 3]) < 0.01, changed
