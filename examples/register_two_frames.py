#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The paper in twenty lines: two frames registered by AICK alone, without an initial guess.

usage: register_two_frames.py SOURCE [GAP]     GAP: a whole number of frames from 1 on (5)
"""

import sys
from itertools import islice

from aick_ros import Aick, InputError, KeypointExtractor, Registration, open_source, preset


def register(path: str, gap: int = 5) -> Registration:
    """Return the pose of a frame in the frame ``gap`` before it."""
    settings = preset('paper-full')
    extractor = KeypointExtractor(settings.features, settings.sensor)
    frames = list(islice(open_source(path).frames(), 0, gap + 1, gap))
    if len(frames) < 2:
        raise InputError(f'{path} has no frame {gap} after its first: give a smaller GAP')
    target, source = map(extractor.extract, frames)
    return Aick(settings.aick).register(source, target)


if __name__ == '__main__':
    if len(sys.argv) < 2 or not all(gap.isdecimal() and int(gap) for gap in sys.argv[2:]):
        sys.exit(__doc__)
    try:
        found = register(sys.argv[1], *map(int, sys.argv[2:]))
    except InputError as error:  # says what is wrong, where, and what to do
        sys.exit(str(error))
    print(f'{found.status.value}: {found.reason}', found.T_target_source.round(4), sep='\n')
