# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Misalignment of the two images of a camera, in space and in time, and its correction.

The depth camera may sit elsewhere than its registration to the colour image assumes, and its image
may be taken earlier or later than the colour image. A rolling shutter takes the rows of an image
one after the other. While the camera moves, the last two displace what it sees: a point p in the
frame of a camera with the body twist (v, w) moves by v + w x p for each unit of time that the
image was taken after its stamp.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from aick_ros import kernels
from aick_ros.frames import depth
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.tracks import Tracks
from aick_ros.settings import MisalignmentSettings, SensorSettings
from aick_ros.settings.parameter import parameters

_DEPTH_STEPS = 2  # chosen: steps of the search along a ray
_STILL = np.zeros(6)
_SHARE_MEASURED = 0.75  # chosen on excerpts and rendered cameras: 0.5 lags, 1 has more noise


@dataclass(frozen=True, eq=False)
class Misalignment:
    """
    Misalignment of the depth image to the colour image, and the time that a shutter takes.

    :param offset: 6, twist whose exponential is ``T_colour_depth``, of depth images that are
        taken for registered to colour [m, rad].
    :param delay: time from the colour image to the depth image that no stamp shows [s].
    :param readout: time from the first to the last row of either image [s].
    """

    offset: np.ndarray
    delay: float
    readout: float

    @classmethod
    def of(cls, values: np.ndarray) -> Misalignment:
        """Return that of eight numbers: offset, delay, readout."""
        return cls(values[:6], float(values[6]), float(values[7]))

    @classmethod
    def by(cls, settings: MisalignmentSettings) -> Misalignment:
        """Return the one that is known."""
        return cls.of(np.array(dataclasses.astuple(settings)))

    @cached_property
    def values(self) -> np.ndarray:
        """The eight numbers: offset, delay, readout."""
        return np.array([*self.offset, self.delay, self.readout])

    @property
    def settings(self) -> MisalignmentSettings:
        """The same as settings, within their ranges."""
        return MisalignmentSettings(**{
            known.name: float(np.clip(value, known.minimum, known.maximum))
            for known, value in zip(parameters(MisalignmentSettings), self.values)})

    @property
    def description(self) -> str:
        """The misalignment in words, with the numbers; '' where there is none."""
        sentences = []
        if self.offset.any():
            x, y, z = 1e3 * self.offset[:3]
            a, b, c = np.degrees(self.offset[3:])
            sentences.append(
                f'depth is registered to colour with an error: T_colour_depth is rotated by '
                f'({a:.2f}, {b:.2f}, {c:.2f}) deg and moved by ({x:.0f}, {y:.0f}, {z:.0f}) mm')
        if self.delay:
            order = 'later' if self.delay > 0.0 else 'earlier'
            sentences.append(f'depth images are taken {1e3 * abs(self.delay):.0f} ms {order} '
                             'than their stamps say')
        if self.readout:
            sentences.append('a rolling shutter takes '
                             f'{1e3 * self.readout:.0f} ms from the first row to the last')
        return '; '.join(sentences)


NO_MISALIGNMENT = Misalignment.of(np.zeros(8))


@dataclass(frozen=True, eq=False)
class Displacement:
    """
    Displacement of what one frame sees by the misalignment and the motion of its camera.

    :param depth: 6, twist of all points of the depth image.
    :param rows: 6, twist from the first to the last row, of the points of both images.
    :param height: of the image on the plane z = 1.
    """

    depth: np.ndarray
    rows: np.ndarray
    height: float

    @classmethod
    def of(cls, misalignment: Misalignment, lag: float, twist: np.ndarray,
           camera: Camera) -> Displacement:
        """
        Return that of a frame.

        :param lag: time from the colour image to the depth image by their stamps [s].
        :param twist: of the body of the camera [m/s, rad/s].
        """
        return cls(misalignment.offset + (lag + misalignment.delay) * twist,
                   misalignment.readout * twist, image_height(camera))

    def of_depth(self, points: np.ndarray) -> np.ndarray:
        """Return where points of the depth image are at the stamp of the frame, Nx3 [m]."""
        return self._moved(points, self.depth, self.rows)

    @cached_property
    def twists(self) -> np.ndarray:
        """Both twists, 2x6."""
        return np.array([self.depth, self.rows])

    @cached_property
    def undone(self) -> np.ndarray:
        """Both twists of the inverse, 2x6: to where the depth image has points of the frame."""
        return -self.twists

    def of_rows(self, points: np.ndarray) -> np.ndarray:
        """Return where points seen by their rows are at the stamp of the frame, Nx3 [m]."""
        return self._moved(points, _STILL, self.rows) if self.rows.any() else points

    def of_rays(self, rays: np.ndarray, points: np.ndarray,
                T_frame_points: np.ndarray) -> np.ndarray:
        """
        Return rays seen by their rows at the stamp of the frame, Nx2 on the plane z = 1.

        :param points: Nx3 in another frame [m]: what is seen, which shows how far away it is.
        :param T_frame_points: of that frame, 4x4.
        """
        if not self.rows.any():
            return rays
        moved = np.empty(rays.shape)
        kernels.rays_moved_by_rows(rays, points, T_frame_points, self.rows, self.height, moved)
        return moved

    def _moved(self, points: np.ndarray, constant: np.ndarray, by_row: np.ndarray) -> np.ndarray:
        """Return points moved by twists that are linear in their rows, to second order, Nx3."""
        moved = np.empty(points.shape)
        kernels.moved_by_rows(points, constant, by_row, self.height, moved)
        return moved


@dataclass(frozen=True, eq=False)
class Correction:
    """Corrects what two frames see by the displacements of each."""

    source: Displacement
    target: Displacement

    def tracks(self, tracks: Tracks, source: PreparedFrame, sensor: SensorSettings,
               T_target_source: np.ndarray) -> Tracks:
        """
        Return tracks as a camera without misalignment would see them.

        :param T_target_source: 4x4; the depths in the target are taken from it, nothing else.
        """
        points = self.source.of_rows(_with_depth(tracks.points, source, self.source, sensor))
        rays = self.target.of_rays(tracks.rays, points, T_target_source)
        return Tracks(tracks.keypoints, points, rays, tracks.depths, tracks.sigmas)


NO_CORRECTION = Correction(*2 * (Displacement(np.zeros(6), np.zeros(6), 1.0),))


@dataclass(frozen=True, eq=False)
class Prediction:
    """
    Pose that a frame would have at the velocity measured last.

    :param T_target_source: 4x4.
    :param twist: that velocity, of the body [m/s, rad/s].
    :param elapsed: time since it was measured [s].
    """

    T_target_source: np.ndarray
    twist: np.ndarray
    elapsed: float

    @classmethod
    def of(cls, T_target_source: np.ndarray | None, twist: np.ndarray | None,
           elapsed: float) -> Prediction | None:
        """Return the prediction; None where the velocity is not known."""
        if T_target_source is None or twist is None or not 0.0 < elapsed < np.inf:
            return None
        return cls(T_target_source, twist, elapsed)

    def twist_with(self, T_target_source: np.ndarray) -> np.ndarray:
        """Return the body velocity, 6: between the last one and that to a measured pose."""
        deviation = se3.inverse(self.T_target_source) @ T_target_source
        measured = se3.log(se3.exp(self.twist * self.elapsed) @ deviation) / self.elapsed
        twist: np.ndarray = self.twist + _SHARE_MEASURED * (measured - self.twist)
        return twist


def image_height(camera: Camera) -> float:
    """Return the height of the image on the plane z = 1."""
    return camera.height / camera.fy


def _with_depth(points: np.ndarray, frame: PreparedFrame, displacement: Displacement,
                sensor: SensorSettings) -> np.ndarray:
    """Return points moved along their rays to where the displaced depth image has a surface."""
    T_depth_colour = se3.exp(-displacement.depth)
    for _ in range(_DEPTH_STEPS):
        seen = se3.transform(T_depth_colour, points)
        points = depth.scaled_to(frame.corrected.depth, frame.frame.camera.project(seen), sensor,
                                 seen, points)
    return points
