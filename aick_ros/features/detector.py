# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Interface of the keypoint detectors: a class with ``detect(grey) -> Features``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True, eq=False)
class Features:
    """
    Keypoints of an image.

    :param pixels: Nx2 float32 (u, v) [px].
    :param descriptors: NxD uint8 (binary, 8 bits per column) or float32.
    :param responses: N float32, larger is stronger.
    :param scales: N float32, scale relative to the finest; 1 at the finest.
    """

    pixels: np.ndarray
    descriptors: np.ndarray
    responses: np.ndarray
    scales: np.ndarray


class Detector(Protocol):
    """
    Keypoint detector with descriptor.

    Where frames are prepared on a thread of their own, it is called from two threads at once.
    """

    def detect(self, grey: np.ndarray) -> Features:
        """Return the keypoints of an HxW uint8 image; there may be none."""
