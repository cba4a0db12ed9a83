# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The part of the images that is not used, as it shows the robot itself."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import os
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from aick_ros.borders.encoded_image import decode, format_of
from aick_ros.borders.files import read_bytes
from aick_ros.borders.limits import MAX_MESSAGE_BYTES
from aick_ros.borders.records import replaced
from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame, grey_of
from aick_ros.settings import SensorSettings

_MARGIN = 7  # px; chosen: corners nearer than this are of the edge of the mask, or seen with it
_NO_FRACTIONS = np.empty(0, np.uint16)  # of a pixel, for OpenCV
_ALL = 0.0, 0.0, 0.0, 0.0  # shares of the image that are not used
_FIELDS = dataclasses.fields(RgbdFrame)
_REMEDY = 'draw it on an image of the camera, and save it as PNG with one channel of 8 bits'
_ALTERNATIVES = 'name a PNG file that can be read, or none to use all of the images'


@dataclass(frozen=True, eq=False)
class Hidden:
    """
    The part of images of one size that is not used.

    :param no_depth: HxW float32, NaN where hidden, 0 elsewhere.
    :param where: rows and columns in which pixels are hidden.
    :param nearest: KxLx2 int16 (u, v), of each pixel there the nearest one that is not.
    :param keeps: HxW bool, false where keypoints are hidden, or too near to the edge.
    """

    no_depth: np.ndarray
    where: tuple[slice, slice]
    nearest: np.ndarray
    keeps: np.ndarray

    @staticmethod
    def of(used: np.ndarray) -> Hidden:
        """Return what is hidden where an image is used, HxW uint8 of 0 and 1."""
        hidden = 1 - used
        _, labels = cv2.distanceTransformWithLabels(
            hidden, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL)
        index_of = np.zeros(labels.max() + 1, np.int64)
        index_of[labels[used == 1]] = np.flatnonzero(used)
        u, v, columns, rows = cv2.boundingRect(hidden)
        where = slice(v, v + rows), slice(u, u + columns)
        nearest = np.dstack(np.divmod(index_of[labels[where]], used.shape[1])[::-1])
        kernel = np.ones((2 * _MARGIN + 1, 2 * _MARGIN + 1), np.uint8)
        return Hidden(np.where(hidden, np.float32(np.nan), np.float32(0.0)), where,
                      nearest.astype(np.int16), cv2.dilate(hidden, kernel) == 0)

    def filled(self, image: np.ndarray) -> np.ndarray:
        """Return an image, HxW or HxWxC, in which what is hidden looks like what is beside."""
        filled = image.copy()
        filled[self.where] = cv2.remap(image, self.nearest, _NO_FRACTIONS, cv2.INTER_NEAREST)
        filled.flags.writeable = False
        return filled


@dataclass(frozen=True, eq=False)
class MaskedFrame(RgbdFrame):
    """
    A frame of which a part is hidden, whatever is made of it.

    There it has no depth. Its colour image stays, for those who look at it.

    :param hidden: the part.
    """

    hidden: Hidden = field(kw_only=True)

    @cached_property
    def grey(self) -> np.ndarray:
        """The colour image in grey, HxW uint8; what is hidden is as bright as what is beside."""
        return self.hidden.filled(grey_of(self.colour))

    def without_colour(self) -> MaskedFrame:
        """Return the frame without the colours of what is hidden: those beside are there too."""
        return replaced(self, colour=self.hidden.filled(self.colour))

    def shows(self, pixels: np.ndarray) -> np.ndarray:
        """
        Return which pixels are used, N bool, those at the edge of what is hidden excluded.

        :param pixels: Nx2 (u, v) [px].
        """
        rows, columns = self.depth.shape
        u, v = np.rint(pixels).astype(np.int64).T
        shown: np.ndarray = self.hidden.keeps[v.clip(0, rows - 1), u.clip(0, columns - 1)]
        return shown


class ImageMask:
    """
    Hides a part of the images, which is fixed to the camera.

    There depth is NaN, and brightness that of the nearest pixel which is not hidden: what moves
    with the camera is gone, and no corner is at the edge of the mask.

    :param image: HxW uint8, 0 where images are not used; None: they are used everywhere.
    :param roi_ratios: shares of the image at its left, right, top and bottom that are not used.
    :param name: of the mask, for errors.
    :raises InputError: where nothing is left.
    """

    def __init__(self, image: np.ndarray | None, roi_ratios: tuple[float, ...] = _ALL,
                 name: str = 'the mask') -> None:
        self._image, self._roi_ratios, self._name = image, roi_ratios, name
        if image is not None and not image.any():
            raise InputError(f'{name} is 0 everywhere, so that nothing of the images is used: '
                             'let it be 255 where they show the surroundings')
        self._last: Hidden | None = None  # of images of the size seen last

    def __reduce__(self) -> tuple[type[ImageMask], tuple[object, ...]]:
        """Return how a copy is made, which computes anew what it hides of images of a size."""
        return ImageMask, (self._image, self._roi_ratios, self._name)

    def applied(self, frame: RgbdFrame) -> RgbdFrame:
        """
        Return a frame of which the part is hidden: itself where that is nothing.

        :raises InputError: where the mask does not fit the images.
        """
        hidden = self._hidden(*frame.depth.shape)
        if not hidden.nearest.size:
            return frame
        depth = frame.depth + hidden.no_depth
        depth.flags.writeable = False
        images = {known.name: getattr(frame, known.name) for known in _FIELDS}
        return MaskedFrame(**{**images, 'depth': depth}, hidden=hidden)

    @property
    def digest(self) -> str:
        """A text that differs from that of any other mask."""
        image = b'' if self._image is None else self._image.tobytes()
        shape = () if self._image is None else self._image.shape
        return hashlib.sha256(repr((shape, self._roi_ratios)).encode() + image).hexdigest()

    def _hidden(self, rows: int, columns: int) -> Hidden:
        """Return what is hidden of images of a size."""
        last = self._last  # another thread may replace it
        if last is None or last.keeps.shape != (rows, columns):
            last = self._last = Hidden.of(self._used(rows, columns))
        return last

    def _used(self, rows: int, columns: int) -> np.ndarray:
        """Return where images of a size are used, as 1, HxW uint8."""
        used = np.ones((rows, columns), np.uint8)
        if self._image is not None:
            self._check_fit(rows, columns, *self._image.shape)
            used = cv2.resize((self._image != 0).astype(np.uint8), (columns, rows),
                              interpolation=cv2.INTER_NEAREST_EXACT)
        if any(self._roi_ratios):
            left, right, top, bottom = self._roi_ratios
            inside = np.zeros_like(used)
            inside[round(top * rows):rows - round(bottom * rows),
                   round(left * columns):columns - round(right * columns)] = 1
            used &= inside
        if not used.any():
            names = [self._name] if self._image is not None else []
            names += ['sensor.roi_ratios'] if any(self._roi_ratios) else []
            raise InputError(f'{" and ".join(names)} hide all of an image of {columns} x {rows} '
                             'pixels: hide less')
        return used

    def _check_fit(self, rows: int, columns: int, height: int, width: int) -> None:
        # to a pixel of the smaller one
        if abs(width * rows - height * columns) > max(width, height, rows, columns):
            raise InputError(f'{self._name} has {width} x {height} pixels and the images '
                             f'{columns} x {rows}: it must have their size, or the same ratio of '
                             f'width to height; {_REMEDY}')


def mask_of(settings: SensorSettings, given_by: str = 'sensor.mask') -> ImageMask | None:
    """
    Return the mask that the settings name, None where images are used everywhere.

    :param given_by: name of the parameter or option that the file is from, for errors.
    :raises InputError: where its file cannot be read, or is no mask.
    """
    if not settings.mask:
        return _by(settings.roi_ratios) if any(settings.roi_ratios) else None
    path = os.path.expanduser(settings.mask)  # no shell fills in ~ in a parameter file
    try:
        path = os.path.abspath(path)  # nobody sees in which folder a node was started
        status = os.stat(path)
    except (OSError, ValueError) as error:  # ValueError: NUL in the name
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(f'cannot read the mask ({given_by}) {path}: {reason}; '
                         f'{_ALTERNATIVES}') from None
    return _read(path, given_by, settings.roi_ratios, status.st_mtime_ns, status.st_size)


@functools.lru_cache(maxsize=4)  # as below
def _by(roi_ratios: tuple[float, ...]) -> ImageMask:
    return ImageMask(None, roi_ratios)


@functools.lru_cache(maxsize=4)  # several registrars of one camera; chosen
def _read(path: str, given_by: str, roi_ratios: tuple[float, ...], changed: int,
          size: int) -> ImageMask:
    """Return the mask in a file, which was changed at a time [ns] and has a size [byte]."""
    name = f'the mask {path} ({given_by})'
    try:
        content = read_bytes(Path(path), f'the mask ({given_by})', MAX_MESSAGE_BYTES)
    except InputError as error:
        raise InputError(f'{error}; {_ALTERNATIVES}') from None
    kind = format_of(content)
    if kind != 'PNG':
        what = 'a JPEG image, which is nowhere quite 0' if kind else 'no PNG image'
        raise InputError(f'{name} is {what}: {_REMEDY}')
    try:
        image = decode(content)
    except InputError as error:
        raise InputError(f'{name} cannot be read: {error}') from None
    if image.ndim != 2 or image.dtype != np.uint8:
        channels = 1 if image.ndim == 2 else image.shape[2]
        raise InputError(f'{name} has {channels} channel{"" if channels == 1 else "s"} of '
                         f'{image.dtype}: {_REMEDY}')
    return ImageMask(image, roi_ratios, name)
