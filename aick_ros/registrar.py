# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A registration from two frames to one pose: keypoints, AICK, refinement."""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.aick import Aick, Registration
from aick_ros.frame import KeypointExtractor, RgbdFrame
from aick_ros.refinement import Refinement
from aick_ros.settings import Settings
from aick_ros.status import Status
from aick_ros.steady_clock import SteadyClock
from aick_ros.surface import Surface
from aick_ros.trajectory import NANOSECONDS
from aick_ros.view import View

_PATIENT = {'alpha': 0.8, 'iterations': 25}  # the paper's full schedule (V-A)


class Registrar:
    """
    Registers views, without an initial guess.

    Where AICK with the schedule of the settings finds nothing, it is given the paper's longer
    one.
    """

    def __init__(self, settings: Settings = Settings()) -> None:
        self._settings = settings
        self._extractor = KeypointExtractor(settings.features, settings.sensor)
        self._aick = Aick(settings.aick)
        self._refinement = None
        if settings.refinement.mode != 'none':
            self._refinement = Refinement(settings.refinement, settings.sensor)
            self._patient_aick = Aick(dataclasses.replace(settings.aick, **_PATIENT))
        self._colour_clock, self._depth_clock = SteadyClock(), SteadyClock()

    def look(self, frame: RgbdFrame) -> View:
        """Return what registrations need of a frame; frames come in the order of their stamps."""
        keypoints = self._extractor.extract(frame)
        surface = None
        if self._settings.refinement.mode == 'joint':
            surface = Surface.of(frame.depth, frame.camera, self._settings.sensor,
                                 self._settings.refinement.surface_points)
        depth_stamp = frame.stamp if frame.depth_stamp is None else frame.depth_stamp
        lag = ((depth_stamp - frame.stamp) / NANOSECONDS + self._depth_clock.correct(depth_stamp)
               - self._colour_clock.correct(frame.stamp))
        return View(frame, keypoints, frame.grey, surface, lag, self._colour_clock.jitter)

    def register(self, source: View, target: View,
                 guess: np.ndarray | None = None) -> Registration:
        """
        Return where the source was, seen from the target.

        :param guess: ``T_target_source`` to begin from where AICK finds none.
        """
        registration = self._aick.register(source.keypoints, target.keypoints)
        if self._refinement is None:
            return registration
        if not registration.status.ok:
            registration = self._patient_aick.register(source.keypoints, target.keypoints)
        if not registration.status.ok:
            return registration
        refined = self._refinement.refine(source, target, registration.T_target_source)
        return dataclasses.replace(
            registration, T_target_source=refined.T_target_source, covariance=refined.covariance,
            disagreement=refined.disagreement, reason=f'{len(refined.tracked)} tracked')
