# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Objects that move by themselves, where two frames see them."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.found_objects import FoundObjects
from aick_ros.registration.tracks import Tracks

POSE = se3.exp([0.1, -0.05, 0.02, 0.02, 0.05, -0.01])
NOW = 50 * NANOSECONDS


def tracks_at(points, moved=np.zeros(3)):
    """Return tracks of points of which the target measures where they have moved to."""
    seen = se3.transform(POSE, points + moved)
    return Tracks(np.arange(len(points)), points, seen[:, :2] / seen[:, 2:], seen[:, 2].copy(),
                  np.full(len(points), 0.01))


@pytest.fixture
def scene_and_objects():
    rng = np.random.default_rng(4)
    return (tracks_at(rng.uniform([-1, -1, 2], [1, 1, 3], (30, 3))),
            tracks_at(rng.uniform([-0.2, -0.2, 1], [0.2, 0.2, 1.2], (20, 3)),
                      np.array([0.05, 0.0, -0.1])))


def test_both_frames_see_them_where_they_are(scene_and_objects):
    """An object has moved, so the target sees it where the pose of the scene does not put it."""
    scene, objects = scene_and_objects
    found = FoundObjects.of(scene, objects, POSE, NOW)
    assert found.source.scene is scene.points and found.source.objects is objects.points
    np.testing.assert_allclose(found.target.scene, se3.transform(POSE, scene.points), atol=1e-9)
    np.testing.assert_allclose(found.target.objects, se3.transform(
        POSE, objects.points + [0.05, 0.0, -0.1]), atol=1e-9)
    assert found.source.seen == found.target.seen == NOW
    assert found.count == 20
