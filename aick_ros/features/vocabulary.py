# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Vocabulary of visual words, and the inverted index of a frame (III-B).

A keypoint is compared only with those of the other frame that are indexed under its closest word.
"""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from aick_ros.errors import InputError
from aick_ros.features.descriptors import descriptor_distances
from aick_ros.settings import Settings

VERSION = 1
"""Version of the file format; other versions are rejected."""

SHIPPED = Path(__file__).parent / 'vocabularies'
"""Folder of the vocabularies shipped with the package."""

_SUFFIX = '.npz'


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
        """Return the pairs (keypoint, target keypoint) to compare, 2xK, sorted by both."""
        first = target.starts.take(self.closest)
        lengths = target.starts.take(self.closest + 1) - first
        ends = lengths.cumsum()
        count = int(ends[-1]) if len(ends) else 0
        rows = np.empty((2, count), np.intp)
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
    vocabulary = load(SHIPPED / f'{name}{_SUFFIX}' if name in shipped() else Path(name))
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

    :raises InputError: if it cannot be read, or is damaged or of another version.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            version = int(file['version'])
            if version != VERSION:
                raise InputError(f'the vocabulary {path} is of version {version}, but version '
                                 f'{VERSION} is required: learn it again with `aick vocabulary`')
            vocabulary = Vocabulary(str(file['detector']), file['words'],
                                    str(file['learned_from']))
            count = int(file['count'])
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f'there is no vocabulary {path}: aick.vocabulary must be a file or one '
                         f'of {", ".join(shipped())}') from None
    except OSError as error:
        raise InputError(f'cannot read the vocabulary {path}: {error.strerror}') from None
    except (ValueError, KeyError, EOFError, TypeError, AttributeError,
            zipfile.BadZipFile) as error:
        raise InputError(f'{path} is not a vocabulary, or is truncated ({error}): learn it again '
                         'with `aick vocabulary`') from None
    words = vocabulary.words
    usable = words.ndim == 2 and words.dtype in (np.uint8, np.float32)
    if not usable or not len(words) == count > 0:
        raise InputError(f'the vocabulary {path} declares {count} words but has {words.dtype} of '
                         f'shape {words.shape}: learn it again with `aick vocabulary`')
    return vocabulary
