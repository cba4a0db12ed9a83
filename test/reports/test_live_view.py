# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a view of a node logs, read from the file that Rerun makes of it."""

import cv2
import numpy as np
import pytest
from scipy.stats import chi2

from aick_ros.geometry import se3

pytest.importorskip('rerun', reason='no viewer: pip install rerun-sdk')
SECOND, UNKNOWN = 10 ** 9, np.full((6, 6), np.inf)


@pytest.fixture
def view(stream):
    from aick_ros.reports.live_view import LiveView
    return LiveView(stream)


def test_poses_are_shown_at_their_times_with_the_ellipsoid_of_the_position(view, stream):
    pose, sigmas = se3.exp([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]), np.arange(1.0, 7.0) / 100
    view.add_pose(5 * SECOND, np.eye(4), np.zeros((6, 6)))
    view.add_pose(7 * SECOND, pose, np.diag(sigmas ** 2))
    (_, first), (time, position) = stream.values('world/base', 'translation')
    assert (first, time) == ([0.0, 0.0, 0.0], 2.0)
    np.testing.assert_allclose(position, pose[:3, 3], rtol=1e-6)
    _, halves = stream.values('world/covariance', 'half_sizes')[1]
    np.testing.assert_allclose(sorted(halves), chi2.ppf(0.95, 3) ** 0.5 * sigmas[:3], rtol=1e-3)


def test_a_lost_pose_has_no_ellipsoid_and_is_not_tracked(view, stream):
    view.add_pose(0, np.eye(4), np.eye(6))
    view.add_pose(1 * SECOND, np.eye(4), UNKNOWN)
    view.add_lost(2 * SECOND)
    assert stream.values('status/tracked', 'scalars') == [(0.0, 1.0), (1.0, 0.0), (2.0, 0.0)]
    assert len(stream.values('world/covariance', 'half_sizes')) == 1


def test_an_image_keeps_its_colours_and_its_time(view, stream):
    view.add_lost(10 * SECOND)
    colour = np.zeros((16, 32, 3), np.uint8)
    colour[:, 16:] = 200, 40, 90
    view.add_image(13 * SECOND, colour)
    (time, blob), = stream.values('image', 'blob')
    found = cv2.imdecode(np.array(blob, np.uint8), cv2.IMREAD_COLOR)[:, :, ::-1]
    assert time == 3.0
    np.testing.assert_allclose(found[:, 24].mean(axis=0), [200, 40, 90], atol=6)
    np.testing.assert_allclose(found[:, 4].mean(axis=0), [0, 0, 0], atol=6)


def test_diagnostics_are_shown_by_kind_and_their_message_once(view, stream):
    view.add_lost(0)
    for _ in range(2):
        view.add_health('tracking', {'features [ms]': 4.5, 'lost frames': 3.0})
    view.add_health('lost', {})
    assert [text for _, text in stream.values('status/changes', 'text')] == ['tracking', 'lost']
    assert stream.values('times/features', 'scalars') == 2 * [(0.0, 4.5)]
    assert stream.values('health/lost frames', 'scalars') == 2 * [(0.0, 3.0)]


def test_the_world_is_forward_left_up_and_the_base_has_axes(view, stream):
    import rerun as rr
    assert stream.rows('world', 'xyz') == [
        (None, rr.ViewCoordinates.FLU.as_arrow_array().to_pylist())]
    [(time, length)] = stream.values('world/base', 'axis_length')
    assert time is None and length > 0


def test_keypoints_and_the_path_before_are_where_they_are(view, stream):
    points = np.array([[1.0, 2.0, 3.0], [-4.0, 5.0, 6.0]])
    view.add_lost(0)
    view.add_keypoints(2 * SECOND, points)
    view.add_path(points)
    [(time, positions)] = stream.rows('world/keypoints', 'positions')
    assert time == 2.0
    np.testing.assert_allclose(positions, points)
    [(time, strip)] = stream.values('world/path_before', 'strips')
    assert time is None
    np.testing.assert_allclose(strip, points)


def test_turns_and_colours_of_the_base_and_its_path(view, stream):
    """The path to a lost pose is red, the others blue; keypoints green."""
    from aick_ros.reports.trail import ESTIMATE, LOST
    pose = se3.exp([1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
    for stamp, covariance in enumerate([np.eye(6), np.eye(6), UNKNOWN]):
        view.add_pose(stamp * SECOND, pose, covariance)
    columns = [column for _, column in stream.values('world/base', 'mat3x3')]
    np.testing.assert_allclose(np.reshape(columns[0], (3, 3)).T, pose[:3, :3], rtol=1e-6)
    colours = [tuple(colour >> shift & 255 for shift in (24, 16, 8))
               for _, colour in stream.values('world/path', 'colors')]
    assert colours == [ESTIMATE, LOST]
    assert ESTIMATE[2] > ESTIMATE[0] and LOST[0] > LOST[2]


def test_a_pose_with_a_part_that_is_not_known_is_not_tracked(view, stream):
    """The position is known, its rotation is not: there is an ellipsoid, and it is lost."""
    covariance = np.eye(6)
    covariance[5, 5] = np.inf
    view.add_pose(0, np.eye(4), covariance)
    assert stream.values('status/tracked', 'scalars') == [(0.0, 0.0)]
    assert len(stream.values('world/covariance', 'half_sizes')) == 1


def test_the_layout_shows_each_entity_that_is_logged(view, stream):
    from aick_ros.reports.live_view import _blueprint
    view.add_pose(0, np.eye(4), np.eye(6))
    view.add_image(0, np.zeros((4, 4, 3), np.uint8))
    view.add_health('tracking', {'features [ms]': 4.5, 'lost': 1.0})
    above, below = _blueprint().root_container.contents
    views = {part.name: part.origin for part in (*above.contents, *below.contents)}
    assert views == {'space': 'world', 'image and matches': 'image', 'times [ms]': 'times',
                     'tracked': 'status', 'status': 'status'}
    assert set(views.values()) <= {name.split('/')[0] for name in stream.entities}
