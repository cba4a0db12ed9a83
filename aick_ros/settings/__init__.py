# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Every parameter once, with range and unit."""

from aick_ros.settings.algorithm import (
    AickSettings, ImuSettings, MisalignmentSettings, OdometrySettings, PreparationSettings,
    RefinementSettings, SensorSettings, Settings)
from aick_ros.settings.features import FeatureSettings, OrbSettings, SiftSettings, SurfSettings
from aick_ros.settings.node import NodeSettings

__all__ = [
    'AickSettings', 'FeatureSettings', 'ImuSettings', 'MisalignmentSettings', 'NodeSettings',
    'OdometrySettings', 'OrbSettings', 'PreparationSettings', 'RefinementSettings',
    'SensorSettings', 'Settings', 'SiftSettings', 'SurfSettings']
