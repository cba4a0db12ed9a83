# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""AICK as one of the compared methods."""

from __future__ import annotations

from typing import Any

from aick_ros.evaluation.baselines import Estimate
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset


class AickMethod:
    """
    AICK with the settings of a preset and changes to them.

    :param preset_name: '' for the defaults.
    :param changes: dotted name -> value.
    """

    def __init__(self, preset_name: str = '', changes: dict[str, Any] | None = None) -> None:
        settings = with_values(preset(preset_name) if preset_name else Settings(), changes or {})
        self._registrar = Registrar(settings)
        self._paper = Aick(settings.aick) if settings.refinement.mode == 'none' else None

    def prepare(self, frame: RgbdFrame) -> PreparedFrame:
        """Return the keypoints and surfaces."""
        return self._registrar.prepare(frame)

    def register(self, source: PreparedFrame, target: PreparedFrame) -> Estimate:
        """Return the transform."""
        # the paper's algorithm has no covariance, whose time would count otherwise
        registration = (self._paper.align(source.keypoints, target.keypoints) if self._paper
                        else self._registrar.register(source, target))
        if not registration.status.ok:
            return Estimate(None, registration.status.value)
        return Estimate(registration.T_target_source)
