# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Properties of a camera that registrations measure, whatever the settings."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.frames.camera_clock import CameraClock
from aick_ros.frames.depth_distortion import have_same_nodes
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat, are_equal
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import seconds
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.refinement.distortion_estimate import DistortionEstimate
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.refinement.new_views import NewViews
from aick_ros.registration.result import Registration
from aick_ros.registration.samples import Measure
from aick_ros.registration.systematic_error import SystematicError


@dataclass(frozen=True)
class Learned:
    """Properties learned of a camera, whatever the settings: its clocks, noise and errors."""

    colour_clock: CameraClock = field(default_factory=CameraClock)
    depth_clock: CameraClock = field(default_factory=CameraClock)
    noise: MeasuredNoise = field(default_factory=MeasuredNoise)
    misalignment: MisalignmentEstimate = field(default_factory=MisalignmentEstimate)
    systematic_error: SystematicError = field(default_factory=SystematicError)
    distortion: DistortionEstimate = field(default_factory=DistortionEstimate)
    views: NewViews = field(default_factory=NewViews)

    def follow(self, camera: Camera) -> None:
        """Follow the camera to another image, as by another crop."""
        self.misalignment.follow(camera)
        self.distortion.follow(camera)

    def depth_lag(self, frame: RgbdFrame) -> float:
        """
        Return how much later than the colour image the depth image was taken [s].

        Frames come in the order of their stamps, each once; the clocks learn from them.
        """
        depth_stamp = frame.stamp if frame.depth_stamp is None else frame.depth_stamp
        lag = seconds(frame.stamp, depth_stamp)
        if self.colour_clock.is_behind(frame.stamp):
            return lag  # such a frame is not the next one: the clocks learn nothing from it
        return (lag + self.depth_clock.correct(depth_stamp)
                - self.colour_clock.correct(frame.stamp))

    def learn(self, found: Registration, source: PreparedFrame,
              target: PreparedFrame) -> Registration:
        """Learn from a registration; return it without what was learned from."""
        if source.repeat is not Repeat.NONE or are_equal(source.grey, target.grey):
            # a repeated image shows no noise, or the same once more
            return replaced(found, bias=None, measure=None)
        if found.measure is None:
            return found
        self._learn(found.measure, found.T_target_source, source, target)
        return replaced(found, measure=None)

    def _learn(self, measure: Measure, T_target_source: np.ndarray, source: PreparedFrame,
               target: PreparedFrame) -> None:
        self.noise.learn(measure.noise())
        if source.twist is None or target.twist is None:
            return  # what a delay does would be taken for a misregistration
        if not self.views.add(target.stamp, T_target_source):
            return
        misalignment = measure.misalignment()
        if misalignment is None:
            return
        self.misalignment.learn(misalignment)
        if (misalignment.with_distortion is not None
                and have_same_nodes(source.frame.camera, target.frame.camera)):
            self.distortion.learn(misalignment.with_distortion,
                                  self.misalignment.misalignment.colour_radial)

    def with_systematic_errors(self, found: Registration, source: PreparedFrame,
                               target: PreparedFrame,
                               expected: ExpectedPose | None) -> Registration:
        """Learn from the bias of a registration; return it with what no residual shows."""
        return self.systematic_error.add_to(
            found, source, target, expected, self.misalignment.delay_sigma)

    def recognized(self, found: Registration, source: PreparedFrame,
                   target: PreparedFrame) -> Registration:
        """Return a registration that nothing is learned from, with its systematic errors."""
        return self.systematic_error.add_to(
            replaced(found, bias=None, measure=None), source, target)
