#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Odometry with keypoints of one's own: corners described by their normalised surroundings.

usage: custom_detector.py SOURCE
"""

import sys

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from aick_ros import Features, InputError, Odometry, open_source

RADIUS = 10


class PatchCorners:
    """Shi-Tomasi corners; anything with ``detect(grey) -> Features`` is a detector."""

    def detect(self, grey: np.ndarray) -> Features:
        """Return the keypoints of an HxW uint8 image, each described by 7x7 grey values."""
        inside = np.zeros_like(grey)
        inside[RADIUS:-RADIUS, RADIUS:-RADIUS] = 1
        corners = cv2.goodFeaturesToTrack(grey, 800, 0.005, 4, mask=inside)
        pixels = np.empty((0, 2), np.float32) if corners is None else corners.reshape(-1, 2)
        smooth = cv2.GaussianBlur(grey, (0, 0), 1.5).astype(np.float32)
        windows = sliding_window_view(smooth, (2 * RADIUS + 1,) * 2)[:, :, ::3, ::3]
        columns, rows = pixels.astype(int).T - RADIUS
        patches = windows[rows, columns].reshape(len(pixels), 49)
        patches -= patches.mean(axis=1, keepdims=True)
        patches /= np.linalg.norm(patches, axis=1, keepdims=True) + 1e-6
        strengths = np.arange(len(pixels), 0, -1, dtype=np.float32)  # the strongest come first
        return Features(pixels, patches, strengths, np.ones(len(pixels), np.float32))


def main(path: str) -> None:
    """Print the status and the number of keypoints of each frame."""
    odometry = Odometry(detector=PatchCorners())
    for frame in open_source(path).frames():
        update = odometry.register_frame(frame)
        print(update.status.name, f'{len(update.keypoints)} keypoints: {update.reason}')


if __name__ == '__main__':
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    try:
        main(sys.argv[1])
    except InputError as error:  # says what is wrong, where, and what to do
        sys.exit(str(error))
