# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Vocabularies: their files, rejected files, and the words of keypoints."""

import io
import re
import struct
import zipfile

import numpy as np
import pytest

from aick_ros.borders.limits import MAX_VOCABULARY_BYTES, MAX_WORDS
from aick_ros.errors import InputError
from aick_ros.features.descriptors import descriptor_distances
from aick_ros.features.vocabulary import Vocabulary, load, shipped, vocabulary_of
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

RNG = np.random.default_rng(0)
BINARY = RNG.integers(0, 256, (20, 32), dtype=np.uint8)
FLOAT = RNG.normal(0, 1, (20, 64)).astype(np.float32)


def settings(**changes):
    return with_values(Settings(), {name.replace('__', '.'): value
                                    for name, value in changes.items()})


def altered(tmp_path, **fields):
    """Write a vocabulary with some fields replaced, or removed if None."""
    with np.load(io.BytesIO(Vocabulary('orb', BINARY, 'a test').to_bytes())) as file:
        content = {**{name: file[name] for name in file.files}, **fields}
    path = tmp_path / 'altered.npz'
    np.savez(path, **{name: value for name, value in content.items() if value is not None})
    return path


@pytest.mark.parametrize('detector, words', [('orb', BINARY), ('surf', FLOAT)])
def test_a_file_is_read_back_unchanged(tmp_path, detector, words):
    path = tmp_path / 'words'
    path.write_bytes(Vocabulary(detector, words, 'a test').to_bytes())
    read = load(path)
    assert (read.detector, read.learned_from, len(read)) == (detector, 'a test', 20)
    np.testing.assert_array_equal(read.words, words)
    assert read.words.dtype == words.dtype
    assert read.to_bytes() == path.read_bytes()


@pytest.mark.parametrize('share', [0.0, 0.1, 0.5, 0.98])
def test_a_truncated_file_is_rejected(tmp_path, share):
    content = Vocabulary('orb', BINARY).to_bytes()
    path = tmp_path / 'cut.npz'
    path.write_bytes(content[:int(share * len(content))])
    with pytest.raises(InputError, match='cut.npz is not a vocabulary, or is truncated'):
        load(path)


@pytest.mark.parametrize('content', [b'hello', b'\x93NUMPY\x01\x00v\x00', bytes(1000)])
def test_another_kind_of_file_is_rejected(tmp_path, content):
    (tmp_path / 'file').write_bytes(content)
    with pytest.raises(InputError, match='file is not a vocabulary'):
        load(tmp_path / 'file')


def test_a_plain_array_is_rejected(tmp_path):
    np.save(tmp_path / 'array.npy', BINARY)
    with pytest.raises(InputError, match='array.npy is not a vocabulary'):
        load(tmp_path / 'array.npy')


@pytest.mark.parametrize('fields, sentence', [
    ({'version': 2}, 'is of version 2, but version 1 is required: learn it again'),
    ({'version': 0}, 'is of version 0, but version 1 is required: learn it again'),
    ({'count': 21}, r'declares 21 words of orb but has uint8 of shape \(20, 32\)'),
    ({'words': BINARY[:0], 'count': 0}, 'declares 0 words'),
    ({'words': BINARY.ravel()}, r'uint8 of shape \(640,\)'),
    ({'words': BINARY.astype(np.int64)}, 'has int64'),
    ({'words': None}, 'is not a vocabulary'),
    ({'version': None}, 'is not a vocabulary'),
    ({'version': 'first'}, 'is not a vocabulary'),
    ({'words': FLOAT}, r'declares 20 words of orb but has float32 of shape \(20, 64\)'),
    ({'words': BINARY[:, :16]}, r'has uint8 of shape \(20, 16\)'),
    ({'detector': 'surf', 'words': np.full((20, 64), np.nan, np.float32)},
     'the vocabulary .* has words that are not finite: learn it again with `aick vocabulary`$'),
    ({'detector': 'magic'}, "unknown detector 'magic'"),
    ({'words': np.zeros((MAX_WORDS + 1, 32), np.uint8), 'count': MAX_WORDS + 1},
     f' has {MAX_WORDS + 1} words, but at most {MAX_WORDS} are supported: learn it again'),
    ({'version': np.zeros(3)}, 'is not a vocabulary'),
    ({'learned_from': np.array([{}], object)}, 'is not a vocabulary')])
def test_inconsistent_files_are_rejected(tmp_path, fields, sentence):
    with pytest.raises(InputError, match=sentence):
        load(altered(tmp_path, **fields))


def test_a_vocabulary_of_the_most_words_is_read(tmp_path):
    words = np.zeros((MAX_WORDS, 32), np.uint8)
    assert len(load(altered(tmp_path, words=words, count=MAX_WORDS)).words) == MAX_WORDS


def archive(path, header=None, **entry):
    """Write a vocabulary whose words have another header, or another entry in the archive."""
    with zipfile.ZipFile(io.BytesIO(Vocabulary('orb', BINARY).to_bytes())) as old, \
            zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            content = old.read(name)
            if header is not None and name == 'words.npy':
                content = content.replace(b'(20, 32)', header)
            new.writestr(name, content, **entry)


@pytest.mark.parametrize('shape', [b'(1000000000000, 32)', b'(20, 33)', b'(-1, 32)', b'(20,)'])
def test_arrays_are_of_the_size_that_they_declare(tmp_path, shape):
    archive(tmp_path / 'words.npz', shape)
    with pytest.raises(InputError, match='words.npz is not a vocabulary'):
        load(tmp_path / 'words.npz')


@pytest.mark.parametrize('method', [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_damage_to_any_byte_is_an_input_error_or_changes_nothing(tmp_path, method):
    archive(tmp_path / 'words.npz', compress_type=method)
    content = (tmp_path / 'words.npz').read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(200):
        damaged = bytearray(content)
        damaged[rng.integers(len(content))] ^= 1 << rng.integers(8)
        (tmp_path / 'damaged.npz').write_bytes(damaged)
        try:
            load(tmp_path / 'damaged.npz')
        except InputError:
            pass


@pytest.mark.parametrize('flags, method', [(1, 8), (0, 99)], ids=['encrypted', 'unknown method'])
def test_archives_that_cannot_be_unpacked_are_rejected(tmp_path, flags, method):
    content = bytearray(Vocabulary('orb', BINARY).to_bytes())
    for signature, offset in ((b'PK\x03\x04', 6), (b'PK\x01\x02', 8)):
        for found in re.finditer(re.escape(signature), bytes(content)):
            struct.pack_into('<HH', content, found.start() + offset, flags, method)
    (tmp_path / 'words.npz').write_bytes(content)
    with pytest.raises(InputError, match='words.npz is not a vocabulary'):
        load(tmp_path / 'words.npz')


@pytest.mark.parametrize('large', [['words'], ['words', 'learned_from']])
def test_arrays_are_not_unpacked_beyond_the_limit(tmp_path, large):
    """One of them, or all together."""
    with zipfile.ZipFile(tmp_path / 'words.npz', 'w', zipfile.ZIP_DEFLATED) as file:
        for name in {'version', 'detector', 'count', 'words', 'learned_from'} - set(large):
            file.writestr(f'{name}.npy', b'')
        for name in large:
            with file.open(f'{name}.npy', 'w') as array:
                for _ in range(MAX_VOCABULARY_BYTES // len(large) // 2 ** 20 + 1):
                    array.write(bytes(2 ** 20))
    with pytest.raises(InputError, match=fr'truncated \(its arrays have more than '
                                         fr'{MAX_VOCABULARY_BYTES} bytes\): learn it again with '):
        load(tmp_path / 'words.npz')


def test_a_missing_vocabulary_is_reported_with_those_available():
    with pytest.raises(InputError, match=(
            '^there is no vocabulary nowhere: aick.vocabulary must be a '
            'file or one of orb-1000, surf-1000$')):
        vocabulary_of(settings(aick__vocabulary='nowhere'))


def test_a_folder_is_rejected(tmp_path):
    with pytest.raises(InputError, match='cannot read the vocabulary'):
        load(tmp_path)


def test_a_vocabulary_of_another_detector_is_rejected():
    with pytest.raises(InputError, match=(
            'the vocabulary surf-1000 is of surf keypoints and features.detector is orb: choose '
            'another one in aick.vocabulary, or learn one with `aick vocabulary`$')):
        vocabulary_of(settings(aick__vocabulary='surf-1000'))


@pytest.mark.parametrize('detector', ['orb', 'surf'])
def test_shipped_vocabularies_fit_their_detector(detector):
    chosen = settings(aick__vocabulary=f'{detector}-1000', features__detector=detector)
    vocabulary = vocabulary_of(chosen)
    assert f'{detector}-1000' in shipped()
    assert len(np.unique(vocabulary.words, axis=0)) == len(vocabulary) == 1000
    assert 'rendered' in vocabulary.learned_from
    frame = SyntheticSource(SyntheticOptions(seed=3, frames=1)).frame(0)
    keypoints = KeypointExtractor(chosen.features, chosen.sensor, vocabulary, 0.25).extract(frame)
    closest = descriptor_distances(keypoints.descriptors, vocabulary.words).min(axis=1)
    other = np.random.default_rng(0).permutation(len(keypoints))
    random_pairs = descriptor_distances(keypoints.descriptors, keypoints.descriptors[other])
    assert np.median(closest) < 0.7 * np.median(random_pairs)  # the words represent the image


def test_without_a_vocabulary_the_search_is_exhaustive():
    assert vocabulary_of(Settings()) is None


@pytest.mark.parametrize('descriptors, words, radius', [
    (BINARY, BINARY[::2], 0.48), (FLOAT, FLOAT[1::3], 110.0), (BINARY, BINARY[:1], 0.0),
    (BINARY, BINARY[5:9], np.inf), (BINARY[:0], BINARY, 0.5)])
def test_the_index_is_that_of_the_paper(descriptors, words, radius):
    """III-B: Psi has the words closer than R_w; the index has the keypoints of each word."""
    found = Vocabulary('test', words).words_of(descriptors, radius)
    distances = descriptor_distances(descriptors, words)
    assert found.starts.shape == (len(words) + 1,)
    for word in range(len(words)):
        index = found.keypoints[found.starts[word]:found.starts[word + 1]]
        assert list(index) == [k for k in range(len(descriptors)) if distances[k, word] < radius]
    assert list(found.closest) == [min(range(len(words)), key=lambda word: distances[k, word])
                                   for k in range(len(descriptors))]


@pytest.mark.parametrize('name', ['words', 'orb-1000'])
def test_a_vocabulary_is_a_file_unless_it_is_one_of_those_shipped(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_bytes(Vocabulary('orb', BINARY, 'mine').to_bytes())
    found = vocabulary_of(settings(aick__vocabulary=name))
    assert (found.learned_from == 'mine') is (name == 'words')


def test_a_vocabulary_may_be_in_the_home_folder(tmp_path, monkeypatch):
    """As no shell fills in ~ in a parameter file."""
    monkeypatch.setenv('HOME', str(tmp_path))
    (tmp_path / 'words').write_bytes(Vocabulary('orb', BINARY, 'mine').to_bytes())
    assert vocabulary_of(settings(aick__vocabulary='~/words')).learned_from == 'mine'


def test_pairs_are_those_under_the_closest_word():
    """By a loop over keypoints: each is compared with those that have its closest word."""
    words = Vocabulary('test', BINARY[:6])
    source, target = (words.words_of(BINARY[part], 0.47) for part in (slice(0, 15), slice(3, 20)))
    expected = [(keypoint, other) for keypoint, word in enumerate(source.closest)
                for other in sorted(target.keypoints[target.starts[word]:target.starts[word + 1]])]
    assert 20 < len(expected) < 15 * 17
    assert list(zip(*source.pairs(target).tolist())) == expected
    none = words.words_of(BINARY[:0], 0.5)
    assert source.pairs(none).shape == none.pairs(source).shape == (2, 0)


def test_an_array_of_another_size_is_described(tmp_path):
    archive(tmp_path / 'words.npz', b'(20, 33)')
    size = 128 + 20 * 32  # the header of the format, and the words
    with pytest.raises(InputError) as raised:
        load(tmp_path / 'words.npz')
    assert str(raised.value) == (
        f'{tmp_path}/words.npz is not a vocabulary, or is truncated (words declares uint8 of '
        f'shape (20, 33) and has {size} bytes): learn it again with `aick vocabulary`')
