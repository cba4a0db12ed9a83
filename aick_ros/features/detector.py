# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Interface of the keypoint detectors: a class with ``detect(grey) -> Features``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from aick_ros.borders.values import required, required_array
from aick_ros.errors import InputError

Choice = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Choice of keypoints by their pixels and responses: their rows, in the order of the result."""


@dataclass(frozen=True, eq=False)
class Features:
    """
    Keypoints of an image.

    :param pixels: Nx2 float32 (u, v) [px].
    :param descriptors: NxD uint8 (binary, 8 bits per column) or float32.
    :param responses: N float32, larger is stronger.
    :param scales: N float32, scale relative to the finest; 1 at the finest.
    :raises InputError: where the arrays do not fit each other, or numbers are not finite.
    """

    pixels: np.ndarray
    descriptors: np.ndarray
    responses: np.ndarray
    scales: np.ndarray

    def __post_init__(self) -> None:
        """Reject arrays of wrong type or shape."""
        required_array(self.pixels, np.float32, (None, 2), 'pixels of features')
        count = len(self.pixels)
        required_array(self.responses, np.float32, (count,), 'responses of features')
        required_array(self.scales, np.float32, (count,), 'scales of features')
        required_descriptors(self.descriptors, count)
        for name in ('pixels', 'responses', 'scales'):
            if not np.isfinite(getattr(self, name)).all():
                raise InputError(f'{name} of features are not all finite: omit such keypoints')


def required_descriptors(descriptors: object, count: int) -> None:
    """
    Check the descriptors of some keypoints.

    :raises InputError: where they are no NxD array of uint8 or float32, or have no column.
    """
    kind = np.uint8 if getattr(descriptors, 'dtype', None) == np.uint8 else np.float32
    required_array(descriptors, kind, (count, None), 'descriptors of features')
    if isinstance(descriptors, np.ndarray) and not descriptors.shape[1]:
        raise InputError('descriptors of features have no columns: give each at least a number')


class Detector(Protocol):
    """
    Keypoint detector with descriptor.

    Where frames are prepared on a thread of their own, it is called from two threads at once.
    """

    def detect(self, grey: np.ndarray) -> Features:
        """Return the keypoints of an HxW uint8 image; there may be none."""


def every_keypoint(pixels: np.ndarray, responses: np.ndarray) -> np.ndarray:
    """Choose all keypoints in their order."""
    return np.arange(len(pixels))


def detect_some(detector: Detector, grey: np.ndarray, choose: Choice) -> Features:
    """
    Return the chosen keypoints of an HxW uint8 image.

    A detector that has a method of this name, with these parameters, describes only those.

    :raises InputError: where the detector does not return features.
    """
    # a runtime_checkable protocol takes a hundred times as long
    selective: Callable[[np.ndarray, Choice], Features] | None = getattr(
        detector, 'detect_some', None)
    if selective is not None:
        return selective(grey, choose)
    found = required(detector.detect(grey), Features, 'what the detector has returned')
    chosen = choose(found.pixels, found.responses)
    return Features(found.pixels[chosen], found.descriptors[chosen], found.responses[chosen],
                    found.scales[chosen])
