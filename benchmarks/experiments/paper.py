# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Results of the paper: Table I of Ekekrantz et al., ECMR 2013 (TUM fr1/room, gap 1)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PaperRow:
    """
    A row of Table I.

    :param seconds: of one registration, the extraction of keypoints not included.
    :param success: ratios at 0.0033, 0.01 and 0.05 m.
    """

    seconds: float
    success: tuple[float, float, float]


TABLE_1 = {
    'aick-surf': PaperRow(0.180, (0.374, 0.944, 0.993)),
    'aick-orb': PaperRow(0.135, (0.276, 0.885, 0.999)),
    'aick-surf-200': PaperRow(0.00385, (0.281, 0.902, 0.993)),
    'aick-orb-350': PaperRow(0.0113, (0.209, 0.833, 0.998)),
    'aick-surf-fast': PaperRow(0.000445, (0.258, 0.888, 0.992)),
    'aick-orb-fast': PaperRow(0.000717, (0.209, 0.828, 0.995)),
    'gicp': PaperRow(224.0, (0.070, 0.366, 0.996)),
    'ndt': PaperRow(237.0, (0.177, 0.706, 1.0)),
    'ransac3': PaperRow(4.09, (0.255, 0.860, 0.993)),
}
"""By the name that the method has here, in the paper's order."""
