# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
How well a detector places a keypoint, by the keypoint's scale.

Aligning two images around a keypoint places it to about a twentieth of a pixel. So where the
alignment finds a keypoint of one image in another, and where the detector found it there, differ
by the noise of the detector in both. Neither depth nor the motion of the camera has a part in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.noise.noise_law import bins_of, fit_law
from aick_ros.features import Features, make_detector
from aick_ros.features.descriptors import descriptor_distances
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.registration.refinement.lucas_kanade import track_there_and_back
from aick_ros.settings import Settings
from aick_ros.settings.parameter import parameters

LEAST_FLOW = 8.0
"""Median motion between the images of a pair [px]: of less, both may have the same errors."""

LEAST_PAIRS = 5
"""Pairs that it takes."""

_LEAST_TRACKED = 0.3  # share of the keypoints; of fewer the first image is out of sight
_MOST_PAIRS = 100  # after which others add nothing

_WINDOW, _LEVELS = 11, 4  # of the alignment
_NEAR = 5.0  # px at the finest scale: what is farther off is another keypoint
_SAME_SCALE = 1.1  # ratio up to which two scales may be of one keypoint
_MEDIAN_DISTANCE = 2.0 * np.sqrt(np.log(2.0))
"""Of two points that scatter by 1 along each axis around one place."""


@dataclass(frozen=True)
class ScaleBin:
    """
    The noise of keypoints of about the same scale.

    :param scale: their mean, 1 at the finest.
    :param matches: keypoints found twice.
    :param sigma: standard deviation along an axis of the image [px].
    :param model: the same by the model [px].
    """

    scale: float
    matches: int
    sigma: float
    model: float


@dataclass(frozen=True)
class PixelNoise:
    """
    The noise model sigma = pixel_sigma * scale ^ pixel_exponent of a detector.

    :param detector: its name.
    :param pairs: of frames it is estimated from.
    :param pixel_sigma: at the finest scale [px].
    :param exponent_estimated: False where the scales span too little to tell the exponent, and
        the one of the settings was kept.
    :param bins: with enough keypoints, by scale.
    """

    detector: str
    pairs: int
    pixel_sigma: float
    pixel_exponent: float
    exponent_estimated: bool
    bins: Sequence[ScaleBin]


class PixelNoiseSamples:
    """
    Gathers keypoints that were found in two images.

    :param settings: whose detector is used; its exponent where the images do not tell.
    """

    def __init__(self, settings: Settings = Settings()) -> None:
        self._features = settings.features
        self._most_unlike = settings.aick.lambda_f
        self._detector = make_detector(settings.features)
        self._before: tuple[np.ndarray, Features] | None = None
        self._scales: list[np.ndarray] = []
        self._distances: list[np.ndarray] = []

    @property
    def pairs(self) -> int:
        """How many pairs of frames there were."""
        return len(self._scales)

    def add(self, frame: RgbdFrame) -> None:
        """Take the next frame; it makes a pair where the image has moved far enough."""
        if self.pairs >= _MOST_PAIRS:
            return
        grey = frame.grey
        if self._before is None or self._before[0].shape != grey.shape:
            self._before = grey, self._detector.detect(grey)
            return
        before, found = self._before
        seen, tracked = _aligned(before, grey, found.pixels)
        if len(tracked) >= _LEAST_TRACKED * len(found.pixels):
            moved = np.linalg.norm(seen - found.pixels[tracked], axis=1)
            if len(moved) and np.median(moved) < LEAST_FLOW:
                return
        self._before = grey, self._detector.detect(grey)
        if len(tracked):
            self._compare(_subset(found, tracked), seen, self._before[1])

    def model(self) -> PixelNoise | None:
        """Return the noise model; None where the image moved too little, or shows too little."""
        if self.pairs < LEAST_PAIRS:
            return None
        bins = bins_of(np.concatenate(self._scales),
                       np.concatenate(self._distances) / _MEDIAN_DISTANCE)
        if not bins:
            return None
        declared = {p.name: p for p in parameters(self._features.chosen)}
        law = fit_law(bins, declared['pixel_exponent'])
        return PixelNoise(
            self._features.detector, self.pairs, law.scale, law.exponent, law.exponent_estimated,
            tuple(ScaleBin(bin_.at, bin_.count, bin_.sigma, law.at(bin_.at)) for bin_ in bins))

    def _compare(self, before: Features, seen: np.ndarray, now: Features) -> None:
        """Find the keypoints that were seen among those detected, and how far off they are."""
        if not len(now.pixels):
            return
        unlike = descriptor_distances(before.descriptors, now.descriptors)
        apart = np.linalg.norm(seen[:, None] - now.pixels[None], axis=2)
        scales = before.scales[:, None]
        same = ((apart < _NEAR * scales) & (now.scales < _SAME_SCALE * scales)
                & (scales < _SAME_SCALE * now.scales) & (unlike < self._most_unlike))
        unlike = np.where(same, unlike, np.inf)
        nearest, back = unlike.argmin(axis=1), unlike.argmin(axis=0)
        rows = np.flatnonzero(same.any(axis=1) & (back[nearest] == np.arange(len(nearest))))
        self._scales.append(before.scales[rows].astype(np.float64))
        self._distances.append(apart[rows, nearest[rows]])


def _subset(features: Features, rows: np.ndarray) -> Features:
    return Features(features.pixels[rows], features.descriptors[rows], features.responses[rows],
                    features.scales[rows])


def _aligned(before: np.ndarray, now: np.ndarray,
             pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """
    Follow keypoints into another image (Lucas and Kanade 1981, pyramids after Bouguet 2001).

    :param pixels: Nx2.
    :returns: Kx2, where they are seen, and K indices of those that were found.
    """
    seen, found = track_there_and_back(before, now, pixels, _WINDOW, _LEVELS)
    kept = np.flatnonzero(found)
    return seen[kept], kept
