# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Vocabulary of visual words, and the inverted index of a frame (III-B).

A keypoint is compared only with those of the other frame that are indexed under its closest word.
"""

from __future__ import annotations

import io
import math
import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from aick_ros.borders.files import read_bytes
from aick_ros.borders.limits import MAX_VOCABULARY_BYTES, MAX_WORDS
from aick_ros.errors import InputError
from aick_ros.features.descriptors import descriptor_distances
from aick_ros.settings import Settings

VERSION = 1
"""Version of the file format; other versions are rejected."""

SHIPPED = Path(__file__).parent / 'vocabularies'
"""Folder of the vocabularies shipped with the package."""

_SUFFIX = '.npz'
_FIELDS = ('version', 'detector', 'count', 'words', 'learned_from')
_DESCRIPTORS = {'orb': (np.uint8, 32), 'surf': (np.float32, 64), 'sift': (np.float32, 128)}
"""Detector -> type and length of its descriptors, by definition."""


@dataclass(frozen=True, eq=False)
class Vocabulary:
    """
    Visual words: cluster centres of many descriptors.

    :param detector: detector of the descriptors, as named in ``features.detector``.
    :param words: WxD, of the type of the descriptors.
    :param learned_from: description of the training data.
    """

    detector: str
    words: np.ndarray
    learned_from: str = ''

    def __len__(self) -> int:
        """Return the number of words."""
        return len(self.words)

    def __deepcopy__(self, memo: dict[int, object]) -> Vocabulary:
        """Return itself: it does not change, and words are those of the same vocabulary or not."""
        return self

    def words_of(self, descriptors: np.ndarray, radius: float) -> FrameWords:
        """
        Return the inverted index of the keypoints of a frame.

        :param descriptors: NxD.
        :param radius: R_w, a descriptor distance as ``aick.lambda_f``; infinite: every keypoint is
            indexed under every word.
        """
        to_words = descriptor_distances(descriptors, self.words)
        word, keypoint = np.nonzero((to_words < radius).T)
        starts = np.searchsorted(word, np.arange(len(self) + 1))
        return FrameWords(self, to_words.argmin(axis=1), keypoint, starts)

    def to_bytes(self) -> bytes:
        """Return the content of a vocabulary file, the same bytes for the same words."""
        file = io.BytesIO()
        np.savez_compressed(file, version=VERSION, detector=self.detector, count=len(self),
                            words=self.words, learned_from=self.learned_from)
        return file.getvalue()


@dataclass(frozen=True, eq=False)
class FrameWords:
    """
    Inverted index of the N keypoints of a frame.

    :param vocabulary: vocabulary of W words.
    :param closest: N, closest word of each keypoint.
    :param keypoints: keypoints whose set Psi contains word 0, then word 1, and so on; ascending
        for each word.
    :param starts: W+1, offsets in ``keypoints``: word w has ``starts[w]`` to ``starts[w + 1]``.
    """

    vocabulary: Vocabulary
    closest: np.ndarray
    keypoints: np.ndarray
    starts: np.ndarray

    def pairs(self, target: FrameWords) -> np.ndarray:
        """Return the pairs (keypoint, target keypoint) to compare, 2xK int64, sorted by both."""
        first = target.starts.take(self.closest)
        lengths = target.starts.take(self.closest + 1) - first
        ends = lengths.cumsum()
        count = int(ends[-1]) if len(ends) else 0
        rows = np.empty((2, count), np.int64)
        rows[0] = np.arange(len(lengths)).repeat(lengths)
        # offset of the word in the target, minus offset of the pairs of this keypoint
        offsets = (first - ends + lengths).repeat(lengths)
        offsets += np.arange(count)
        rows[1] = target.keypoints.take(offsets)
        return rows


def vocabulary_of(settings: Settings) -> Vocabulary | None:
    """
    Return the vocabulary named by the settings, None for the exhaustive search.

    :raises InputError: if it is missing, damaged, or of another detector.
    """
    name = settings.aick.vocabulary
    if not name:
        return None
    # no shell fills in ~ in a parameter file
    vocabulary = load(SHIPPED / f'{name}{_SUFFIX}' if name in shipped()
                      else Path(os.path.expanduser(name)))
    if vocabulary.detector != settings.features.detector:
        raise InputError(
            f'the vocabulary {name} is of {vocabulary.detector} keypoints and features.detector '
            f'is {settings.features.detector}: choose another one in aick.vocabulary, or learn '
            'one with `aick vocabulary`')
    return vocabulary


def shipped() -> list[str]:
    """Return the names of the vocabularies shipped with the package."""
    return sorted(path.stem for path in SHIPPED.glob(f'*{_SUFFIX}'))


def load(path: Path) -> Vocabulary:
    """
    Read a vocabulary file.

    :raises InputError: if it cannot be read, is damaged, of another version or too large.
    """
    if not os.path.exists(path):  # unlike path.exists(), False where the name is too long
        raise InputError(f'there is no vocabulary {path}: aick.vocabulary must be a file or one '
                         f'of {", ".join(shipped())}')
    content = read_bytes(path, 'the vocabulary', MAX_VOCABULARY_BYTES)
    try:
        _check_headers(content)
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            version, count = int(file['version']), int(file['count'])
            vocabulary = Vocabulary(str(file['detector']), file['words'],
                                    str(file['learned_from']))
    except Exception as error:  # zipfile, zlib and NumPy raise nearly anything on damaged data
        raise InputError(f'{path} is not a vocabulary, or is truncated ({error}): learn it again '
                         'with `aick vocabulary`') from None
    fault = _fault(vocabulary, version, count)
    if fault:
        raise InputError(f'the vocabulary {path} {fault}: learn it again with `aick vocabulary`')
    return vocabulary


def _check_headers(content: bytes) -> None:
    """Raise ValueError where the arrays in a file have another size than their headers declare."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.getinfo(f'{name}.npy') for name in _FIELDS}
        if sum(member.file_size for member in members.values()) > MAX_VOCABULARY_BYTES:
            raise ValueError(f'its arrays have more than {MAX_VOCABULARY_BYTES} bytes')
        for name, member in members.items():
            with archive.open(member) as file:
                np.lib.format.read_magic(file)
                shape, _, dtype = np.lib.format.read_array_header_1_0(file)
                size = file.tell() + math.prod(shape) * dtype.itemsize
                if dtype.hasobject or size != member.file_size:
                    raise ValueError(f'{name} declares {dtype} of shape {shape} and has '
                                     f'{member.file_size} bytes')


def _fault(vocabulary: Vocabulary, version: int, count: int) -> str:
    """Return why a vocabulary cannot be used, '' where it can."""
    words, detector = vocabulary.words, vocabulary.detector
    if version != VERSION:
        return f'is of version {version}, but version {VERSION} is required'
    if detector not in _DESCRIPTORS:
        return f'is of the unknown detector {detector!r}'
    dtype, length = _DESCRIPTORS[detector]
    if words.dtype != dtype or words.shape[1:] != (length,) or not len(words) == count > 0:
        return (f'declares {count} words of {detector} but has {words.dtype} of shape '
                f'{words.shape}')
    if count > MAX_WORDS:
        return f'has {count} words, but at most {MAX_WORDS} are supported'
    if not np.isfinite(words).all():
        return 'has words that are not finite'
    return ''
