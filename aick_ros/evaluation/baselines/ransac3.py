# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
3-point RANSAC on matched keypoints, as described in the paper (IV-B).

Matches are formed by descriptor alone, three of them determine a model, and its inliers are the
keypoints that it moves close to any keypoint of the other frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from aick_ros.evaluation.baselines import Estimate
from aick_ros.features.descriptors import descriptor_distances
from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import point_fit
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset

_SAMPLE = 3  # by definition


class ThreePointRansac:
    """
    The best of many rigid transforms through three matches, refitted to its inliers.

    :param preset_name: preset whose keypoints are used.
    :param changes: dotted name -> value.
    :param models: number of models.
    :param lambda_e: largest distance of an inlier [m].
    :param lambda_f: largest descriptor distance of a match.
    """

    def __init__(self, preset_name: str, changes: dict[str, Any] | None = None,
                 models: int = 400, lambda_e: float = 0.02, lambda_f: float = 0.2) -> None:
        settings = with_values(preset(preset_name), changes or {})
        self._extractor = KeypointExtractor(settings.features, settings.sensor)
        self._models, self._lambda_e, self._lambda_f = models, lambda_e, lambda_f

    def prepare(self, frame: RgbdFrame) -> tuple[KeypointFrame, cKDTree | None]:
        """Return the keypoints, and their positions as a tree."""
        keypoints = self._extractor.extract(frame)
        return keypoints, cKDTree(keypoints.positions) if len(keypoints) else None

    def register(self, source: tuple[KeypointFrame, cKDTree | None],
                 target: tuple[KeypointFrame, cKDTree | None]) -> Estimate:
        """Return the transform; the same pair always gives the same one."""
        (source_frame, _), (target_frame, target_tree) = source, target
        matches = self._matches(source_frame, target_frame)
        if target_tree is None or len(matches) < _SAMPLE:
            return Estimate(None, 'too few matches')
        rng = np.random.default_rng([source_frame.stamp, target_frame.stamp])
        models = self._fit_samples(source_frame.positions[matches[:, 0]],
                                   target_frame.positions[matches[:, 1]], rng)
        if not len(models):
            return Estimate(None, 'no three matches span a triangle')
        return self._refit_best(models, source_frame.positions, target_frame.positions,
                                target_tree)

    def _matches(self, source: KeypointFrame, target: KeypointFrame) -> np.ndarray:
        """Return the match of each source keypoint with a similar one, Kx2."""
        if not len(source) or not len(target):
            return np.empty((0, 2), np.intp)
        distances = descriptor_distances(source.descriptors, target.descriptors)
        closest = distances.argmin(axis=1)
        similar = np.flatnonzero(distances[np.arange(len(source)), closest] <= self._lambda_f)
        return np.column_stack([similar, closest[similar]])

    def _fit_samples(self, source: np.ndarray, target: np.ndarray,
                     rng: np.random.Generator) -> np.ndarray:
        models = []
        for _ in range(self._models):
            sample = rng.choice(len(source), _SAMPLE, replace=False)
            try:
                models.append(point_fit.fit(source[sample], target[sample]))
            except point_fit.DegenerateGeometryError:
                continue
        return np.array(models).reshape(-1, 4, 4)

    def _refit_best(self, models: np.ndarray, source: np.ndarray, target: np.ndarray,
                    target_tree: cKDTree) -> Estimate:
        moved = source @ models[:, :3, :3].transpose(0, 2, 1) + models[:, None, :3, 3]
        distances, closest = target_tree.query(moved, distance_upper_bound=self._lambda_e)
        inliers, closest = np.isfinite(distances), np.asarray(closest)
        best = int(inliers.sum(axis=1).argmax())
        kept = np.flatnonzero(inliers[best])
        try:
            return Estimate(point_fit.fit(source[kept], target[closest[best, kept]]))
        except point_fit.DegenerateGeometryError:
            return Estimate(None, 'too few inliers')
