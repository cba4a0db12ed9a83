# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The report of a misalignment of the camera's images: in the log once, in diagnostics always."""

from __future__ import annotations

from collections.abc import Callable

from aick_ros.registration.refinement.misalignment import NO_MISALIGNMENT, Misalignment


class MisalignmentReport:
    """
    Logs a misalignment when it is first found to differ from the one known at the start.

    :param log: called with the sentence, on the thread that registers.
    """

    def __init__(self, log: Callable[[str], object]) -> None:
        self._log = log
        self._misalignment = NO_MISALIGNMENT
        self._known: Misalignment | None = None
        self._is_logged = False

    def update(self, misalignment: Misalignment) -> None:
        """Take the misalignment as it is now estimated."""
        self._misalignment = misalignment
        self._known = self._known or misalignment
        if self._is_logged or not (misalignment.values - self._known.values).any():
            return
        self._is_logged = True
        self._log(f'{misalignment.description or "the known misalignment is not there"}. This is '
                  'corrected from now on; for the first frames, let `aick noise` measure it once '
                  'and set the parameters misalignment.*')

    @property
    def description(self) -> str:
        """The present estimate in words, for the diagnostics."""
        return self._misalignment.description or 'none'
