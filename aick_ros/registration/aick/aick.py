# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Adaptive Iterative Closest Keypoint (Ekekrantz et al., ECMR 2013, Sec. III)."""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import point_fit
from aick_ros.registration.aick.fit_covariance import fit_covariance
from aick_ros.registration.aick.search import FullSearch, Search
from aick_ros.registration.aick.word_search import WordSearch
from aick_ros.registration.result import Registration, failed, unknown
from aick_ros.registration.status import Status
from aick_ros.settings import AickSettings

_FEWEST = 3  # points that determine a rigid transform


class Aick:
    """Registers one keypoint frame to another, without an initial guess."""

    def __init__(self, settings: AickSettings = AickSettings()) -> None:
        self._settings = settings

    def register(self, source: KeypointFrame, target: KeypointFrame) -> Registration:
        """Return where the source was, seen from the target (III-A), and how sure that is."""
        found = self.align(source, target)
        if not found.status.ok:
            return found
        return dataclasses.replace(found, covariance=fit_covariance(
            found.T_target_source, source, target, found.matches))

    def align(self, source: KeypointFrame, target: KeypointFrame) -> Registration:
        """Return what :meth:`register` does, but for the covariance, which is infinite."""
        if min(len(source), len(target)) < _FEWEST:
            return failed(Status.TOO_FEW_KEYPOINTS, f'{len(source)} and {len(target)} keypoints '
                          f'with depth, it takes {_FEWEST}')
        search = self._search(source, target)
        points = [point_fit.homogeneous(frame.positions.astype(np.float64))
                  for frame in (source, target)]
        T_target_source = np.eye(4)
        for i in range(self._settings.iterations):
            w = self._settings.alpha ** i
            matches = search.closest(T_target_source, w)
            if len(matches) < _FEWEST:
                return failed(Status.TOO_FEW_MATCHES, f'{len(matches)} matches in iteration {i} '
                              f'of {len(source)} and {len(target)} keypoints', i + 1)
            matched = points[0].take(matches[:, 0], axis=0), points[1].take(matches[:, 1], axis=0)
            try:
                T_target_source = point_fit.fit_moments(matched[0].T @ matched[1])
            except point_fit.DegenerateGeometryError as error:
                return failed(Status.DEGENERATE_GEOMETRY, str(error), i + 1)
        return Registration(Status.OK, f'{len(matches)} matches', T_target_source, unknown(),
                            matches, i + 1, len(matches))

    def _search(self, source: KeypointFrame, target: KeypointFrame) -> Search:
        """Return the search by words where both frames have them of one vocabulary (III-B)."""
        words = source.words, target.words
        if None not in words and words[0].vocabulary is words[1].vocabulary:
            return WordSearch(source, target, self._settings)
        return FullSearch(source, target, self._settings)
