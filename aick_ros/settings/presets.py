# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The paper's parameters by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aick_ros.errors import InputError
from aick_ros.settings.algorithm import Settings
from aick_ros.settings.parameter import with_values

_ALL_PAPER = {'features.cell_size': 0.0, 'aick.lambda_e': 0.01, 'aick.lambda_f': 0.2,
              'refinement.mode': 'none', 'odometry.reference': 'previous'}
_FULL = {**_ALL_PAPER, 'features.max_keypoints': 0, 'aick.alpha': 0.8, 'aick.iterations': 25}
_FAST_ORB = {**_ALL_PAPER, 'features.detector': 'orb', 'features.max_keypoints': 350,
             'aick.alpha': 0.6, 'aick.iterations': 10}
_FAST_SURF = {**_ALL_PAPER, 'features.detector': 'surf', 'features.max_keypoints': 200,
              'aick.alpha': 0.3, 'aick.iterations': 5}

PRESETS: Mapping[str, Mapping[str, Any]] = {
    'paper-full': {**_FULL, 'features.detector': 'orb'},
    'paper-fast': _FAST_ORB,
    'paper-full-surf': {**_FULL, 'features.detector': 'surf'},
    'paper-fast-surf': _FAST_SURF,
    'paper-fast-words': {
        **_FAST_ORB, 'aick.vocabulary': 'orb-1000', 'aick.word_radius': 0.26},
    'paper-fast-surf-words': {
        **_FAST_SURF, 'aick.vocabulary': 'surf-1000', 'aick.word_radius': 0.26},
}
"""The paper's parameters (IV, V-A), whatever the defaults are; but R_w of ORB, which is 0.165
there, is where our words lose little: vocabularies/README.md."""


def preset(name: str) -> Settings:
    """
    Return the settings of a preset.

    :raises InputError: for an unknown name.
    """
    if name not in PRESETS:
        raise InputError(f'no preset is called {name!r}: there are {", ".join(PRESETS)}')
    return with_values(Settings(), PRESETS[name])
