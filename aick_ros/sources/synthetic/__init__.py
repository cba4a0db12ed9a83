# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Renders RGB-D sequences of a furnished room, with exact ground truth."""

from aick_ros.sources.synthetic.sensor import ColourSensor, DepthSensor
from aick_ros.sources.synthetic.source import SyntheticOptions, SyntheticSource

__all__ = ['ColourSensor', 'DepthSensor', 'SyntheticOptions', 'SyntheticSource']
