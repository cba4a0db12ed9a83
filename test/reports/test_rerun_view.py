# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a view logs of a run, read from the file that Rerun makes of it."""

import dataclasses
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.status import Status

pytest.importorskip('rerun', reason='no viewer: pip install rerun-sdk')


@pytest.fixture
def shown(stream):
    """Return a function that shows records, and returns the stream."""
    from aick_ros.reports.rerun_view import RerunView

    def show(records, ground_truth=None):
        view = RerunView(stream, ground_truth)
        for record in records:
            view.add_record(record)
        return stream
    return show


def test_a_status_is_told_when_it_changes_by_its_reason_or_else_its_meaning(shown, records):
    assert shown(records).values('status/changes', 'text') == [
        (0.0, f'OK: {Status.OK.value}'),
        (pytest.approx(40 / 30), 'TOO_FEW_MATCHES: 5 matches, odometry.min_matches is <12>'),
        (pytest.approx(43 / 30), f'OK: {Status.OK.value}')]


def test_the_numbers_of_each_frame_are_shown_at_its_time(shown, records):
    stream = shown(records)
    for entity, expected in (
            ('status/matches', [record.matches for record in records]),
            ('status/tracked', [float(record.status.ok) for record in records]),
            ('times/total', [record.timing['total'] for record in records])):
        times, found = zip(*stream.values(entity, 'scalars'))
        np.testing.assert_allclose(times, np.arange(90) / 30, atol=1e-9)
        assert list(found) == expected


def test_the_ellipsoid_holds_95_percent_of_the_positions(shown, records):
    root = np.random.default_rng(3).normal(0, 0.01, (6, 6))
    pose = PoseWithCovariance(records[0].pose.matrix, root @ root.T)
    stream = shown([dataclasses.replace(records[0], pose=pose)])
    (_, halves), = stream.values('world/covariance', 'half_sizes')
    (_, quaternion), = stream.values('world/covariance', 'quaternions')
    axes = Rotation.from_quat(quaternion).as_matrix()
    np.testing.assert_allclose(
        axes @ np.diag(np.square(halves)) @ axes.T,
        chi2.ppf(0.95, 3) * (root @ root.T)[:3, :3], rtol=1e-3, atol=1e-9)


def test_an_unknown_pose_has_no_ellipsoid(shown, records):
    pose = PoseWithCovariance(np.eye(4), np.full((6, 6), np.inf))
    assert 'world/covariance' not in shown([dataclasses.replace(records[0], pose=pose)]).entities


def test_errors_are_those_since_the_first_frame(shown, records, ground_truth):
    """Off by 3 and 4 mm and by half a degree from the second frame on."""
    off = se3.from_roll_pitch_yaw(0.0, 0.0, np.radians(0.5), (0.003, 0.0, -0.004))
    records[1:] = [dataclasses.replace(
        record, pose=PoseWithCovariance(record.pose.matrix @ off, record.pose.covariance))
        for record in records[1:]]
    stream = shown(records, ground_truth)
    for entity, error in (('errors/position_mm', 5.0), ('errors/rotation_deg', 0.5)):
        found = [value for _, value in stream.values(entity, 'scalars')]
        np.testing.assert_allclose(found, [0.0, *[error] * 89], atol=1e-5)


def views(container):
    """Yield the views in a container of the layout, each with its share of the height."""
    for share, row in zip(container.row_shares, container.contents):
        for view in row.contents:
            yield view, share


def test_each_view_shows_what_is_logged(stream, records, ground_truth, monkeypatch):
    from rerun.blueprint import TextLogView

    from aick_ros.reports.rerun_view import RerunView
    sent = []
    send = stream.send_blueprint
    monkeypatch.setattr(stream, 'send_blueprint', lambda layout: (
        sent.append(layout), send(layout)))
    view = RerunView(stream, ground_truth)
    for record in records:
        view.add_record(record)
    [blueprint] = sent
    shown = dict(views(blueprint.root_container))
    origins = {each.origin for each in shown}
    assert origins == {'world', 'world/camera/image', 'errors', 'times', 'status'}
    for origin in origins - {'world/camera/image'}:  # these records have no images
        assert any(entity.startswith(origin) for entity in stream.entities)
    [space] = [each for each in shown if each.origin == 'world']
    assert shown[space] == max(shown.values()) > min(shown.values())
    assert {each.origin for each in shown if isinstance(each, TextLogView)} == {'status'}


def test_the_truth_is_drawn_once_from_the_first_pose(shown, records, ground_truth):
    stream = shown(records, ground_truth)
    [(time, strips)] = stream.values('world/truth', 'strips')
    assert time is None
    np.testing.assert_allclose(strips, [record.T_odom_camera[:3, 3] for record in records],
                               atol=1e-5)


@pytest.mark.parametrize('step', [1, 4])
def test_a_smaller_image_has_a_smaller_camera(step):
    from aick_ros.reports.rerun_view import _pinhole
    pinhole = _pinhole(Camera(642, 484, 500.0, 520.0, 320.0, 244.0), step)
    matrix = np.array(pinhole.image_from_camera.as_arrow_array().to_pylist()[0]).reshape(3, 3).T
    np.testing.assert_allclose(matrix, [[500 / step, 0, 320 / step],
                                        [0, 520 / step, 244 / step], [0, 0, 1]])
    assert pinhole.resolution.as_arrow_array().to_pylist()[0] == [642 // step, 484 // step]


class Keypoints:
    def __init__(self, pixels):
        self.pixels = np.array(pixels, np.float32)

    def __len__(self):
        return len(self.pixels)


def update(record, keypoints, reference=None, matches=()):
    """Return what is shown of an update: a record with its image, keypoints and matches."""
    from aick_ros.reports.shown_frame import ShownFrame
    camera = Camera(8, 8, 10.0, 12.0, 4.0, 3.0)
    colour = np.full((8, 8, 3), (200, 40, 90), np.uint8)
    frame = RgbdFrame(record.stamp, colour, np.full((8, 8), 1.5, np.float32), camera)
    return ShownFrame.of(SimpleNamespace(**{
        **vars(record), 'keypoints': keypoints, 'reference': reference,
        'matches': np.array(matches, int).reshape(-1, 2),
        'prepared': SimpleNamespace(frame=frame)}))


def at(record, x):
    pose = np.eye(4)
    pose[0, 3] = x
    return dataclasses.replace(record, stamp=round(x * 10 ** 9), pose=PoseWithCovariance(pose))


def test_matches_lead_to_the_keypoints_of_the_keyframe_and_edges_to_its_place(stream, records):
    from aick_ros.reports.rerun_view import RerunView
    view = RerunView(stream, None)
    first, second = Keypoints([[1, 2], [3, 4]]), Keypoints([[5, 6], [7, 8], [1, 1]])
    begun, moved = update(at(records[0], 1.0), first), update(
        at(records[0], 2.0), second, first, [(2, 0), (0, 1)])
    view.add(begun)
    begun.record.T_odom_camera[0, 3] = 99.0  # in place, as its owner may
    view.add(moved)
    assert stream.rows('world/camera/image/matches', 'strips') == [
        (0.0, []), (1.0, [[[1, 1], [1, 2]], [[5, 6], [3, 4]]])]
    assert stream.rows('world/camera/image/keypoints', 'positions') == [
        (0.0, first.pixels.tolist()), (1.0, second.pixels.tolist())]
    assert stream.values('world/edges', 'strips') == [(1.0, [[1, 0, 0], [2, 0, 0]])]
    [(_, keyframe)] = stream.rows('world/keyframes', 'positions')
    assert keyframe == [[1, 0, 0]]


def test_a_keyframe_that_was_not_shown_has_no_edge(stream, records):
    from aick_ros.reports.rerun_view import RerunView
    view = RerunView(stream, None)
    view.add(update(records[0], Keypoints([[1, 2]]), Keypoints([[3, 4]]), [(0, 0)]))
    assert not {'world/edges', 'world/keyframes'} & stream.entities


def test_images_are_below_the_camera_with_its_calibration(stream, records):
    from aick_ros.reports.rerun_view import RerunView
    RerunView(stream, None).add(update(records[5], Keypoints([[1, 2]])))
    [(_, blob)] = stream.values('world/camera/image', 'blob')
    blob = np.array(blob, np.uint8)
    np.testing.assert_allclose(cv2.imdecode(blob, cv2.IMREAD_COLOR)[4, 4, ::-1], [200, 40, 90],
                               atol=6)
    assert stream.values('world/camera/image', 'resolution') == [(0.0, [8, 8])]
    assert stream.values('world/camera/depth', 'resolution') == [(0.0, [2, 2])]
    assert stream.values('world/camera/depth', 'meter') == [(0.0, 1000.0)]
    pose = records[5].T_odom_camera
    [(_, translation)] = stream.values('world/camera', 'translation')
    [(_, columns)] = stream.values('world/camera', 'mat3x3')
    np.testing.assert_allclose(translation, pose[:3, 3], rtol=1e-6)
    np.testing.assert_allclose(np.reshape(columns, (3, 3)).T, pose[:3, :3], atol=1e-6)


def test_the_world_is_right_down_forward_and_errors_need_truth_at_their_time(
        shown, records, ground_truth):
    import rerun as rr
    later = Trajectory(ground_truth.stamps[10:], ground_truth.poses[10:])
    stream = shown(records, later)
    assert stream.rows('world', 'xyz') == [
        (None, rr.ViewCoordinates.RDF.as_arrow_array().to_pylist())]
    times = [time for time, _ in stream.values('errors/position_mm', 'scalars')]
    np.testing.assert_allclose(times, np.arange(10, 90) / 30, atol=1e-6)


def test_there_is_no_error_in_a_gap_of_the_truth(shown, records, ground_truth):
    """As in the evaluation, whose limit is 0.05 s at 30 Hz."""
    kept = np.r_[:20, 26:90]
    gap = Trajectory(ground_truth.stamps[kept], ground_truth.poses[kept])
    times = [time for time, _ in shown(records, gap).values('errors/position_mm', 'scalars')]
    np.testing.assert_allclose(times, kept / 30, atol=1e-6)


def test_a_level_world_is_forward_left_up(shown, level_records):
    import rerun as rr
    rows = shown(level_records).rows('world', 'xyz')
    assert rows[-1] == (None, rr.ViewCoordinates.FLU.as_arrow_array().to_pylist())
    assert len(rows) == 2  # not with each frame
