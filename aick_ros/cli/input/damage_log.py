# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Log of unusable images."""

from __future__ import annotations

from aick_ros.borders.limits import MAX_DAMAGED_IMAGES
from aick_ros.cli.output.console import say
from aick_ros.errors import InputError

_MAX_SHOWN = 5


class DamageLog:
    """Prints the first unusable images and counts all."""

    def __init__(self) -> None:
        self.count = 0

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
        if self.count <= _MAX_SHOWN:
            say(f'skipped: {error}')
        elif self.count == _MAX_SHOWN + 1:
            say('more images are skipped; they are counted, not listed')

    def close(self) -> None:
        """Print the number of skipped images."""
        if self.count:
            noun = 'image was' if self.count == 1 else 'images were'
            say(f'{self.count} {noun} skipped, for the reasons above; all others were used')
