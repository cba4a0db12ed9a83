# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Unusable images, logged or counted."""

from __future__ import annotations

import re

from aick_ros.borders.limits import MAX_DAMAGED_IMAGES
from aick_ros.borders.names import counted
from aick_ros.cli.output.console import say
from aick_ros.errors import InputError

_MAX_SHOWN = 5  # of the first images; chosen
_MAX_LISTED = 20  # of all kinds; chosen: they fit on a screen
_MAX_KEPT = 5  # reasons of a recording among many; chosen: a line of each
_NUMBER = re.compile(r'[\d.]+')  # also a stamp, and those in names of files


class DamageCount:
    """Counts unusable images, and keeps the first one and the first ones of other kinds."""

    def __init__(self) -> None:
        self.count = 0
        self._first: dict[str, InputError] = {}  # of each kind
        self._is_complete = True

    def __call__(self, error: InputError) -> None:
        """
        Count an image that is skipped.

        :raises InputError: where there are too many to go on.
        """
        self.count = _one_more(self.count)
        kind = _kind(error)
        if len(self._first) < _MAX_KEPT:
            self._first.setdefault(kind, error)
        self._is_complete &= kind in self._first

    @property
    def first(self) -> InputError | None:
        """Reason of the first image; None without one."""
        return next(iter(self._first.values()), None)

    @property
    def remarks(self) -> list[str]:
        """Number of skipped images with the first one of each reason, in a sentence or none."""
        if not self.count:
            return []
        reasons = ', '.join([*map(str, self._first.values()),
                             *([] if self._is_complete else ['and for others'])])
        return [f'{counted(self.count, "image")} skipped, the first of each reason: {reasons}']


class DamageLog:
    """Prints the first unusable images, and the first one of each kind, and counts all."""

    def __init__(self) -> None:
        self.count = 0
        self._listed = 0
        self._kinds: set[str] = set()  # sentences without numbers, of the images that are listed
        self._is_shortened = False
        self._is_complete = True  # whether an image of each kind is listed

    def __call__(self, error: InputError) -> None:
        """
        Log an image that is skipped.

        :raises InputError: where there are too many to go on.
        """
        self.count = _one_more(self.count)
        kind = _kind(error)
        is_new = kind not in self._kinds
        if self._listed < _MAX_LISTED and (is_new or self.count <= _MAX_SHOWN):
            self._listed += 1
            self._kinds.add(kind)
            say(f'skipped: {error}')
            return
        if not self._is_shortened:
            self._is_shortened = True
            say('more images are skipped and counted; of each further reason one is listed')
        self._is_complete &= not is_new

    def close(self) -> None:
        """Print the number of skipped images."""
        if self.count:
            noun = 'image was' if self.count == 1 else 'images were'
            reasons = 'the reasons above' + ('' if self._is_complete else ' and others')
            say(f'{self.count} {noun} skipped, for {reasons}; all others were used')


def _one_more(count: int) -> int:
    """Return a number of unusable images with one more; InputError where those are too many."""
    if count >= MAX_DAMAGED_IMAGES:
        raise InputError(f'more than {MAX_DAMAGED_IMAGES} images are unusable, the rest of '
                         'the recording is not read: correct what the first ones say, or '
                         'record it again')
    return count + 1


def _kind(error: InputError) -> str:
    """Return what an image has in common with others that are unusable for the same reason."""
    return _NUMBER.sub('', str(error))
