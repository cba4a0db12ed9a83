# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images and marks of a frame for the viewer, as small as they are written: many are kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.odometry import OdometryUpdate
from aick_ros.odometry.inertial.level import Turn
from aick_ros.reports.jpeg import to_jpeg

DEPTH_STEP = 4
"""Step of the pixels of the depth image. Chosen: a VGA image is a cloud of 19,000 points."""

MILLIMETRES = 1000.0


@dataclass(frozen=True, eq=False)
class ShownFrame:
    """
    A frame of a run with its images, keypoints and matches.

    :param jpeg: the colour image.
    :param depth: every fourth pixel of the depth image in millimetres, 0 where there is none.
    :param reference: keypoints of the frame it was registered to; None where there is none.
    :param matches: Kx2, rows (keypoint, keypoint of the reference).
    """

    record: FrameRecord
    camera: Camera
    jpeg: bytes
    depth: np.ndarray
    keypoints: KeypointFrame
    reference: KeypointFrame | None
    matches: np.ndarray

    @classmethod
    def of(cls, update: OdometryUpdate) -> ShownFrame:
        """Return what is shown of an update."""
        frame = update.prepared.frame
        return cls(FrameRecord.of(update), frame.camera, to_jpeg(frame.colour), _depth(frame),
                   update.keypoints, update.reference, update.matches)

    @property
    def stamp(self) -> int:
        """Stamp of the colour image [ns]."""
        return self.record.stamp

    def turned(self, turn: Turn) -> ShownFrame:
        """Return it in a frame of the odometry that begins level."""
        return replaced(self, record=self.record.turned(turn))


def _depth(frame: RgbdFrame) -> np.ndarray:
    height, width = (size // DEPTH_STEP * DEPTH_STEP for size in frame.depth.shape)
    depth = frame.depth[:height:DEPTH_STEP, :width:DEPTH_STEP]
    millimetres = np.nan_to_num(MILLIMETRES * depth, posinf=0)
    return np.clip(millimetres, 0, np.iinfo(np.uint16).max).astype(np.uint16)
