# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Check of a level start by the frames after it."""

from __future__ import annotations

_CONFIRMED = 90  # frames; chosen: three seconds at 30 Hz, in which a filter that is right settles


class StartCheck:
    """
    Doubt of a level start, until a motion that shows what is up has agreed with it for long.

    A sensor that is wrong is contradicted in some frames and not in others. So the largest doubt
    remains until then. One that is stuck since before the start is as wrong as one that is
    contradicted: where up was, it has not measured.
    """

    def __init__(self) -> None:
        self.doubt = 0.0
        """Probability that the start is wrong; 1: contradicted by the camera, or not measured."""
        self.restart()

    def restart(self) -> None:
        """Check another start, of the same sensor: what is doubted of it remains."""
        self._agreed_for = 0  # frames; at most _CONFIRMED

    def note(self, suspicion: float, is_shown: bool) -> None:
        """
        Note a frame.

        :param suspicion: probability that the sensor is wrong, by recent comparisons; that it
            is stuck, where its value never changes.
        :param is_shown: whether the motion shows what is up; at rest all directions agree.
        """
        if self._agreed_for >= _CONFIRMED:
            return
        if suspicion > 0.0:
            self._agreed_for = 0
            self.doubt = max(self.doubt, suspicion)
        elif is_shown:
            self._agreed_for += 1
            if self._agreed_for == _CONFIRMED:
                self.doubt = 0.0
