# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Ratios of measured times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

Times = Mapping[str, Mapping[str, Sequence[float]]]
"""Contestant -> stage, ``total`` among them -> milliseconds of each frame."""


@dataclass(frozen=True)
class Share:
    """The mean time of a stage of one contestant, by that of another."""

    name: str
    stage: str
    by: str
    by_stage: str

    def of(self, times: Times) -> float:
        """Return the ratio."""
        return float(np.mean(times[self.name][self.stage])
                     / np.mean(times[self.by][self.by_stage]))

    def is_measured(self, times: Times) -> bool:
        """Return whether both contestants took part."""
        return self.name in times and self.by in times


def _whole(name: str, by: str) -> Share:
    return Share(name, 'total', by, 'total')


def _registration(by: str) -> Share:
    return Share('small-gicp', 'register', by, 'register')


SHARES: Mapping[str, Share] = {
    'default_by_opencv_depth': _whole('default', 'opencv-depth'),
    'embedded_by_opencv_depth': _whole('embedded', 'opencv-depth'),
    'paper_fast_by_opencv_depth': _whole('paper-fast', 'opencv-depth'),
    'default_by_opencv_rgbd': _whole('default', 'opencv-rgbd'),
    'default_by_small_gicp': _whole('default', 'small-gicp'),
    'default_by_pnp': _whole('default', 'pnp'),
    'small_gicp_by_orb_fast': _registration('aick-orb-fast'),
    'small_gicp_by_orb_350': _registration('aick-orb-350'),
    'small_gicp_by_orb': _registration('aick-orb'),
}
"""Name of a ratio -> what it is of; of the last three larger is better."""

LARGER_IS_BETTER = frozenset(name for name in SHARES if name.startswith('small_gicp_by'))


def ratios(times: Times) -> dict[str, float]:
    """Return the ratios of one run: those of the contestants that took part."""
    found = {name: share.of(times) for name, share in SHARES.items() if share.is_measured(times)}
    for name, prefix in (('default', ''), ('embedded', 'embedded_')):
        if name in times:
            median, slow = np.percentile(times[name]['total'], (50, 99))
            found[f'{prefix}p99_by_median'] = float(slow / median)
    return found
