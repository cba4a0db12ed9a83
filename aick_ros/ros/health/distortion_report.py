# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The report of a distortion of depth images: in the log once, in diagnostics always."""

from __future__ import annotations

from collections.abc import Callable

from aick_ros.frames.depth_distortion import NO_DISTORTION, DepthDistortion


class DistortionReport:
    """
    Logs a distortion when it is first found.

    :param log: called with the sentence, on the thread that registers.
    """

    def __init__(self, log: Callable[[str], object]) -> None:
        self._log = log
        self._distortion = NO_DISTORTION
        self._is_logged = False

    def update(self, distortion: DepthDistortion) -> None:
        """Take the distortion as it is now estimated."""
        self._distortion = distortion
        if not (self._is_logged or distortion.is_none):
            self._is_logged = True
            self._log(f'{distortion.description}. This is corrected from now on')

    @property
    def description(self) -> str:
        """The present estimate in words, for the diagnostics."""
        return self._distortion.description or 'none'
