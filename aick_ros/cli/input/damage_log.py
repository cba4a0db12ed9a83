# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Log of unusable images."""

from __future__ import annotations

import re

from aick_ros.borders.limits import MAX_DAMAGED_IMAGES
from aick_ros.cli.output.console import say
from aick_ros.errors import InputError

_MAX_SHOWN = 5  # of the first images; chosen
_MAX_LISTED = 20  # of all kinds; chosen: they fit on a screen
_NUMBER = re.compile(r'[\d.]+')  # also a stamp, and those in names of files


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
        self.count += 1
        if self.count > MAX_DAMAGED_IMAGES:
            raise InputError(f'more than {MAX_DAMAGED_IMAGES} images are unusable, the rest of '
                             'the recording is not read: correct what the first ones say, or '
                             'record it again')
        kind = _NUMBER.sub('', str(error))
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
