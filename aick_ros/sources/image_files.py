# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files with colour and depth images."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from aick_ros.borders.files import read_bytes
from aick_ros.borders.limits import MAX_MESSAGE_BYTES
from aick_ros.errors import InputError
from aick_ros.messages.bit_depth import BitDepth
from aick_ros.messages.png_jpeg import decode_colour, decode_units


def read_colour(path: Path, bits: BitDepth | None = None) -> np.ndarray:
    """
    Read a PNG or JPEG file.

    :param bits: those of the camera, where its images have 16; None: it uses all of them.
    :returns: HxWx3 (red, green, blue) or HxW uint8.
    :raises InputError: naming the file.
    """
    return _read(path, lambda content: decode_colour(content, bits))


def read_units(path: Path) -> np.ndarray:
    """
    Read a depth image in a PNG file, in the unit in which it is stored.

    :returns: HxW uint16.
    :raises InputError: naming the file.
    """
    return _read(path, decode_units)


def _read(path: Path, decode: Callable[[bytes], np.ndarray]) -> np.ndarray:
    content = read_bytes(path, 'the image', MAX_MESSAGE_BYTES)
    try:
        return decode(content)
    except InputError as error:
        raise InputError(f'cannot read the image {path}: {error}') from None
