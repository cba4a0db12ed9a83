# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Blur of an image beyond use, measured by another image of about the same view."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from aick_ros import kernels
from aick_ros.features.mirrored_border import with_border

# Chosen on two excerpts of real recordings and on rendered rooms, in which blur by the camera's
# own motion leaves at least 0.33 and 0.63 of a keyframe, and a smear by 31 pixels 0.26 and 0.59.
_LEAST_DETAIL = 0.3
_LEAST_FINENESS = 0.75


@dataclass(frozen=True)
class Sharpness:
    """
    Sharpness of an image at the scale of keypoints.

    :param detail: root mean square of the Laplacian at half the resolution, in grey levels.
    :param fineness: the same by that of the gradient; independent of the contrast, so that a
        wall with little on it is not taken for blur.
    """

    detail: float
    fineness: float

    @classmethod
    def of(cls, grey: np.ndarray) -> Sharpness:
        """Return the sharpness of an image, HxW uint8."""
        half = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        laplacian, gradient = kernels.derivative_squares(with_border(half, 1))
        return cls(math.sqrt(laplacian / half.size), math.sqrt(laplacian / max(gradient, 1)))

    def is_blurred_beside(self, other: Sharpness) -> bool:
        """Return whether this image is blurred beyond use, if another one of the view is not."""
        return (self.detail < _LEAST_DETAIL * other.detail
                and self.fineness < _LEAST_FINENESS * other.fineness)
