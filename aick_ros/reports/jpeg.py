# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images for viewers, packed."""

import cv2
import numpy as np

_QUALITY = 80  # chosen


def to_jpeg(colour: np.ndarray) -> bytes:
    """Return the JPEG of an image, HxWx3 (red, green, blue) or HxW uint8."""
    image = colour if colour.ndim == 2 else colour[:, :, ::-1]
    _, content = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return bytes(content)
