# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Vocabularies learned by the command, and used by another one."""

import dataclasses
import json
import signal

import numpy as np
import pytest

from aick_ros.cli.commands import vocabulary as vocabulary_module
from aick_ros.errors import InputError
from aick_ros.features.vocabulary import load
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources import raise_damage


@pytest.fixture(autouse=True)
def sources(monkeypatch, recording):
    """Let every source be the recording in memory."""
    monkeypatch.setattr(vocabulary_module, 'open_source', lambda *_: recording)


@pytest.mark.parametrize('detector, bytes_each', [('orb', 32), ('surf', 256)])
def test_learns_words_of_the_keypoints_that_the_parameters_choose(
        aick, tmp_path, recording, detector, bytes_each):
    outcome = aick('vocabulary', 'one', 'two', '--out', 'words', '--words', '40', '--every', '5',
                   '--set', f'features.detector={detector}')
    assert (outcome.code, outcome.err) == (0, '')
    settings = with_values(Settings(), {'features.detector': detector})
    extractor = KeypointExtractor(settings.features, settings.sensor)
    frames = list(recording.frames(raise_damage))[::5]
    keypoints = 2 * sum(len(extractor.extract(frame)) for frame in frames)
    assert outcome.out == (f'40 words of {keypoints} {detector} keypoints, {2 * len(frames)} '
                           'frames, in words\n')
    learned = load(tmp_path / 'words')
    assert (learned.detector, len(learned)) == (detector, 40)
    assert learned.words[0].nbytes == bytes_each
    assert learned.learned_from == f'{2 * len(frames)} frames of one, two'


def test_what_is_masked_teaches_no_words(aick, tmp_path, monkeypatch, recording):
    """Other images there change not one of them."""
    class Covered:
        name = recording.name

        def __len__(self):
            return len(recording)

        def frames(self, on_damaged):
            rng = np.random.default_rng(1)
            for frame in recording.frames(on_damaged):
                colour, depth = frame.colour.copy(), frame.depth.copy()
                part = np.s_[:, 3 * colour.shape[1] // 4:]
                colour[part] = rng.integers(0, 256, colour[part].shape)
                depth[part] = 1.0
                yield dataclasses.replace(frame, colour=colour, depth=depth)

    learn = ('vocabulary', 'one', '--words', '30', '--set', 'sensor.roi_ratios=0 0.25 0 0')
    aick(*learn, '--out', 'expected')
    monkeypatch.setattr(vocabulary_module, 'open_source', lambda *_: Covered())
    aick(*learn, '--out', 'found')
    aick(*learn[:-2], '--out', 'without')
    expected, found, without = (
        (tmp_path / name).read_bytes() for name in ('expected', 'found', 'without'))
    assert found == expected != without


def test_the_seed_decides(aick, tmp_path):
    for name, seed in (('a', 3), ('b', 3), ('c', 4)):
        aick('vocabulary', 'one', '--out', name, '--words', '30', '--seed', seed)
    a, b, c = ((tmp_path / name).read_bytes() for name in 'abc')
    assert a == b
    assert a != c


def test_what_is_learned_can_be_used(aick, tmp_path, monkeypatch, recording):
    aick('vocabulary', 'one', '--out', 'words', '--words', '30', '--every', '1')
    monkeypatch.setattr('aick_ros.cli.commands.evaluate.open_source',
                        lambda path, options: recording)
    use = ('--set', 'aick.vocabulary=words', '--set', 'aick.word_radius=0.3')
    figures = json.loads(aick('evaluate', 'one', '--gaps', '1', '--json', '-', *use).out)
    assert figures['settings']['aick.vocabulary'] == 'words'
    assert figures['pairs']['1']['success_ratio']['0.05'] > 0.8
    refused = aick('evaluate', 'one', *use, '--set', 'features.detector=surf')
    assert refused.code == 2
    assert 'words is of orb keypoints and features.detector is surf' in refused.sentence


@pytest.mark.parametrize('option, value, words', [
    ('--words', '0', '--words'), ('--words', '99999', 'too few for 99999 words'),
    ('--every', '0', '--every'), ('--out', 'no/where/words', 'does not exist'),
    ('--set', 'features.detector=brisk', "none of 'orb'")])
def test_impossible_requests_are_rejected(aick, tmp_path, option, value, words):
    outcome = aick('vocabulary', 'one', *(() if option == '--out' else ('--out', 'words')),
                   option, value)
    assert outcome.code == 2
    assert words in outcome.sentence
    assert list(tmp_path.iterdir()) == []


def test_interrupted_it_leaves_nothing(aick, tmp_path, monkeypatch, recording, in_memory):
    def interrupt(index, on_damaged):
        if index == 1:
            signal.raise_signal(signal.SIGINT)

    source = in_memory(list(recording.frames(raise_damage)), on_frame=interrupt)
    monkeypatch.setattr(vocabulary_module, 'open_source', lambda *_: source)
    outcome = aick('vocabulary', 'one', '--out', 'words')
    assert (outcome.code, outcome.sentence) == (130, 'interrupted')
    assert list(tmp_path.iterdir()) == []


def test_a_source_that_breaks_teaches_nothing(aick, tmp_path, monkeypatch, recording, in_memory):
    def tear(index, on_damaged):
        if index == 2:
            raise InputError('the file ends in the middle of a frame')

    source = in_memory(list(recording.frames(raise_damage)), on_frame=tear)
    monkeypatch.setattr(vocabulary_module, 'open_source', lambda *_: source)
    outcome = aick('vocabulary', 'one', '--out', 'words', '--words', '5')
    assert (outcome.code, outcome.sentence) == (2, 'one: the file ends in the middle of a frame')
    assert list(tmp_path.iterdir()) == []


def test_without_keypoints_there_is_nothing_to_learn(aick, tmp_path, monkeypatch, in_memory):
    monkeypatch.setattr(vocabulary_module, 'open_source', lambda *_: in_memory([]))
    outcome = aick('vocabulary', 'one', '--out', 'words')
    assert outcome.code == 2
    assert 'has no usable frame' in outcome.sentence
    assert list(tmp_path.iterdir()) == []
