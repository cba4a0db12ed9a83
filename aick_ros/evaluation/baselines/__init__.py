# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Methods to register two RGB-D frames, ours and others', one a file.

All have the interface of :class:`Baseline`; :mod:`aick_ros.evaluation.baselines.registry` has
their names and settings. Each file imports what it needs, so that one that is not installed
stops none of the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from aick_ros.frames.rgbd import RgbdFrame


@dataclass(frozen=True, eq=False)
class Estimate:
    """
    What a method makes of a pair of frames.

    :param T_target_source: 4x4 float64 [m], or None where it found none.
    :param failure: why it found none, in words without numbers so that they can be counted.
    """

    T_target_source: np.ndarray | None
    failure: str = ''


class Baseline(Protocol):
    """
    Registers pairs of frames, without an initial guess.

    The two steps are timed apart: the first is done once a frame, however many frames it is
    registered to, which is why the paper leaves it out of its runtimes.
    """

    def prepare(self, frame: RgbdFrame) -> Any:
        """Return all that can be made of one frame alone."""

    def register(self, source: Any, target: Any) -> Estimate:
        """Return where the source was, seen from the target; both as prepared."""
