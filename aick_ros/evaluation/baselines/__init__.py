# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Methods that register two RGB-D frames, AICK and others, one per file.

All implement :class:`Baseline`; :mod:`aick_ros.evaluation.baselines.registry` has their names and
settings. Each file imports its own library, so that a missing one does not affect the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from aick_ros.frames.rgbd import RgbdFrame


@dataclass(frozen=True, eq=False)
class Estimate:
    """
    Result of a method for a pair of frames.

    :param T_target_source: 4x4 float64 [m]; None where the registration failed.
    :param failure: reason of the failure, without numbers so that equal reasons can be counted.
    """

    T_target_source: np.ndarray | None
    failure: str = ''


class Baseline(Protocol):
    """
    Registers pairs of frames, without an initial guess.

    The two steps are timed separately: the first is done once per frame, however many frames it is
    registered to, which is why the paper does not count it.
    """

    def prepare(self, frame: RgbdFrame) -> Any:
        """Return everything that can be computed from one frame alone."""

    def register(self, source: Any, target: Any) -> Estimate:
        """Return the estimate of ``T_target_source`` of two prepared frames."""
