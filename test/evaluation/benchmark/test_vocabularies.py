# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The vocabularies of the figure that compares their sizes."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.evaluation.baselines.registry import make
from aick_ros.evaluation.benchmark import vocabularies
from aick_ros.evaluation.benchmark.figures import paper_figures, variants
from aick_ros.evaluation.benchmark.vocabularies import (
    DETECTORS, SIZES, file_name, learn, missing_from, training_frames)
from aick_ros.features.vocabulary import load
from aick_ros.settings.presets import preset

FEW = [('orb', 10), ('surf', 30)]


@pytest.fixture(scope='module')
def learned(tmp_path_factory):
    """Return a folder with vocabularies learned from one frame, and the progress reported."""
    folder, progress = tmp_path_factory.mktemp('vocabularies'), []
    frames = iter([next(training_frames())])
    for wanted, vocabulary in learn(FEW, frames, progress.append):
        (folder / file_name(wanted)).write_bytes(vocabulary.to_bytes())
    return folder, progress


def test_learns_so_many_words_of_the_detector(learned):
    folder, progress = learned
    for detector, size in FEW:
        vocabulary = load(folder / file_name((detector, size)))
        assert (vocabulary.detector, len(vocabulary)) == (detector, size)
    assert progress == [1, 2, 3]


def test_learns_only_what_is_missing(learned):
    every = [(detector, size) for detector in DETECTORS for size in SIZES]
    assert missing_from(learned[0]) == [wanted for wanted in every if wanted not in FEW]
    assert missing_from(learned[0] / 'nowhere') == every
    assert min(SIZES) == 10 and max(SIZES) == 5000


def test_the_figures_have_a_curve_for_each_size(learned):
    folder = learned[0]
    sized = {method.options['changes']['aick.vocabulary']: method
             for method in variants(paper_figures(folder))
             if 'aick.vocabulary' in method.options['changes']}
    assert len(sized) == 2 * len(SIZES)
    assert len(variants(paper_figures())) == len(variants(paper_figures(folder))) - len(sized)
    for detector, size in FEW:
        method = sized[str(folder / file_name((detector, size)))]
        assert method.title == f'{size} words'
        make(method.factory, method.options)  # refuses a vocabulary of another detector


def test_training_frames_are_those_of_other_rooms_than_the_tests(monkeypatch):
    class Source:
        def __init__(self, options):
            rooms.append(options)

        def frame(self, index):
            return rooms[-1].seed, index

    rooms = []
    monkeypatch.setattr(vocabularies, 'SyntheticSource', Source)
    found = list(training_frames())
    assert len(found) == len(set(found)) == vocabularies.TRAINING_FRAMES == 60
    assert [options.seed for options in rooms] == list(range(1000, 1012))
    assert all(index < options.frames for options in rooms for _, index in found)
    assert {options.rate for options in rooms} == {0.7}


def test_words_are_learned_of_all_keypoints_of_the_detector_alone(monkeypatch):
    class Extractor:
        def __init__(self, features, sensor):
            self.detector = features.detector

        def extract(self, frame):
            return SimpleNamespace(descriptors=np.full((2, 32), frame + (
                100 if self.detector == 'surf' else 0), np.uint8))

    def learn_words(descriptors, size, rounds):
        asked.append((sorted(set(descriptors.ravel().tolist())), len(descriptors), size, rounds))
        return descriptors[:size]

    asked = []
    monkeypatch.setattr(vocabularies, 'KeypointExtractor', Extractor)
    monkeypatch.setattr(vocabularies, 'learn_words', learn_words)
    monkeypatch.setattr(vocabularies, 'Vocabulary', lambda *parts: parts)
    progress = []
    found = list(learn([('orb', 2), ('surf', 3), ('orb', 4)], iter([1, 2]), progress.append))
    assert asked == [([1, 2], 4, 2, 5), ([101, 102], 4, 3, 5), ([1, 2], 4, 4, 5)]
    assert [(wanted, detector, len(words), text) for wanted, (detector, words, text) in found] == [
        ((name, size), name, size, '12 rendered rooms')
        for name, size in (('orb', 2), ('surf', 3), ('orb', 4))]
    assert progress == [1, 2, 3, 4, 5]


@pytest.mark.parametrize('detector', DETECTORS)
def test_the_keypoints_are_those_of_the_detector(detector):
    assert preset(DETECTORS[detector]).features.detector == detector
    assert file_name((detector, 300)) == f'{detector}-300.npz'
