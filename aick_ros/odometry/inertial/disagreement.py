# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Disagreement of a sensor with the camera, over recent comparisons."""

from __future__ import annotations


class Disagreement:
    """
    Share of recent comparisons that disagree; the sensor is wrong while it is large.

    :param memory: number of comparisons that the share is over.
    :param wrong: share above which the sensor becomes wrong; ``right``: up to which it is right
        again.
    """

    def __init__(self, memory: float, wrong: float, right: float) -> None:
        self._memory, self._wrong, self._right = memory, wrong, right
        self._share = 0.0
        self.wrong_for = 0
        """Number of comparisons since the sensor became wrong; 0 where it is right."""

    @property
    def is_wrong(self) -> bool:
        """Contradiction of the camera in most of the recent comparisons."""
        return self.wrong_for > 0

    @property
    def is_suspected(self) -> bool:
        """More contradictions than those of a sensor that is right."""
        return self.suspicion > 0.0

    @property
    def suspicion(self) -> float:
        """Probability that the sensor is wrong: linear between the two shares."""
        if self.is_wrong:
            return 1.0
        return max(self._share - self._right, 0.0) / (self._wrong - self._right)

    def note(self, agrees: bool) -> None:
        """Note one comparison."""
        self._share += (float(not agrees) - self._share) / self._memory
        is_wrong = self._share > (self._right if self.is_wrong else self._wrong)
        self.wrong_for = self.wrong_for + 1 if is_wrong else 0
