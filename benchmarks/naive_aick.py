# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""AICK over all pairs in every iteration, as the paper has it: the baseline of the benchmark."""

from __future__ import annotations

import numpy as np

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import point_fit, se3
from aick_ros.settings import AickSettings


def register(source: KeypointFrame, target: KeypointFrame, settings: AickSettings) -> np.ndarray:
    """
    Return ``T_target_source`` (III-A), 4x4.

    :param source: keypoints with binary descriptors.
    :param target: keypoints with binary descriptors.
    :raises DegenerateGeometryError: if an iteration has fewer than three matches, or all on a
        line.
    """
    bits = 8 * source.descriptors.shape[1]
    differing = np.bitwise_xor(source.descriptors[:, None], target.descriptors[None])
    d_d = np.unpackbits(differing, axis=2).sum(axis=2, dtype=np.float32) / bits
    T_target_source = np.eye(4)
    for i in range(settings.iterations):
        w = np.float32(settings.alpha ** i)  # w(i) = alpha^i
        moved = se3.transform(T_target_source, source.positions)
        d_e = np.linalg.norm(moved[:, None] - target.positions[None], axis=2)
        d = (1 - w) * d_e + w * d_d  # Eq. 1
        closest = d.argmin(axis=1)
        threshold = (1 - w) * settings.lambda_e + w * settings.lambda_f  # Eq. 2
        kept = np.flatnonzero(d[np.arange(len(d)), closest] < threshold)
        T_target_source = point_fit.fit(source.positions[kept], target.positions[closest[kept]])
    return T_target_source
