# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Borders around images, so that what reads beyond their edges need not ask."""

from __future__ import annotations

import cv2
import numpy as np


def with_border(image: np.ndarray, width: int) -> np.ndarray:
    """Return an image, HxW, in a mirrored border of a width [px]."""
    return np.asarray(cv2.copyMakeBorder(image, width, width, width, width,
                                         cv2.BORDER_REFLECT_101))
