# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""All textures of a scene in one picture, each at many resolutions, for one look-up a frame."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from aick_ros.errors import InputError
from aick_ros.sources.synthetic.surfaces import Surface, TexturePoints

_LEVELS = 18  # of resolution, each coarser than the last by the square root of two
_TAPS = 4  # look-ups along the stretch of a pixel that looks aslant
_SHARPEN = 1.25  # levels finer than one texel a pixel, because the interpolation blurs too
_BORDER = 4  # [texels] around a picture; taps are at most 2 apart, so look-ups reach 3.5 beyond it
_LARGEST = 32000  # [texels] in either direction that cv2.remap takes
_WIDTHS = 8192, _LARGEST  # [texels] of the atlas: of a room, and of what is too large for that
_ROW = 1024  # samples looked up in a row, as cv2.remap takes pictures


class Atlas:
    """
    The textures of surfaces, filtered for any distance.

    A sample averages over the pixel it stands for: over its width by the choice of the
    resolution (mip-maps), over its length, where the surface is seen aslant, by four look-ups.
    """

    def __init__(self, surfaces: Sequence[Surface]) -> None:
        levels = [_pyramid(surface.image) for surface in surfaces]
        pictures = [picture for pyramid in levels for picture in pyramid]
        self._picture, corners = _pack(pictures)
        sizes = np.array([picture.shape[1::-1] for picture in pictures], np.float32)
        metres = np.repeat([(s.width, s.height) for s in surfaces], _LEVELS, axis=0)
        # one row for each texture and level: texels a metre and, of s = t = 0, the place
        self._scales = np.ascontiguousarray((sizes / metres).T, np.float32)
        self._origins = np.ascontiguousarray((corners - 0.5).T, np.float32)
        self._texels = np.array([np.sqrt(s.width * s.height / np.prod(s.image.shape[:2]))
                                 for s in surfaces], np.float32)

    def look_up(self, textures: np.ndarray, points: TexturePoints,
                pixel_widths: np.ndarray) -> np.ndarray:
        """
        Return the colours of samples.

        :param textures: N indices of surfaces.
        :param points: N places on them.
        :param pixel_widths: N float32, what a pixel covers on a surface it faces [m].
        :returns: Nx3 uint8.
        """
        length = np.sqrt(points.stretch_s ** 2 + points.stretch_t ** 2)
        texel = self._texels.take(textures)
        covered = np.maximum(pixel_widths, length / _TAPS)
        level = np.rint(2 * np.log2(covered / texel) - _SHARPEN)
        level = np.clip(level, 0, _LEVELS - 1)
        # at the coarsest level a pixel may be longer than the border allows for
        longest = np.float32(2 * _TAPS * 2 ** ((_LEVELS - 1) / 2)) * texel
        step = np.minimum(1 / _TAPS, longest / _TAPS / np.maximum(length, 1e-9))
        row = textures * np.intp(_LEVELS) + level.astype(np.intp)
        scale_x, scale_y = (scale.take(row) for scale in self._scales)
        x = points.s * scale_x + self._origins[0].take(row)
        y = points.t * scale_y + self._origins[1].take(row)
        step_x, step_y = points.stretch_s * scale_x * step, points.stretch_t * scale_y * step
        x, y, step_x, step_y = (_in_rows(a) for a in (x, y, step_x, step_y))
        total = np.full((*x.shape, 3), _TAPS // 2, np.uint16)
        for tap in np.arange(_TAPS, dtype=np.float32) - np.float32((_TAPS - 1) / 2):
            total += cv2.remap(self._picture, x + tap * step_x, y + tap * step_y, cv2.INTER_LINEAR)
        return (total // _TAPS).astype(np.uint8).reshape(-1, 3)[:len(textures)]


def _in_rows(values: np.ndarray) -> np.ndarray:
    rows = len(values) // _ROW + 1
    return np.pad(values, (0, rows * _ROW - len(values))).reshape(rows, _ROW)


def _pyramid(image: np.ndarray) -> list[np.ndarray]:
    levels = [image]
    for level in range(1, _LEVELS):
        size = [max(1, round(n / 2 ** (level / 2))) for n in image.shape[1::-1]]
        finer = levels[max(level - 2, 0)]
        levels.append(cv2.resize(finer, size, interpolation=cv2.INTER_AREA))
    return levels


def _pack(pictures: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Lay pictures beside each other; return the whole and the corners, Nx2 (x, y)."""
    sizes = np.array([picture.shape[1::-1] for picture in pictures]) + 2 * _BORDER
    for atlas_width in _WIDTHS:
        corners, atlas_height = _in_shelves(sizes, atlas_width)
        if sizes[:, 0].max() <= atlas_width and atlas_height <= _LARGEST:
            break
    else:
        raise InputError('the scene has more texture than can be rendered; make it smaller')
    atlas = np.zeros((atlas_height, atlas_width, 3), np.uint8)
    for picture, (x, y) in zip(pictures, corners):
        framed = cv2.copyMakeBorder(picture, _BORDER, _BORDER, _BORDER, _BORDER,
                                    cv2.BORDER_REPLICATE)
        atlas[y:y + framed.shape[0], x:x + framed.shape[1]] = framed
    return atlas, corners + _BORDER


def _in_shelves(sizes: np.ndarray, atlas_width: int) -> tuple[np.ndarray, int]:
    """Lay Nx2 sizes in shelves, the tallest first; return their corners (x, y), and the height."""
    corners = np.empty_like(sizes)
    x = y = shelf = 0
    for i in np.argsort(-sizes[:, 1], kind='stable'):
        width, height = sizes[i]
        if x + width > atlas_width:
            x, y, shelf = 0, y + shelf, 0
        corners[i] = x, y
        x, shelf = x + width, max(shelf, height)
    return corners, y + shelf
