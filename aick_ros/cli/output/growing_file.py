# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A file that has whole lines at any time."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from aick_ros.borders.replacement import unwritable


class GrowingFile:
    """
    Text that grows by lines; a line that the disk has no room for is not begun.

    :raises InputError: where it cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._file = open(path, 'wb', buffering=0)
        except OSError as error:
            raise unwritable(path, error) from None

    def append(self, lines: str) -> None:
        """
        Append whole lines.

        :raises InputError: where they cannot be written; nothing of them is in the file then.
        """
        start, left = self._file.tell(), memoryview(lines.encode('utf-8', 'backslashreplace'))
        try:
            while left:
                left = left[self._file.write(left):]
        except OSError as error:
            self.cut(start)
            raise unwritable(self._path, error) from None

    @property
    def size(self) -> int:
        """Number of bytes."""
        return self._file.tell()

    def cut(self, size: int) -> None:
        """Remove all but the first bytes."""
        with suppress(OSError):
            self._file.truncate(size)
            self._file.seek(size)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
