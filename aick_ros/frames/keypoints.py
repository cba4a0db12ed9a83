# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keypoints of one frame, with their 3D positions and the covariance of these."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.features import Detector, make_detector
from aick_ros.features.selection import spread
from aick_ros.features.vocabulary import FrameWords, Vocabulary
from aick_ros.frames import depth
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.settings import FeatureSettings, SensorSettings


@dataclass(frozen=True, eq=False)
class KeypointFrame:
    """
    The keypoints of one frame that have depth, the strongest first; of a map, the oldest.

    :param stamp: [ns].
    :param positions: Nx3 float32 in the optical frame [m].
    :param descriptors: NxD, uint8 for binary ones (8 bits a column), float32 for others.
    :param covariances: Nx3x3 float32 of the positions [m^2].
    :param pixels: Nx2 float32 (u, v) in the image as it was taken [px].
    :param words: of the keypoints; None without a vocabulary.
    """

    stamp: int
    positions: np.ndarray
    descriptors: np.ndarray
    covariances: np.ndarray
    pixels: np.ndarray
    words: FrameWords | None = None

    def __len__(self) -> int:
        """Return the number of keypoints."""
        return len(self.positions)


class KeypointExtractor:
    """
    Turns RGB-D frames into keypoint frames.

    :param vocabulary: whose words the keypoints get; None: none.
    :param word_radius: R_w, how near a word must be to be one of a keypoint's.
    :param detector: used instead of the one that ``features.detector`` names; the noise of its
        keypoints is still that of ``features.chosen``.
    """

    def __init__(self, features: FeatureSettings, sensor: SensorSettings,
                 vocabulary: Vocabulary | None = None, word_radius: float = np.inf,
                 detector: Detector | None = None) -> None:
        self._features = features
        self._vocabulary = vocabulary
        self._word_radius = word_radius
        self._sensor = sensor
        self._detector = detector or make_detector(features)

    def extract(self, frame: RgbdFrame) -> KeypointFrame:
        """Return the keypoints of a frame; none where the image shows none."""
        found = self._detector.detect(frame.grey)
        depths = depth.sample(frame.depth, found.pixels, self._sensor)
        kept = np.flatnonzero(np.isfinite(depths))
        kept = kept[np.argsort(-found.responses[kept], kind='stable')]
        kept = self._select(kept, found.pixels[kept])
        positions = frame.camera.back_project(found.pixels[kept], depths[kept])
        seen = np.isfinite(positions).all(axis=1)  # some pixels of a wide lens have no ray
        kept, positions = kept[seen], positions[seen]
        pixels = found.pixels[kept]
        noise = self._features.chosen
        covariances = depth.position_covariances(
            positions, noise.pixel_sigma * found.scales[kept] ** noise.pixel_exponent,
            frame.camera, self._sensor)
        descriptors = found.descriptors[kept]
        words = None if self._vocabulary is None else self._vocabulary.words_of(
            descriptors, self._word_radius)
        return KeypointFrame(frame.stamp, positions.astype(np.float32), descriptors,
                             covariances.astype(np.float32), pixels, words)

    def _select(self, keypoints: np.ndarray, pixels: np.ndarray) -> np.ndarray:
        wanted, cell_size = self._features.max_keypoints, self._features.cell_size
        if not wanted or len(keypoints) <= wanted:
            return keypoints
        if not cell_size:
            return keypoints[:wanted]
        return keypoints[spread(pixels, wanted, cell_size)]
