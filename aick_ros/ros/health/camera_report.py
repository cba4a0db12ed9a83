# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The report of what is wrong with a camera's images: in the log once, in diagnostics always."""

from __future__ import annotations

from collections.abc import Callable

from aick_ros.frames.depth_distortion import DepthDistortion
from aick_ros.registration.refinement.misalignment import Misalignment


class CameraReport:
    """
    Logs a misalignment when it first differs from that at the start, and a distortion once found.

    :param log: called with a sentence, on the thread that registers.
    :ivar misalignment: the present estimate in words, for the diagnostics.
    :ivar distortion: the same of the depth images.
    """

    def __init__(self, log: Callable[[str], object]) -> None:
        self._log = log
        self._logged = set[str]()
        self._known: Misalignment | None = None
        self.misalignment = self.distortion = 'none'

    def update(self, misalignment: Misalignment, distortion: DepthDistortion) -> None:
        """Take both as they are now estimated."""
        self.misalignment = misalignment.description or 'none'
        self.distortion = distortion.description or 'none'
        self._known = self._known or misalignment
        if (misalignment.values - self._known.values).any():
            self._log_once('misalignment', (
                f'{misalignment.description or "the known misalignment is not there"}. This is '
                'corrected from now on; for the first frames, let `aick noise` measure it once '
                'and set the parameters misalignment.*'))
        if not distortion.is_none:
            self._log_once('distortion',
                           f'{distortion.description}. This is corrected from now on')

    def _log_once(self, what: str, sentence: str) -> None:
        if what not in self._logged:
            self._logged.add(what)
            self._log(sentence)
