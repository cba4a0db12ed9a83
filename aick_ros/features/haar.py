# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Upright SURF descriptors: sums of Haar wavelet responses around a keypoint (Bay et al. 2008)."""

from __future__ import annotations

import cv2
import numpy as np

# The overlapping subregions of Agrawal et al. 2008 (CenSurE):
_SAMPLES = 24  # in each direction, one scale apart
_SUBREGIONS = 4  # in each direction, of 9 samples, 5 samples apart: neighbours overlap
_NODES = _SAMPLES + 2
_SAMPLE_SIGMA = 2.5  # Gaussian weight of the samples within a subregion [scales]; likewise
_SUBREGION_SIGMA = 1.5  # Gaussian weight of the subregions [subregions]; likewise
_CHUNK = 128  # chosen: keypoints per block, so that the intermediate results fit the cache


def describe(grey: np.ndarray, pixels: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """
    Return the descriptors of keypoints: sums of dx, dy, |dx|, |dy| over each of 4x4 subregions.

    The wavelets are two scales wide; the scale is rounded to whole pixels. They are sampled
    symmetrically about the keypoint. Beyond its border the image is continued by replication.

    :param grey: HxW uint8.
    :param pixels: Nx2 (u, v) [px].
    :param scales: N, standard deviation of the Gaussian at which the keypoint was found [px].
    :returns: Nx64 float32 of unit length; zeros without texture.
    """
    scales = np.maximum(np.rint(scales).astype(np.intp), 1)
    # in pixel corners, from the centre of the pixel of the keypoint to the first node
    first = np.rint(pixels + 0.5 - (_NODES - 1) / 2 * scales[:, None]).astype(np.intp)
    integral, origin = _integral_around(grey, first, first + (_NODES - 1) * scales[:, None])
    descriptors = np.empty((len(pixels), 4 * _SUBREGIONS ** 2), np.float32)
    for start in range(0, len(pixels), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        offset = np.arange(_NODES) * scales[chunk, None]
        column, row = (first[chunk, axis, None] + origin[axis] + offset for axis in (0, 1))
        descriptors[chunk] = _haar_sums(integral.ravel().take(
            row[:, :, None] * integral.shape[1] + column[:, None, :]))
    length = np.linalg.norm(descriptors, axis=1, keepdims=True)
    normalized: np.ndarray = descriptors / np.maximum(length, np.finfo(np.float32).tiny)
    return normalized


def _integral_around(grey: np.ndarray, first: np.ndarray,
                     last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """
    Return the integral of the image, continued as far as needed, and its origin.

    :param first: Nx2 (u, v), first pixel corners needed; ``last`` likewise.
    :returns: integral image, int32, and (u, v) in it of the first corner of the image.
    """
    height, width = grey.shape
    left, top = origin = np.maximum(-first.min(axis=0, initial=0), 0)
    right, bottom = np.maximum(last.max(axis=0, initial=0) - (width, height), 0)
    return cv2.integral(cv2.copyMakeBorder(grey, int(top), int(bottom), int(left), int(right),
                                           cv2.BORDER_REPLICATE)), origin


def _haar_sums(nodes: np.ndarray) -> np.ndarray:
    """
    Return the weighted sums of the wavelet responses.

    :param nodes: Nx26x26, the integral image at the corners of the halves of the wavelets.
    :returns: Nx64, dx, dy, |dx|, |dy| of each subregion.
    """
    across = nodes[:, 2:] - nodes[:, :-2]
    down = nodes[:, :, 2:] - nodes[:, :, :-2]
    dx = across[:, :, 2:] - 2 * across[:, :, 1:-1] + across[:, :, :-2]
    dy = down[:, 2:] - 2 * down[:, 1:-1] + down[:, :-2]
    sums = np.empty((len(nodes), _SUBREGIONS ** 2, 4), np.float32)
    for part, responses in ((0, dx), (1, dy)):
        responses = responses.reshape(len(nodes), _SAMPLES ** 2).astype(np.float32)
        sums[:, :, part] = responses @ _WEIGHTS
        sums[:, :, part + 2] = np.abs(responses) @ _WEIGHTS
    return sums.reshape(len(nodes), 4 * _SUBREGIONS ** 2)


def _subregion_weights() -> np.ndarray:
    """Return the weight of each sample in each subregion, 576x16, both row-major."""
    sample = np.arange(_SAMPLES) - (_SAMPLES - 1) / 2
    centre = 5.0 * (np.arange(_SUBREGIONS) - (_SUBREGIONS - 1) / 2)
    distance = sample[:, None] - centre
    weights = np.exp(-0.5 * (distance / _SAMPLE_SIGMA) ** 2) * (np.abs(distance) < 4.5)
    weights *= np.exp(-0.5 * (centre / 5.0 / _SUBREGION_SIGMA) ** 2)
    return np.kron(weights, weights).astype(np.float32)


_WEIGHTS = _subregion_weights()
