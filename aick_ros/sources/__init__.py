# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Readers of recorded RGB-D data, one per file, all yielding :class:`RgbdFrame`."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Protocol

from aick_ros.borders.names import quoted_if_blank
from aick_ros.borders.values import number, numbers, required
from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.trajectory import Trajectory

OnDamaged = Callable[[InputError], None]
"""Callback for each image that cannot be used; an exception that it raises ends the reading."""

BAG_FLAGS = ('--colour-topic', '--depth-topic', '--info-topic', '--ground-truth-topic',
             '--register-depth', '--depth-info-topic', '--depth-in-colour')
"""Flags that have an effect on bags only."""

_RENDERED = 'synthetic'

_SEED_DIGITS = 18  # of a rendered recording; derived: below 2^63

_URL = re.compile('[a-z][a-z0-9+.-]+:/')  # as a path, which has single slashes
_KINDS = ('a ROS 2 bag (a folder with metadata.yaml, a .mcap or .db3 file), a ROS 1 bag (a .bag '
          'file), a TUM folder (with rgb.txt and depth.txt), a folder of frame-000000.color.png, '
          'frame-000000.depth.png and so on, or synthetic:SEED')


class Kind(Enum):
    """Kind of a recording that files make up."""

    BAG = 'bag'
    TUM = 'TUM folder'
    IMAGES = 'folder of numbered images'


def raise_damage(error: InputError) -> None:
    """Let the first damaged image end the reading: the default of ``on_damaged``."""
    raise error


class RgbdSource(Protocol):
    """A recording, read in order, each time from its start."""

    @property
    def name(self) -> str:
        """Name of the recording, for people."""

    @property
    def ground_truth(self) -> Trajectory | None:
        """Path of the colour camera, ``T_world_camera``; None where it is not known."""

    def __len__(self) -> int:
        """Return the number of frames, or an upper bound where pairs are found while reading."""

    @property
    def remarks(self) -> Sequence[str]:
        """Sentences on what of it was not used, and why; complete once it has been read."""

    def frames(self, on_damaged: OnDamaged = raise_damage) -> Iterator[RgbdFrame]:
        """
        Yield the frames, their colour stamps strictly increasing.

        :param on_damaged: called with the error of each image that cannot be read, and of each
            whose stamp is not after the one before. Where it returns, the image is skipped; where
            it raises, the reading ends.
        """


@dataclass(frozen=True)
class SourceOptions:
    """
    How to read a recording, where the recording does not say so itself.

    :param camera: file with the calibration of the colour camera, see
        :mod:`aick_ros.sources.calibration`; None: that of the recording.
    :param colour_topic: topic of the colour images of a bag; depth_topic, info_topic,
        ground_truth_topic likewise; None: found by type and name.
    :param max_interval: largest difference of the stamps of a colour and a depth image [s].
    :param register_depth: whether the depth images of a bag are in the image of their own camera,
        and are to be registered to the colour camera.
    :param depth_info_topic: topic of the depth camera's camera_info; None: found by name.
    :param depth_in_colour: ``T_colour_depth`` between the two optical frames, as x y z [m] and
        the quaternion qx qy qz qw; None: from /tf_static in the bag.
    :raises InputError: where a value is of another type, or the interval negative.
    """

    camera: Path | None = None
    colour_topic: str | None = None
    depth_topic: str | None = None
    info_topic: str | None = None
    ground_truth_topic: str | None = None
    max_interval: float = 0.02
    register_depth: bool = False
    depth_info_topic: str | None = None
    depth_in_colour: Sequence[float] | None = None

    def __post_init__(self) -> None:
        """Reject values of other types."""
        if self.camera is not None:
            object.__setattr__(self, 'camera', _path(self.camera, 'camera'))
        for name in ('colour_topic', 'depth_topic', 'info_topic', 'ground_truth_topic',
                     'depth_info_topic'):
            if getattr(self, name) is not None:
                required(getattr(self, name), str, name)
        if number(self.max_interval, 'max_interval') < 0.0:
            raise InputError(f'max_interval is {self.max_interval}: at least 0 s is required')
        required(self.register_depth, bool, 'register_depth')
        if self.depth_in_colour is not None:
            object.__setattr__(self, 'depth_in_colour', tuple(
                numbers(self.depth_in_colour, (None,), 'depth_in_colour').tolist()))


def _path(path: object, name: str) -> Path:
    """Return a path; InputError where it is neither that nor its text."""
    if not isinstance(path, str | Path):
        raise InputError(f'{name} is of the type {type(path).__name__}: a path is required')
    if path == '':  # which pathlib takes for the current folder
        raise InputError(f'{name} is an empty text: a path is required')
    return Path(path)


def is_rendered(path: str | Path) -> bool:
    """Return whether a source is a rendered sequence; ``./synthetic`` is a folder."""
    return str(path).partition(':')[0] == _RENDERED


def open_source(path: str | Path, options: SourceOptions = SourceOptions()) -> RgbdSource:
    """
    Open a recording of any kind.

    :param path: file or folder, or ``synthetic:SEED`` for a rendered sequence,
        ``synthetic`` for that of seed 0.
    :raises InputError: where nothing there can be read.
    """
    required(options, SourceOptions, 'options')
    name, path = str(path), _path(path, 'the source')
    if is_rendered(name):
        reject(options, 'a rendered recording', '--camera', *BAG_FLAGS)
        return _open_synthetic(name.partition(':')[2])
    names = _names(path)
    kind = kind_of(names, path.is_file())
    if kind is Kind.BAG:
        from aick_ros.sources.bag import BagSource
        return BagSource(path, options)
    reject(options, f'{path}, which is not a bag', *BAG_FLAGS)
    if kind is Kind.TUM:
        from aick_ros.sources.tum import TumSource
        return TumSource(path, options)
    if kind is Kind.IMAGES:
        from aick_ros.sources.images import ImagesSource
        return ImagesSource(path, options)
    content = 'is not a known kind of recording' if names else 'is empty'
    raise InputError(f'{path} {content}: a source is {_KINDS}')


def kind_at(path: Path) -> Kind | None:
    """
    Return the kind of the recording at a path; None where it is none.

    :raises InputError: where nothing there can be read.
    """
    return kind_of(_names(path), path.is_file())


def kind_of(names: Collection[str], is_file: bool) -> Kind | None:
    """
    Return the kind of a recording; None where it is none.

    :param names: of the files in its folder, or of its one file.
    """
    suffixes = {Path(name).suffix for name in names}
    if suffixes & {'.mcap', '.db3'} or 'metadata.yaml' in names or (
            is_file and '.bag' in suffixes):
        return Kind.BAG
    if 'rgb.txt' in names or 'depth.txt' in names:
        return Kind.TUM
    return Kind.IMAGES if any(name.startswith('frame-') for name in names) else None


def reject(options: SourceOptions, recording: str, *flags: str) -> None:
    """Raise InputError where a flag is set that has no effect on a recording."""
    for flag in flags:
        value = getattr(options, flag.strip('-').replace('-', '_'))
        if value is not None and value is not False:
            raise InputError(f'{flag} has no effect on {recording}: omit it')


def _names(path: Path) -> set[str]:
    """Return the names in a folder, or that of a file."""
    try:
        if path.is_dir():
            return {entry.name for entry in path.iterdir()}
        path.stat()
        if not path.is_file():
            raise InputError(f'cannot read {path}: it is neither a folder nor a regular file')
    except FileNotFoundError:
        if _URL.match(str(path)):
            raise InputError(f'{path} is a URL, which only aick fleet reads: copy the recording '
                             'to this machine') from None
        raise InputError(f'{quoted_if_blank(path)} does not exist: a source is {_KINDS}') from None
    except OSError as error:
        raise InputError(f'cannot read {path}: {error.strerror}') from None
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f'cannot read {str(path)!r}: {error}') from None  # NUL in the name
    return {path.name}


def _open_synthetic(seed: str) -> RgbdSource:
    if seed and not (seed.isdecimal() and len(seed) <= _SEED_DIGITS):
        raise InputError(f'synthetic:{seed} has a seed that is not a whole number of at most '
                         f'{_SEED_DIGITS} digits: try synthetic:1')
    from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
    return SyntheticSource(SyntheticOptions(seed=int(seed)) if seed else SyntheticOptions())
