# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Noise of the pixel position of keypoints, by their scale.

Optical flow tracks a keypoint from one image to another to about a twentieth of a pixel. So the
distance between the tracked keypoint and the same keypoint as detected in the second image is due
to the noise of the detector in both images. Neither the depth nor the motion of the camera enters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.noise.noise_law import bins_of, fit_law
from aick_ros.features import Features, make_detector
from aick_ros.features.descriptors import descriptor_distances
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.registration.refinement.lucas_kanade import Pyramid, track_there_and_back
from aick_ros.settings import Settings
from aick_ros.settings.parameter import parameters

MIN_FLOW = 8.0  # chosen
"""Minimum median flow of a pair of images [px]; below, the errors in both are correlated."""

MIN_PAIRS = 5  # chosen
"""Minimum number of pairs of images."""

_MIN_TRACKED = 0.3  # share of tracked keypoints; below, the view has changed too much; chosen
_MAX_PAIRS = 100  # more pairs do not improve the estimate; chosen

_WINDOW, _LEVELS = 11, 4  # of the optical flow; chosen
_MAX_DISTANCE = 5.0  # [px] at the finest scale between track and detection; chosen
_MAX_SCALE_RATIO = 1.1  # of a keypoint detected twice; chosen
_MEDIAN_DISTANCE = 2.0 * np.sqrt(np.log(2.0))
"""Derived: median distance of two points with unit variance along each axis (Rayleigh)."""


@dataclass(frozen=True)
class ScaleBin:
    """
    Noise of keypoints of about the same scale.

    :param scale: mean scale; 1 is the finest.
    :param matches: number of keypoints detected in two images.
    :param sigma: standard deviation along each axis of the image [px].
    :param model: standard deviation by the model [px].
    """

    scale: float
    matches: int
    sigma: float
    model: float


@dataclass(frozen=True)
class PixelNoise:
    """
    Noise model sigma = pixel_sigma * scale ^ pixel_exponent of a detector.

    :param detector: name of the detector.
    :param pairs: number of pairs of images.
    :param pixel_sigma: standard deviation at the finest scale [px].
    :param exponent_estimated: False where the range of scales is too small to estimate the
        exponent, and that of the settings was kept.
    :param bins: bins with enough keypoints, by scale.
    """

    detector: str
    pairs: int
    pixel_sigma: float
    pixel_exponent: float
    exponent_estimated: bool
    bins: Sequence[ScaleBin]


class PixelNoiseSamples:
    """
    Collects keypoints that are detected in two images.

    :param settings: its detector is used, and its exponent where the images do not determine one.
    """

    def __init__(self, settings: Settings = Settings()) -> None:
        self._features = settings.features
        self._max_descriptor_distance = settings.aick.lambda_f
        self._detector = make_detector(settings.features)
        self._before: tuple[np.ndarray, Features] | None = None
        self._scales: list[np.ndarray] = []
        self._distances: list[np.ndarray] = []

    @property
    def pairs(self) -> int:
        """Number of pairs of images."""
        return len(self._scales)

    def add(self, frame: RgbdFrame) -> None:
        """Add the next frame; it makes a pair where the flow is large enough."""
        if self.pairs >= _MAX_PAIRS:
            return
        grey = frame.grey
        if self._before is None or self._before[0].shape != grey.shape:
            self._before = grey, self._detector.detect(grey)
            return
        previous, detected = self._before
        positions, found = track_there_and_back(
            Pyramid(previous, _WINDOW, _LEVELS), Pyramid(grey, _WINDOW, _LEVELS),
            detected.pixels)
        tracked = np.flatnonzero(found)
        positions = positions[tracked]
        if len(tracked) >= _MIN_TRACKED * len(detected.pixels):
            flow = np.linalg.norm(positions - detected.pixels[tracked], axis=1)
            if len(flow) and np.median(flow) < MIN_FLOW:
                return
        self._before = grey, self._detector.detect(grey)
        if len(tracked):
            self._compare(_subset(detected, tracked), positions, self._before[1])

    def model(self) -> PixelNoise | None:
        """Return the noise model; None where there was too little flow or too little texture."""
        if self.pairs < MIN_PAIRS:
            return None
        bins = bins_of(np.concatenate(self._scales),
                       np.concatenate(self._distances) / _MEDIAN_DISTANCE)
        if not bins:
            return None
        declared = {p.name: p for p in parameters(self._features.chosen)}
        law = fit_law(bins, self._features.chosen.pixel_exponent, declared['pixel_exponent'])
        return PixelNoise(
            self._features.detector, self.pairs, law.scale, law.exponent, law.exponent_estimated,
            tuple(ScaleBin(bin_.at, bin_.count, bin_.sigma, law.at(bin_.at)) for bin_ in bins))

    def _compare(self, before: Features, tracked: np.ndarray, now: Features) -> None:
        """
        Match tracked keypoints to those detected, and keep the distances.

        :param before: the tracked keypoints as detected in the first image, K.
        :param tracked: Kx2, their positions in the second image.
        :param now: keypoints detected in the second image.
        """
        if not len(now.pixels):
            return
        descriptors = descriptor_distances(before.descriptors, now.descriptors)
        distances = np.linalg.norm(tracked[:, None] - now.pixels[None], axis=2)
        scales = before.scales[:, None]
        possible = ((distances < _MAX_DISTANCE * scales)
                    & (now.scales < _MAX_SCALE_RATIO * scales)
                    & (scales < _MAX_SCALE_RATIO * now.scales)
                    & (descriptors < self._max_descriptor_distance))
        descriptors = np.where(possible, descriptors, np.inf)
        best, best_back = descriptors.argmin(axis=1), descriptors.argmin(axis=0)
        is_mutual = best_back[best] == np.arange(len(best))
        rows = np.flatnonzero(possible.any(axis=1) & is_mutual)
        self._scales.append(before.scales[rows].astype(np.float64))
        self._distances.append(distances[rows, best[rows]])


def _subset(features: Features, rows: np.ndarray) -> Features:
    return Features(features.pixels[rows], features.descriptors[rows], features.responses[rows],
                    features.scales[rows])
