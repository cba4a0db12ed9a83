# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Misalignment of the two images of a camera, in space and in time, and its correction.

The depth camera may sit elsewhere than its registration to the colour image assumes, and its image
may be taken earlier or later than the colour image. Where images were not registered, one of them
has another focal length than its calibration says. The lens of the colour camera may bend rays
though its calibration has no coefficients. A rolling shutter takes the rows of an image one after
the other. While the camera moves, the delay and the shutters displace what it sees: a point p in
the frame of a camera with the body twist (v, w) moves by v + w x p for each unit of time that the
image was taken after its stamp.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from aick_ros import kernels
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.tracks import Tracks
from aick_ros.settings import MisalignmentSettings, SensorSettings
from aick_ros.settings.parameter import parameters


@dataclass(frozen=True, eq=False)
class Misalignment:
    """
    Misalignment of the depth image to the colour image, and errors of what both have in common.

    :param offset: 6, twist whose exponential is ``T_colour_depth``, of depth images that are
        taken for registered to colour [m, rad].
    :param delay: time from the colour image to the depth image that no stamp shows [s].
    :param colour_readout: time from the first to the last row of the colour image [s];
        ``depth_readout``: of the depth image.
    :param colour_focal: relative error of the focal length of the colour image: the true one is
        longer by this share than the camera's; ``depth_focal``: that of the depth image.
    :param colour_radial: first radial coefficient of the lens of the colour camera beside those of
        the camera: it shows the radius r of a ray on the plane z = 1 at r (1 + k r^2).
    """

    offset: np.ndarray
    delay: float
    colour_readout: float
    depth_readout: float
    colour_focal: float = 0.0
    depth_focal: float = 0.0
    colour_radial: float = 0.0

    @classmethod
    def of(cls, values: np.ndarray) -> Misalignment:
        """Return that of twelve numbers: offset, delay, readouts, focal lengths and lens."""
        return cls(values[:6], *map(float, values[6:]))

    @classmethod
    def by(cls, settings: MisalignmentSettings) -> Misalignment:
        """Return the one that is known."""
        return cls.of(np.array(dataclasses.astuple(settings)))

    @cached_property
    def values(self) -> np.ndarray:
        """The twelve numbers: offset, delay, readouts, focal lengths and lens."""
        return np.array([*self.offset, self.delay, self.colour_readout, self.depth_readout,
                         self.colour_focal, self.depth_focal, self.colour_radial])

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
            x, y, z = np.rint(1e3 * self.offset[:3]) + 0.0  # no -0
            a, b, c = np.round(np.degrees(self.offset[3:]), 2) + 0.0
            sentences.append(
                f'depth is registered to colour with an error: T_colour_depth is rotated by '
                f'({a:.2f}, {b:.2f}, {c:.2f}) deg and moved by ({x:.0f}, {y:.0f}, {z:.0f}) mm')
        if self.delay:
            order = 'later' if self.delay > 0.0 else 'earlier'
            sentences.append(f'depth images are taken {1e3 * abs(self.delay):.0f} ms {order} '
                             'than their stamps say')
        for name, readout in (('colour', self.colour_readout), ('depth', self.depth_readout)):
            if readout:
                sentences.append(f'a rolling shutter takes {1e3 * readout:.0f} ms from the first '
                                 f'row of {name} images to the last')
        for name, error in (('colour', self.colour_focal), ('depth', self.depth_focal)):
            if error:
                order = 'longer' if error > 0.0 else 'shorter'
                sentences.append(f'the focal length of {name} images is {100 * abs(error):.1f} % '
                                 f'{order} than that of the camera')
        if self.colour_radial:
            sentences.append('the lens of the colour camera bends rays by a radial coefficient '
                             f'of {self.colour_radial:+.3f} beside its calibration')
        return '; '.join(sentences)


NO_MISALIGNMENT = Misalignment.of(np.zeros(12))


@dataclass(frozen=True, eq=False)
class Displacement:
    """
    Displacement of what one frame sees by the misalignment and the motion of its camera.

    :param twists: 3x6, of all points of the depth image, and from the first to the last row of
        the points of the colour and of the depth image [m, rad].
    :param height: of the image on the plane z = 1.
    """

    twists: np.ndarray
    height: float


@dataclass(frozen=True, eq=False)
class Correction:
    """
    Corrects what two frames see by the displacements of each.

    :param colour_focal: focal length of the colour images by that of the camera;
        ``depth_focal``: that of the depth images.
    :param colour_radial: first radial coefficient of the lens of the colour camera.
    """

    source: Displacement
    target: Displacement
    colour_focal: float = 1.0
    depth_focal: float = 1.0
    colour_radial: float = 0.0

    @classmethod
    def of(cls, misalignment: Misalignment, lags: tuple[float, float], twists: np.ndarray,
           cameras: tuple[Camera, Camera]) -> Correction:
        """
        Return that of two frames, in the order source, target.

        :param lags: times from the colour images to the depth images by their stamps [s].
        :param twists: 2x6, of the bodies of the cameras [m/s, rad/s].
        """
        times = np.array([(lag + misalignment.delay,) for lag in lags])
        moved = np.empty((2, 3, 6))
        moved[:, 0] = misalignment.offset + times * twists
        moved[:, 1] = misalignment.colour_readout * twists
        moved[:, 2] = misalignment.depth_readout * twists
        source, target = cameras
        return cls(Displacement(moved[0], image_height(source)),
                   Displacement(moved[1], image_height(target)),
                   1.0 + misalignment.colour_focal, 1.0 + misalignment.depth_focal,
                   misalignment.colour_radial)

    def pose_by_depth(self, T_target_source: np.ndarray) -> np.ndarray:
        """
        Return the pose of the one depth image in the other, 4x4, in the mean over their rows.

        :param T_target_source: of the colour images, 4x4.
        """
        moved, into = (se3.exp(each.twists[0]) for each in (self.source, self.target))
        pose: np.ndarray = se3.inverse(into) @ T_target_source @ moved
        return pose

    def tracks(self, tracks: Tracks, source: PreparedFrame, sensor: SensorSettings,
               T_target_source: np.ndarray) -> Tracks:
        """
        Return tracks as a camera without misalignment would see them.

        Points are moved along their rays, which are those of the colour image, to where the
        displaced depth image has a surface; points and rays by their rows of the colour images.

        :param T_target_source: 4x4; the depths in the target are taken from it, nothing else.
        """
        points, rays = np.empty(tracks.points.shape), np.empty(tracks.rays.shape)
        kernels.corrected_tracks(
            source.frame.depth, sensor.depth_jump, sensor.min_depth, sensor.max_depth,
            source.frame.camera.model, self.source.twists, self.source.height, self.target.twists,
            self.target.height, self.colour_focal, self.depth_focal, self.colour_radial,
            T_target_source, tracks.points, tracks.rays, points, rays)
        return Tracks(tracks.keypoints, points, rays, tracks.depths, tracks.sigmas)


NO_CORRECTION = Correction(*2 * (Displacement(np.zeros((3, 6)), 1.0),))


def image_height(camera: Camera) -> float:
    """Return the height of the image on the plane z = 1."""
    return camera.height / camera.fy
