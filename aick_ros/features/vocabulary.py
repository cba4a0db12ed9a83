# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Vocabulary of visual words, and the words of a frame's keypoints (III-B).

With one, a keypoint is compared only with those of the other frame that know its closest word.
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
"""Of the files; one of another version is refused."""

SHIPPED = Path(__file__).parent / 'vocabularies'
_SUFFIX = '.npz'


@dataclass(frozen=True, eq=False)
class Vocabulary:
    """
    Words: the centres of clusters of many descriptors.

    :param detector: whose descriptors they are, as ``features.detector`` names it.
    :param words: WxD, of the type of the descriptors.
    :param learned_from: a sentence for people.
    """

    detector: str
    words: np.ndarray
    learned_from: str = ''

    def __len__(self) -> int:
        """Return the number of words."""
        return len(self.words)

    def words_of(self, descriptors: np.ndarray, radius: float) -> FrameWords:
        """
        Return the words of the keypoints of a frame.

        :param descriptors: NxD.
        :param radius: R_w, in the unit of ``aick.lambda_f``; infinite: each keypoint has all.
        """
        to_words = descriptor_distances(descriptors, self.words)
        word, keypoint = np.nonzero((to_words < radius).T)
        starts = np.searchsorted(word, np.arange(len(self) + 1))
        return FrameWords(self, to_words.argmin(axis=1), keypoint, starts)

    def to_bytes(self) -> bytes:
        """Return the content of a file that :func:`load` reads; the same words, the same bytes."""
        file = io.BytesIO()
        np.savez_compressed(file, version=VERSION, detector=self.detector, count=len(self),
                            words=self.words, learned_from=self.learned_from)
        return file.getvalue()


@dataclass(frozen=True, eq=False)
class FrameWords:
    """
    The words of N keypoints.

    :param vocabulary: they are of.
    :param closest: N, the closest word of each keypoint.
    :param keypoints: the keypoints that have word 0 in Psi, then those that have word 1, ...;
        those of a word in ascending order.
    :param starts: W+1, where the keypoints of a word begin; those of the next end them.
    """

    vocabulary: Vocabulary
    closest: np.ndarray
    keypoints: np.ndarray
    starts: np.ndarray

    def pairs(self, target: FrameWords) -> np.ndarray:
        """Return the pairs that are compared, 2xK, sorted by keypoint here, then there."""
        first = target.starts.take(self.closest)
        lengths = target.starts.take(self.closest + 1) - first
        ends = lengths.cumsum()
        count = int(ends[-1]) if len(ends) else 0
        rows = np.empty((2, count), np.intp)
        rows[0] = np.arange(len(lengths)).repeat(lengths)
        # where the keypoints of a word begin there, less where its pairs begin here
        places = (first - ends + lengths).repeat(lengths)
        places += np.arange(count)
        rows[1] = target.keypoints.take(places)
        return rows


def vocabulary_of(settings: Settings) -> Vocabulary | None:
    """
    Return the vocabulary that the settings name, None for the full search.

    :raises InputError: where there is none, or it is damaged, or of another detector.
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
    """Return the names of the vocabularies that come with the package."""
    return sorted(path.stem for path in SHIPPED.glob(f'*{_SUFFIX}'))


def load(path: Path) -> Vocabulary:
    """
    Read a vocabulary.

    :raises InputError: where it cannot be read or is not one of this version.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            version = int(file['version'])
            if version != VERSION:
                raise InputError(f'the vocabulary {path} is of version {version}, and version '
                                 f'{VERSION} is needed: learn it again with `aick vocabulary`')
            vocabulary = Vocabulary(str(file['detector']), file['words'],
                                    str(file['learned_from']))
            count = int(file['count'])
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f'there is no vocabulary {path}: aick.vocabulary takes a file or one of '
                         f'{", ".join(shipped())}') from None
    except OSError as error:
        raise InputError(f'cannot read the vocabulary {path}: {error.strerror}') from None
    except (ValueError, KeyError, EOFError, TypeError, AttributeError,
            zipfile.BadZipFile) as error:
        raise InputError(f'{path} is no vocabulary, or a truncated one ({error}): learn it again '
                         'with `aick vocabulary`') from None
    words = vocabulary.words
    usable = words.ndim == 2 and words.dtype in (np.uint8, np.float32)
    if not usable or not len(words) == count > 0:
        raise InputError(f'the vocabulary {path} says {count} words and has {words.dtype} of '
                         f'shape {words.shape}: learn it again with `aick vocabulary`')
    return vocabulary
