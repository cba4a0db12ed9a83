# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Noise of keypoints and of depth, measured on the registrations of one camera.

Residuals that share an error across a part of the image count as fewer independent measurements.
The scatter between parts of the image, of one kind of residual about its own optimum, shows
by which factor the covariance of that kind is too small: the design effect of a cluster sample
(Kish 1965). The factors weight the two kinds (variance components, Helmert 1924). They are not
taken at the joint optimum: there the kind of the smaller weight shows the larger residuals, and
would lose ever more of its weight.

A difference of the two kinds well beyond that noise is a bias: depth that is not well registered
to colour, shutters, clocks. It grows with the motion. Scatter does not show it, so where it is
significant keypoints gain no weight by their small scatter. The larger the motion, the more of
the bias is due to depth, which then weighs less: the errors of its registration to colour and of
its clock displace it in proportion to the motion, each point alike, so that it does not scatter.
What all keypoints have in common, and changes from one registration to the next, is measured over
time (:mod:`.position_jitter`).
"""

from __future__ import annotations

import bisect
import dataclasses
import math
from dataclasses import dataclass, field

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.geometry.pose import along_all_axes
from aick_ros.registration.refinement.mean_scatter import MeanScatter
from aick_ros.registration.refinement.point_choice import PointChoice
from aick_ros.registration.refinement.position_jitter import MeanJitter, jitter
from aick_ros.registration.samples import NoiseSample, PosesByKind

# All bounds and weights chosen on two excerpts of real recordings and on rendered rooms with five
# kinds of cameras.
_MOTION_BOUNDS = 2.0, 6.0, 18.0, 54.0
"""Bounds between the ranges of motion that share their noise [px]."""

_MEMORY = 30  # registrations that an average is over
_PRIOR_COUNT = 3  # registrations that the prior counts for
_PRIOR_NORMALISED = 4.0  # of the squared bias: more than noise, until some are measured
_PRIOR_BIAS = 0.003, np.radians(0.15)
"""Bias between keypoints and depth along and about an axis [m, rad].

Measured on Kinects: 3 to 10 mm and 0.1 to 0.3 degrees.
"""

_LARGEST_FACTOR = 1e4  # bound on a factor measured by one registration, and on its inverse
_SMALLEST_SQUARE = 1e-12  # m^2 and rad^2; 1 micrometre, keeps the logarithm finite
_LOG_MEAN = -0.176, -0.369
"""Mean logarithm of chi-square by its degrees of freedom, six and three; derived:
digamma(n / 2) + log(2 / n). Subtracted, so that the exponential of a mean
logarithm estimates the variance."""

_MOTION_OF_DEPTH_BIAS = 600.0
"""Motion from which the whole bias is due to depth [px]; below, its share of the standard
deviation is in proportion to the motion."""

_NOISE_BOUNDS = 1.7, 4.0
"""Normalised squared bias: up to the first it is noise, of which scatter does not show all; from
the second on what exceeds 1 is a bias, with a share linear in its logarithm in between. Means are
1.2 to 2.8 on rendered cameras without a bias, 2 to 14 on those whose depth is registered wrongly,
5 to 38 on two excerpts of real recordings."""

_BIAS_BOUNDS = 3.0, 5.0
"""Normalised squared bias: from the second on keypoints gain no weight, up to the first they gain
all that the scatter shows, linear in its logarithm in between. Noise alone gives 1."""

_NOISE_FREE = 0.02
"""Median residual of depth, in standard deviations of the sensor's noise, of depth without noise.
Chosen: 0.002 to 0.015 of rendered cameras without noise, 0.03 to 1 of those with it and of two
excerpts of real recordings."""

_FEWEST_RESIDUALS = 10  # registrations; chosen


@dataclass(frozen=True, eq=False)
class Noise:
    """
    Noise expected of a registration.

    :param keypoints: factor of the variance of keypoints, relative to that of depth.
    :param bias: 6x6 covariance of the bias between keypoints and depth [m^2, m rad, rad^2].
    :param depth_bias: that of the part of it which is due to depth; diagonal.
    :param keypoint_jitter: 6x6 covariance of the jitter of the pose by keypoints; diagonal.
    :param keypoint_scatter: its shape, in the mean.
    :param depth_scatter: likewise, that of depth.
    """

    keypoints: float = 1.0
    bias: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    depth_bias: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    keypoint_jitter: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    keypoint_scatter: MeanScatter = MeanScatter()
    depth_scatter: MeanScatter = MeanScatter()


@dataclass(frozen=True, eq=False)
class _Average:
    """Mean logarithms of the samples of one range of motion; the prior counts as a few."""

    count: int = _PRIOR_COUNT
    ratio: float = 0.0
    normalised: float = math.log(_PRIOR_NORMALISED)
    along: float = 2.0 * math.log(_PRIOR_BIAS[0])
    about: float = 2.0 * math.log(_PRIOR_BIAS[1])
    jitter: MeanJitter = MeanJitter()

    def with_sample(self, sample: NoiseSample, shown: float | None) -> _Average:
        """Return the average with a sample and with the jitter that it shows [m^2]."""
        count = min(self.count + 1, _MEMORY)

        def mean(average: float, value: float) -> float:
            return average + (value - average) / count

        along, about = (math.log(max(square, _SMALLEST_SQUARE)) - _LOG_MEAN[1]
                        for square in sample.squares)
        return _Average(
            count, mean(self.ratio, _log(sample.ratio)),
            mean(self.normalised, _log(sample.normalised) - _LOG_MEAN[0]),
            mean(self.along, along), mean(self.about, about),
            self.jitter if shown is None else self.jitter.with_sample(shown))

    def noise(self, motion: float) -> Noise:
        """Return the noise expected of a registration; its motion is in pixels."""
        ratio = self.ratio
        if ratio < 0.0:
            ratio *= 1.0 - _share(self.normalised, _BIAS_BOUNDS)
        # share of the squares that is no noise
        excess = _share(self.normalised, _NOISE_BOUNDS) * (1.0 - math.exp(-self.normalised))
        bias = along_all_axes(excess * math.exp(self.along), excess * math.exp(self.about))
        return Noise(math.exp(ratio), bias,
                     min((motion / _MOTION_OF_DEPTH_BIAS) ** 2, 1.0) * bias,
                     along_all_axes(self.jitter.variance, 0.0))


class MeasuredNoise:
    """Noise of one camera, learned over its registrations; the settings are the prior."""

    def __init__(self) -> None:
        self._averages: dict[int, _Average] = {}  # of the ranges that have samples
        self._recent: tuple[PosesByKind, ...] = ()  # of up to three registrations
        self._scatters = MeanScatter(), MeanScatter()  # of the keypoints and of depth
        self._residual = 0.0  # mean logarithm of the residuals of depth
        self._residuals = 0  # registrations that have shown them
        self.points = PointChoice()
        """The choice of points of a surface."""

    @property
    def is_seen(self) -> bool:
        """Noise in the depth images, as of each real sensor: two of them are never equal."""
        return (self._residuals >= _FEWEST_RESIDUALS
                and self._residual > math.log(_NOISE_FREE))

    def expected(self, motion: float) -> Noise:
        """
        Return the noise expected of a registration.

        :param motion: mean displacement of the tracks in the image [px].
        """
        of_keypoints, of_depth = self._scatters
        return replaced(self._average(_range_of(motion)).noise(motion),
                        keypoint_scatter=of_keypoints, depth_scatter=of_depth)

    def usual_bias(self, motion: float) -> float:
        """
        Return the normalised square of the bias that registrations usually show.

        :param motion: mean displacement of the tracks in the image [px].
        """
        return math.exp(self._average(_range_of(motion)).normalised)

    def learn(self, sample: NoiseSample) -> None:
        """Add one registration to the averages."""
        at = _range_of(sample.motion)
        average = self._average(at).with_sample(sample, self._jitter(sample))
        self._averages[at] = average
        if sample.scatters is not None:
            of_keypoints, of_depth = map(MeanScatter.with_sample, self._scatters, sample.scatters)
            self._scatters = of_keypoints, of_depth
        if sample.depth_residual is not None:
            self._residuals += 1
            self._residual += (_log(sample.depth_residual) - self._residual) / min(
                self._residuals, _MEMORY)
        if sample.rare is not None:
            # of a bias large surfaces have the larger part, however alike their scatter is
            has_bias = average.normalised > math.log(_BIAS_BOUNDS[0])
            self.points.learn(min(sample.rare, 0.0) if has_bias else sample.rare)

    def _average(self, at: int) -> _Average:
        """Return the average of a range; one without samples takes that of the nearest."""
        if at in self._averages:
            return self._averages[at]
        if not self._averages:
            return _Average()
        nearest = min(self._averages, key=lambda one: (abs(one - at), one))
        return dataclasses.replace(self._averages[nearest], count=_PRIOR_COUNT)

    def _jitter(self, sample: NoiseSample) -> float | None:
        """Return the jitter that a sample shows after the two before it [m^2]."""
        self._recent = (*self._recent[-2:], sample.poses) if sample.poses else ()
        return jitter(*self._recent) if len(self._recent) == 3 else None


def _range_of(motion: float) -> int:
    return bisect.bisect_left(_MOTION_BOUNDS, motion)


def _share(logarithm: float, bounds: tuple[float, float]) -> float:
    """Return how far a logarithm is from that of one bound to that of the other, 0 to 1."""
    low, high = map(math.log, bounds)
    return min(max((logarithm - low) / (high - low), 0.0), 1.0)


def _log(factor: float) -> float:
    return math.log(min(max(factor, 1 / _LARGEST_FACTOR), _LARGEST_FACTOR))
