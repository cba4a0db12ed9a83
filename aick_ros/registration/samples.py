# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Samples of a camera: what the residuals of one registration show of its errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class PosesByKind:
    """
    Poses of the source in the target of one registration, by each kind of residual alone.

    :param stamps: of the source and of the target [ns].
    :param by_keypoints: 4x4 [m].
    :param by_depth: 4x4 [m].
    :param variance: of the position by keypoints as their scatter shows it, mean along an axis
        [m^2].
    """

    stamps: tuple[int, int]
    by_keypoints: np.ndarray
    by_depth: np.ndarray
    variance: float


@dataclass(frozen=True, eq=False)
class NoiseSample:
    """
    Noise as one registration shows it.

    :param motion: mean displacement of the tracks in the image [px].
    :param ratio: design effect of the keypoints by that of depth.
    :param normalised: squared bias by its covariance, per degree of freedom.
    :param squares: mean squared bias along an axis and about an axis [m^2, rad^2].
    :param poses: by keypoints and by depth alone.
    :param scatters: of the keypoints and of depth, 6x6, in units of their information.
    :param rare: logarithm of the variance between parts of the image on planes which few cells
        face as, by that on planes which many do; None where it shows none.
    :param depth_residual: median length of the residuals of depth, in standard deviations of the
        sensor's noise; None where it shows none.
    """

    motion: float
    ratio: float
    normalised: float
    squares: tuple[float, float]
    poses: PosesByKind | None = None
    scatters: tuple[np.ndarray, np.ndarray] | None = None
    rare: float | None = None
    depth_residual: float | None = None


@dataclass(frozen=True, eq=False)
class Equations:
    """
    Normal equations of N unknowns.

    :param information: NxN.
    :param gradient: N, information times the values that explain the residuals best.
    """

    information: np.ndarray
    gradient: np.ndarray


@dataclass(frozen=True, eq=False)
class MisalignmentSample:
    """
    Normal equations of the misalignment by one registration, its pose eliminated.

    :param information: 12x12, in the order of :attr:`Misalignment.values`.
    :param gradient: 12, information times the values that explain the residuals best.
    :param with_distortion: of the misalignment, and behind it the distortion of the depth image
        at its nodes; None: not made.
    """

    information: np.ndarray
    gradient: np.ndarray
    with_distortion: Equations | None = None


@dataclass(frozen=True, eq=False)
class Measure:
    """Measures what residuals show of a camera; what learns nothing of it does not need that."""

    noise: Callable[[], NoiseSample]
    misalignment: Callable[[], MisalignmentSample | None]
