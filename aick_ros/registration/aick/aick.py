# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Adaptive Iterative Closest Keypoint (Ekekrantz et al., ECMR 2013, Sec. III).

Where the steps of the paper are:

===========================  ======================================================
w(i) = alpha^i (III-A)       :meth:`Aick.align`
d(a, b) (Eq. 1)              :meth:`aick_ros.registration.aick.search.Search.closest`
outlier threshold (Eq. 2)    the same method
d_d                          :mod:`aick_ros.features.descriptors`
R_w = infinity               :class:`aick_ros.registration.aick.search.FullSearch`
words of a vocabulary, Psi   :meth:`aick_ros.features.vocabulary.Vocabulary.words_of`
search by words (III-B)      :class:`aick_ros.registration.aick.word_search.WordSearch`
===========================  ======================================================
"""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.borders.values import required
from aick_ros.frames.keypoints import KeypointFrame, required_pair
from aick_ros.geometry import point_fit
from aick_ros.geometry.pose import unknown_covariance
from aick_ros.registration.aick.fit_covariance import fit_covariance
from aick_ros.registration.aick.search import FullSearch, Search
from aick_ros.registration.aick.word_search import WordSearch
from aick_ros.registration.result import Registration, failed
from aick_ros.registration.status import Status
from aick_ros.settings import AickSettings

_FEWEST_MATCHES = 3  # by definition: points that determine a rigid transform


class Aick:
    """Registers one keypoint frame to another, without an initial guess."""

    def __init__(self, settings: AickSettings = AickSettings()) -> None:
        self._settings = required(settings, AickSettings, 'settings')

    def register(self, source: KeypointFrame, target: KeypointFrame) -> Registration:
        """
        Return the pose of the source in the target (Sec. III), with its covariance.

        :raises InputError: where the descriptors of the two are not of one kind.
        """
        found = self.align(source, target)
        if not found.status.ok:
            return found
        return dataclasses.replace(found, covariance=fit_covariance(
            found.T_target_source, source, target, found.matches))

    def align(self, source: KeypointFrame, target: KeypointFrame) -> Registration:
        """Return the pose of the source in the target (Sec. III), its covariance unknown."""
        required_pair(source, target)
        if min(len(source), len(target)) < _FEWEST_MATCHES:
            return failed(Status.TOO_FEW_KEYPOINTS, f'{len(source)} and {len(target)} keypoints '
                          f'with depth, at least {_FEWEST_MATCHES} in each are required')
        search = self._search(source, target)
        T_target_source = np.eye(4)  # no guess: w(0) = 1, so d_e has no weight yet
        for i in range(self._settings.iterations):
            w = self._settings.alpha ** i
            matches = search.closest(T_target_source, w)  # Eq. 1 and Eq. 2
            if len(matches) < _FEWEST_MATCHES:
                return failed(Status.TOO_FEW_MATCHES, f'{len(matches)} matches in iteration {i} '
                              f'of {len(source)} and {len(target)} keypoints', i + 1)
            moments = point_fit.moments(source.positions, target.positions, matches)
            try:
                T_target_source = point_fit.fit_moments(moments)  # the least-squares step of ICP
            except point_fit.DegenerateGeometryError as error:
                return failed(Status.DEGENERATE_GEOMETRY, str(error), i + 1)
        return Registration(Status.OK, f'{len(matches)} matches', T_target_source,
                            unknown_covariance(), matches, i + 1, len(matches))

    def _search(self, source: KeypointFrame, target: KeypointFrame) -> Search:
        """Return the search by words where both frames have words of one vocabulary (III-B)."""
        if (source.words is None or target.words is None
                or source.words.vocabulary is not target.words.vocabulary):
            return FullSearch(source, target, self._settings)
        return WordSearch(source, target, self._settings)
