# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""AICK itself, as one method among others."""

from __future__ import annotations

from typing import Any

from aick_ros.aick import Aick
from aick_ros.evaluation.baselines import Estimate
from aick_ros.frame import KeypointExtractor, KeypointFrame, RgbdFrame
from aick_ros.settings import Settings, preset, with_values


class AickMethod:
    """
    AICK with the settings of a preset, some of them changed.

    :param preset_name: '' for the defaults.
    :param changes: dotted name -> value.
    """

    def __init__(self, preset_name: str = '', changes: dict[str, Any] | None = None) -> None:
        settings = with_values(preset(preset_name) if preset_name else Settings(), changes or {})
        self._extractor = KeypointExtractor(settings.features, settings.sensor)
        self._aick = Aick(settings.aick)

    def prepare(self, frame: RgbdFrame) -> KeypointFrame:
        """Return the keypoints."""
        return self._extractor.extract(frame)

    def register(self, source: KeypointFrame, target: KeypointFrame) -> Estimate:
        """Return the transform."""
        registration = self._aick.register(source, target)
        if not registration.status.ok:
            return Estimate(None, registration.status.value)
        return Estimate(registration.T_target_source)
