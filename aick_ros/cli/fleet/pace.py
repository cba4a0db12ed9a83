# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The pace at which a server must send."""

from __future__ import annotations

import time

from aick_ros.errors import TransferError

SILENCE_LIMIT = 10.0
"""Longest time without a byte [s], and over which the pace is taken; chosen."""

SLOWEST = 1000
"""Lowest pace, of all files together [bytes/s]; chosen."""


class SilentServerError(TransferError):
    """A server that does not answer, or hardly sends; it has had its time: none for once more."""


class Pace:
    """
    Bytes that a server sends.

    :param url: for the sentence.
    """

    def __init__(self, url: str) -> None:
        self._url = url
        self._start, self._arrived = time.monotonic(), 0
        self._total = 0

    def add(self, size: int) -> None:
        """
        Count bytes.

        :raises SilentServerError: where they hardly arrive.
        """
        self._total += size
        self._arrived, passed = self._arrived + size, time.monotonic() - self._start
        if passed > SILENCE_LIMIT:
            if self._arrived < SLOWEST * passed:
                raise SilentServerError(f'{self._url} hardly sends: {self._arrived} bytes arrived '
                                        f'in {passed:.0f} s; try later, or copy the recording '
                                        'yourself')
            self._start, self._arrived = time.monotonic(), 0

    @property
    def was_kept(self) -> bool:
        """Return whether the server has sent for a while: an interruption, not a hang."""
        return self._total >= SLOWEST * SILENCE_LIMIT
