# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Preparation of a frame for registrations, by the frame and the distortion of its camera."""

from __future__ import annotations

import dataclasses

from aick_ros.borders.records import replaced
from aick_ros.borders.values import required
from aick_ros.features.detector import Detector
from aick_ros.features.vocabulary import vocabulary_of
from aick_ros.frames.depth_distortion import NO_DISTORTION, DepthDistortion
from aick_ros.frames.imu import ImuSamples
from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame
from aick_ros.frames.mask import mask_of
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import Surface
from aick_ros.registration.stage_times import StageTimes
from aick_ros.settings import Settings


class Preparer:
    """
    Masks frames, and makes their keypoints and surfaces.

    Nothing but the distortion that it corrects changes, so that frames can be prepared on one
    thread while another one registers those before. Then the detector must be able to work for
    both at once, as those named by ``features.detector`` are.

    :param detector: used instead of the one that ``features.detector`` names.
    :raises InputError: if the vocabulary or the mask of the settings cannot be read.
    """

    def __init__(self, settings: Settings, detector: Detector | None = None) -> None:
        self.settings = required(settings, Settings, 'settings').preparation
        self._makes_keypoints = settings.odometry.aick_interval == 1
        self._extractor = KeypointExtractor(settings.features, settings.sensor.without_mask,
                                            vocabulary_of(settings), settings.aick.word_radius,
                                            detector)
        self._mask = mask_of(settings.sensor)
        self.distortion = NO_DISTORTION
        """That of the depth images of the camera, as far as it is known."""

    def begin(self, frame: RgbdFrame) -> Preparation:
        """
        Return the preparation of a frame, whose parts are made where they are asked for.

        It has images of its own.

        :raises InputError: where that is no frame.
        """
        return Preparation(required(frame, RgbdFrame, 'the frame').owned(), self, self.distortion)

    def prepare(self, frame: RgbdFrame) -> Preparation:
        """
        Return the preparation of a frame with the parts that it needs in any case.

        :raises InputError: where the image is too small.
        """
        preparation = self.begin(frame)
        preparation.surface()
        if self._makes_keypoints:  # else most frames need none of their own
            preparation.keypoints()
        return preparation

    def masked(self, frame: RgbdFrame) -> RgbdFrame:
        """Return a frame without the part of its images that is not used: itself if all is."""
        return frame if self._mask is None else self._mask.applied(frame)

    def keypoints(self, frame: RgbdFrame) -> KeypointFrame:
        """Return the keypoints of a frame, masked before where it is to be."""
        return self._extractor.extract(frame)

    def surface(self, frame: RgbdFrame) -> Surface | None:
        """Return the surface of such a frame; None if the refinement does not use it."""
        if self.settings.surface_points is None:
            return None
        return Surface.of(frame.depth, frame.camera, self.settings.sensor,
                          self.settings.surface_points)


class Preparation:
    """
    Keypoints and surface of a frame, each made once, where it is first asked for.

    :param frame: the frame that is prepared.
    :param preparer: makes the parts.
    :param distortion: of the depth image; the parts are made without it.
    :raises InputError: where that is no frame.
    """

    def __init__(self, frame: RgbdFrame, preparer: Preparer,
                 distortion: DepthDistortion = NO_DISTORTION) -> None:
        self.frame = required(frame, RgbdFrame, 'the frame')
        self.preparer = required(preparer, Preparer, 'the preparer')
        self.distortion = distortion
        self.times = StageTimes()
        """The time that each part took."""
        self._keypoints: KeypointFrame | None = None
        self._surface: Surface | None = None
        self._corrected: RgbdFrame | None = None

    def up_to_date(self) -> Preparation:
        """
        Return this one, or another of the frame where another distortion is known by now.

        While a frame is prepared on another thread those before it may show the distortion. So
        that results do not depend on which comes first, its parts are made again.
        """
        if self.distortion == self.preparer.distortion:
            return self
        again = Preparation(self.frame, self.preparer, self.preparer.distortion)
        again.times = self.times
        return again

    def corrected(self) -> RgbdFrame:
        """Return the frame masked and with depth free of distortion: itself if it has neither."""
        if self._corrected is None:
            self._corrected = self._without(self.distortion)
        return self._corrected

    def corrected_for(self, distortion: DepthDistortion) -> RgbdFrame:
        """Return the frame masked and with depth free of a distortion; itself without either."""
        return (self.corrected() if distortion == self.distortion
                else self._without(distortion))

    def _without(self, distortion: DepthDistortion) -> RgbdFrame:
        frame = self.frame
        if not distortion.is_none:
            frame = replaced(frame, depth=distortion.undistorted(frame.depth))
        return self.preparer.masked(frame)

    def add_imu(self, samples: ImuSamples) -> None:
        """
        Give the frame the samples of an IMU, which may arrive after its images.

        :raises InputError: where these are no samples.
        """
        self.frame = dataclasses.replace(self.frame, imu=samples)

    def keypoints(self) -> KeypointFrame:
        """Return the keypoints."""
        if self._keypoints is None:
            with self.times.stage('features'):
                self._keypoints = self.preparer.keypoints(self.corrected())
        return self._keypoints

    def surface(self) -> Surface | None:
        """Return the surface; None if the refinement does not use it."""
        if self._surface is None:
            with self.times.stage('surface'):
                self._surface = self.preparer.surface(self.corrected())
        return self._surface
