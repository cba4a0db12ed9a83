# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A run of the odometry for the viewer Rerun: path, frames, registrations and errors over time."""

from __future__ import annotations

import weakref

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from aick_ros.evaluation.scores.frame_record import FrameRecord, is_level
from aick_ros.evaluation.scores.ground_truth import true_pose
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.status import Status
from aick_ros.reports.shown_frame import DEPTH_STEP, MILLIMETRES, ShownFrame
from aick_ros.reports.trail import UNTIL_NOW, Trail

_TRUTH, _EDGE, _KEYPOINT, _MATCH = (
    (140, 148, 160), (217, 130, 43), (57, 255, 106), (255, 214, 0))


class RerunView:
    """
    Logs a run frame by frame.

    The world is the odometry's frame: that of the camera at the start, x right, y down, z forward;
    with an accelerometer a level one, x forward, y left, z up.

    :param stream: where to log to.
    :param ground_truth: of the recording; it is drawn from the first frame that it covers.
    """

    def __init__(self, stream: rr.RecordingStream, ground_truth: Trajectory | None) -> None:
        self._stream, self._trail, self._ground_truth = stream, Trail(stream), ground_truth
        self._status: Status | None = None
        self._is_begun = False
        self._T_odom_world: np.ndarray | None = None
        self._positions: weakref.WeakKeyDictionary[KeypointFrame, np.ndarray] = \
            weakref.WeakKeyDictionary()
        stream.send_blueprint(_blueprint())
        stream.log('world', rr.ViewCoordinates.RDF, static=True)

    def add(self, frame: ShownFrame) -> None:
        """Log a frame with its images, keypoints and matches."""
        self.add_record(frame.record)
        self._stream.log('world/camera/image', _pinhole(frame.camera, 1),
                         rr.EncodedImage(contents=frame.jpeg, media_type='image/jpeg'))
        self._stream.log('world/camera/depth', _pinhole(frame.camera, DEPTH_STEP),
                         rr.DepthImage(frame.depth, meter=MILLIMETRES))
        pixels = frame.keypoints.pixels
        self._stream.log('world/camera/image/keypoints', rr.Points2D(
            pixels, colors=[_KEYPOINT], radii=[1.5]))
        lines = []
        if frame.reference is not None:
            lines = [np.array(ends) for ends in zip(
                pixels[frame.matches[:, 0]], frame.reference.pixels[frame.matches[:, 1]])]
        self._stream.log('world/camera/image/matches', rr.LineStrips2D(lines, colors=[_MATCH]))
        self._add_keyframe(frame)

    def add_record(self, record: FrameRecord) -> None:
        """Log what a frame has without its images."""
        self._begin(record)
        self._trail.set_time(record.stamp)
        pose, position = record.T_odom_camera, record.T_odom_camera[:3, 3]
        self._stream.log('world/camera', rr.Transform3D(translation=position, mat3x3=pose[:3, :3]))
        self._trail.add(position, record.pose.covariance[:3, :3], record.status.is_lost)
        for stage, milliseconds in record.timing.items():
            self._stream.log(f'times/{stage}', rr.Scalars(milliseconds))
        self._stream.log('status/matches', rr.Scalars(record.matches))
        self._stream.log('status/tracked', rr.Scalars(float(record.status.ok)))
        if record.status is not self._status:
            self._status = record.status
            self._stream.log('status/changes', rr.TextLog(
                f'{record.status.name}: {record.reason or record.status.value}'))
        self._add_truth(record.stamp, pose)

    def _begin(self, record: FrameRecord) -> None:
        """Log the axes of the world again where the first tracked pose shows that it is level."""
        if not self._is_begun and is_level([record]):
            self._stream.log('world', rr.ViewCoordinates.FLU, static=True)
        self._is_begun |= record.status.ok

    def _add_keyframe(self, frame: ShownFrame) -> None:
        """Log the edge from the frame that this one was registered to."""
        position = frame.record.T_odom_camera[:3, 3].copy()
        self._positions[frame.keypoints] = position
        if frame.reference is None or frame.reference not in self._positions:
            return
        keyframe = self._positions[frame.reference]
        self._stream.log('world/edges', rr.LineStrips3D([[keyframe, position]], colors=[_EDGE]))
        self._stream.log('world/keyframes', rr.Points3D([keyframe], colors=[_EDGE], radii=[0.01]))

    def _add_truth(self, stamp: int, pose: np.ndarray) -> None:
        """Log the ground truth once, and the error of a pose against it."""
        if self._ground_truth is None:
            return
        truth = true_pose(self._ground_truth, stamp)
        if truth is None:
            return
        if self._T_odom_world is None:
            self._T_odom_world = pose @ se3.inverse(truth)
            path = (self._T_odom_world @ self._ground_truth.poses)[:, :3, 3]
            self._stream.log('world/truth', rr.LineStrips3D([path], colors=[_TRUTH]), static=True)
        error = se3.inverse(self._T_odom_world @ truth) @ pose
        self._stream.log('errors/position_mm', rr.Scalars(
            1e3 * float(np.linalg.norm(error[:3, 3]))))
        self._stream.log('errors/rotation_deg', rr.Scalars(
            float(np.degrees(se3.angle(error[:3, :3])))))


def _pinhole(camera: Camera, step: int) -> rr.Pinhole:
    return rr.Pinhole(
        focal_length=[camera.fx / step, camera.fy / step],
        principal_point=[camera.cx / step, camera.cy / step],
        resolution=[camera.width // step, camera.height // step], image_plane_distance=0.15)


def _blueprint() -> rrb.Blueprint:
    """Return the layout: the space with all of the path, the image, and series below."""
    return rrb.Blueprint(rrb.Vertical(
        rrb.Horizontal(
            rrb.Spatial3DView(origin='world', name='space', overrides={
                f'world/{name}': UNTIL_NOW
                for name in ('path', 'covariance', 'edges', 'keyframes')}),
            rrb.Spatial2DView(origin='world/camera/image', name='image and matches'),
            column_shares=[3, 2]),
        rrb.Horizontal(
            rrb.TimeSeriesView(origin='errors', name='errors [mm, deg]'),
            rrb.TimeSeriesView(origin='times', name='times per stage [ms]'),
            rrb.TimeSeriesView(origin='status', name='matches, tracked'),
            rrb.TextLogView(origin='status', name='status')),
        row_shares=[3, 1]), collapse_panels=True)
