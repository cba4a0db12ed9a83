# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keypoints of one frame with their 3D positions and covariances."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.borders.values import numbers, required, required_method
from aick_ros.errors import InputError
from aick_ros.features import Detector, make_detector
from aick_ros.features.detector import detect_some, required_descriptors
from aick_ros.features.selection import spread
from aick_ros.features.vocabulary import FrameWords, Vocabulary
from aick_ros.frames import depth
from aick_ros.frames.mask import MaskedFrame, mask_of
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.settings import FeatureSettings, SensorSettings


@dataclass(frozen=True, eq=False)
class KeypointFrame:
    """
    Keypoints with depth of one frame, the strongest first.

    :param stamp: [ns].
    :param positions: Nx3 float32 in the optical frame [m].
    :param descriptors: NxD, uint8 for binary ones (8 bits a column), float32 for others.
    :param covariances: Nx3x3 float32 of the positions [m^2].
    :param pixels: Nx2 float32 (u, v) in the distorted image [px].
    :param words: visual words of the keypoints; None without a vocabulary.
    :raises InputError: where the arrays do not fit each other.
    """

    stamp: int
    positions: np.ndarray
    descriptors: np.ndarray
    covariances: np.ndarray
    pixels: np.ndarray
    words: FrameWords | None = None

    def __post_init__(self) -> None:
        """Reject arrays of wrong type or shape."""
        self._convert('positions', None, 3)
        count = len(self.positions)
        required_descriptors(self.descriptors, count)
        self._convert('covariances', count, 3, 3)
        self._convert('pixels', count, 2)

    def _convert(self, name: str, *shape: int | None) -> None:
        object.__setattr__(self, name, numbers(
            getattr(self, name), shape, f'{name} of keypoints', np.float32))

    @staticmethod
    def none(stamp: int) -> KeypointFrame:
        """Return a frame without keypoints."""
        return replaced(_NONE, stamp=stamp)

    def __len__(self) -> int:
        """Return the number of keypoints."""
        return len(self.positions)

    def __getitem__(self, chosen: slice | np.ndarray) -> KeypointFrame:
        """Return the frame with some of its keypoints, by their rows, and no words."""
        return replaced(
            self, words=None, positions=self.positions[chosen],
            descriptors=self.descriptors[chosen], covariances=self.covariances[chosen],
            pixels=self.pixels[chosen])


_NONE = KeypointFrame(0, np.empty((0, 3), np.float32), np.empty((0, 32), np.uint8),
                      np.empty((0, 3, 3), np.float32), np.empty((0, 2), np.float32))


def required_pair(source: KeypointFrame, target: KeypointFrame) -> None:
    """
    Check that two frames can be compared.

    :raises InputError: where they are no keypoints, or their descriptors are not of one kind.
    """
    required(source, KeypointFrame, 'the source')
    required(target, KeypointFrame, 'the target')
    kinds = [(frame.descriptors.dtype, frame.descriptors.shape[1]) for frame in (source, target)]
    if len(source) and len(target) and kinds[0] != kinds[1]:
        raise InputError('the descriptors are ' + ' and '.join(
            f'{width} {dtype}' for dtype, width in kinds)
            + ' per keypoint: those of one detector are required')


class KeypointExtractor:
    """
    Extraction of the keypoints of RGB-D frames.

    :param vocabulary: vocabulary of the visual words; None: no words.
    :param word_radius: R_w, maximum descriptor distance between a keypoint and its words.
    :param detector: replaces the one named by ``features.detector``; the noise of its keypoints is
        that of ``features.chosen`` all the same.
    :raises InputError: where the detector has no method ``detect``, or the mask of the settings
        cannot be read.
    """

    def __init__(self, features: FeatureSettings, sensor: SensorSettings,
                 vocabulary: Vocabulary | None = None, word_radius: float = np.inf,
                 detector: Detector | None = None) -> None:
        self._features = required(features, FeatureSettings, 'features')
        self._vocabulary = vocabulary
        self._word_radius = word_radius
        self._sensor = required(sensor, SensorSettings, 'sensor')
        self._mask = mask_of(sensor)
        if detector is not None:
            required_method(detector, 'detect', 'the detector')
        self._detector = make_detector(features) if detector is None else detector

    def __deepcopy__(self, memo: dict[int, object]) -> KeypointExtractor:
        """Return itself: it does not change, and OpenCV's detectors cannot be copied."""
        return self

    def extract(self, frame: RgbdFrame) -> KeypointFrame:
        """
        Return the keypoints of a frame; there may be none.

        :raises InputError: where the image is too small, the mask does not fit it, or the detector
            does not return features.
        """
        required(frame, RgbdFrame, 'the frame')
        if self._mask is not None:
            frame = self._mask.applied(frame)
        detected = detect_some(self._detector, frame.grey,
                               functools.partial(self._choose, frame))
        positions = frame.camera.back_project(
            detected.pixels, depth.sample(frame.depth, detected.pixels, self._sensor))
        pixels, descriptors, scales = detected.pixels, detected.descriptors, detected.scales
        has_ray = np.isfinite(positions).all(axis=1)  # false at the border of a wide lens
        if not has_ray.all():
            positions, pixels = positions[has_ray], pixels[has_ray]
            descriptors, scales = descriptors[has_ray], scales[has_ray]
        noise = self._features.chosen
        covariances = depth.position_covariances(
            positions, noise.pixel_sigma * scales ** noise.pixel_exponent, frame.camera,
            self._sensor)
        words = None if self._vocabulary is None else self._vocabulary.words_of(
            descriptors, self._word_radius)
        arrays = (positions.astype(np.float32), descriptors, covariances.astype(np.float32),
                  pixels)
        for array in arrays:  # of a frame that may be kept for long
            array.flags.writeable = False
        return KeypointFrame(frame.stamp, *arrays, words)

    def _choose(self, frame: RgbdFrame, pixels: np.ndarray,
                responses: np.ndarray) -> np.ndarray:
        """Return the keypoints to keep, the strongest first: with depth, and spread."""
        has_depth = np.isfinite(depth.sample(frame.depth, pixels, self._sensor))
        if isinstance(frame, MaskedFrame):
            has_depth &= frame.shows(pixels)
        kept = np.flatnonzero(has_depth)
        kept = kept[np.argsort(-responses[kept], kind='stable')]
        maximum, cell_size = self._features.max_keypoints, self._features.cell_size
        if not maximum or len(kept) <= maximum:
            return kept
        if not cell_size:
            return kept[:maximum]
        return np.take(kept, spread(pixels[kept], maximum, cell_size))
