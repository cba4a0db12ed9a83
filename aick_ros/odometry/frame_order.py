# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Order of the frames, by their stamps."""

from __future__ import annotations


class FrameOrder:
    """The stamps [ns] of the last frame, and of the last one whose images were new."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._new: int | None = None

    def advance(self, stamp: int, is_new: bool = True) -> None:
        """Advance to a frame; is_new: whether its images are not those of the frame before."""
        self._last = stamp
        if is_new:
            self._new = stamp

    def is_next(self, stamp: int) -> bool:
        """Return whether a stamp is later than that of the last frame, if there is one."""
        return self._last is not None and self._last < stamp

    def back(self, stamp: int) -> int | None:
        """Return by how much a stamp is before the last frame [ns]; None: it is not."""
        return None if self._last is None or self._last < stamp else self._last - stamp

    def unchanged_since(self, stamp: int) -> int:
        """Return the stamp of the first frame with the images of the one of a stamp."""
        return stamp if self._new is None else self._new
