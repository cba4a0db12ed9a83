# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Readers of recorded RGB-D data, one a file, all yielding the same :class:`RgbdFrame`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.trajectory import Trajectory

OnDamaged = Callable[[InputError], None]
"""Told of each image that cannot be used; what it raises ends the reading."""

_OF_A_BAG = ('--colour-topic', '--depth-topic', '--info-topic', '--ground-truth-topic')

_KINDS = ('a ROS 2 bag (a folder with metadata.yaml, a .mcap or .db3 file), a ROS 1 bag (a .bag '
          'file), a TUM folder (with rgb.txt and depth.txt), a folder of frame-000000.color.png, '
          'frame-000000.depth.png and so on, or synthetic:SEED')


def raise_damage(error: InputError) -> None:
    """Let the first damaged image end the reading: the default of ``on_damaged``."""
    raise error


class RgbdSource(Protocol):
    """
    A recording, read in order, each time from the start.

    ``name`` is for people; ``ground_truth`` is the path of the colour camera, or None.
    """

    name: str
    ground_truth: Trajectory | None

    def __len__(self) -> int:
        """Return the number of frames, or an upper bound where pairs are found while reading."""

    def frames(self, on_damaged: OnDamaged = raise_damage) -> Iterator[RgbdFrame]:
        """
        Yield the frames, their colour stamps strictly increasing.

        :param on_damaged: told of each image that cannot be read, and of each whose stamp repeats
            or goes back; what it returns from is skipped, what it raises ends the reading.
        """


@dataclass(frozen=True)
class SourceOptions:
    """
    How to read a recording, where it does not say so itself.

    :param camera: file with the calibration, as :mod:`aick_ros.sources.calibration` has it;
        None: the recording's own.
    :param colour_topic: of a bag; depth_topic, info_topic, ground_truth_topic likewise; None:
        found by type and name.
    :param max_interval: largest difference of the stamps of a colour and a depth image [s].
    """

    camera: Path | None = None
    colour_topic: str | None = None
    depth_topic: str | None = None
    info_topic: str | None = None
    ground_truth_topic: str | None = None
    max_interval: float = 0.02


def open_source(path: str | Path, options: SourceOptions = SourceOptions()) -> RgbdSource:
    """
    Open a recording of any kind.

    :param path: file or folder, or ``synthetic:SEED`` for a rendered sequence.
    :raises InputError: where there is nothing that can be read.
    """
    scheme, _, seed = str(path).partition(':')
    if scheme == 'synthetic':
        _refuse(options, 'a rendered recording', '--camera', *_OF_A_BAG)
        return _open_synthetic(seed)
    path = Path(path)
    names = _names(path)
    suffixes = {Path(name).suffix for name in names}
    if suffixes & {'.mcap', '.db3'} or 'metadata.yaml' in names or (
            path.is_file() and '.bag' in suffixes):
        from aick_ros.sources.bag import BagSource
        return BagSource(path, options)
    _refuse(options, f'{path}, which is no bag', *_OF_A_BAG)
    if names & {'rgb.txt', 'depth.txt'}:
        from aick_ros.sources.tum import TumSource
        return TumSource(path, options)
    if any(name.startswith('frame-') for name in names):
        from aick_ros.sources.images import ImagesSource
        return ImagesSource(path, options)
    content = 'is no recording that is known' if names else 'is empty'
    raise InputError(f'{path} {content}: a source is {_KINDS}')


def _refuse(options: SourceOptions, what: str, *flags: str) -> None:
    """Refuse what would have no effect."""
    for flag in flags:
        value = getattr(options, flag.strip('-').replace('-', '_'))
        if value is not None:
            raise InputError(f'{flag} {value} means nothing for {what}: leave it out')


def _names(path: Path) -> set[str]:
    """Return the names in a folder, or that of a file."""
    try:
        if path.is_dir():
            return {entry.name for entry in path.iterdir()}
        path.stat()
    except FileNotFoundError:
        raise InputError(f'{path} does not exist: a source is {_KINDS}') from None
    except OSError as error:
        raise InputError(f'cannot read {path}: {error.strerror}') from None
    return {path.name}


def _open_synthetic(seed: str) -> RgbdSource:
    if seed and not seed.isdecimal():
        raise InputError(f'synthetic:{seed} has no whole number for a seed: try synthetic:1')
    from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
    return SyntheticSource(SyntheticOptions(seed=int(seed)) if seed else SyntheticOptions())
